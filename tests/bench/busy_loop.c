/* What to compare with: a stepper as sketches do it. One loop looks at the clock, steps when it is
 * time, and answers a line when one is there. Pins, serial line and LEDs are those of the reference
 * board, and its answers are as long as the firmware's. */
#include "pins.h"

#include <avr/interrupt.h>
#include <stdbool.h>
#include <string.h>

static volatile uint16_t overflows;
static char line[64];
static uint8_t length;

ISR(TIMER1_OVF_vect)
{
    overflows++;
}

static uint32_t half_us(void)
{
    uint8_t before = SREG;
    cli();
    uint16_t low = TCNT1, high = overflows;
    if ((TIFR1 & _BV(TOV1)) && low < 0x8000)
        high++;
    SREG = before;
    return (uint32_t)high << 16 | low;
}

static void send_leds(void)
{
    for (uint8_t i = 0; i < 155; i++) {
        SPDR = i < 4 ? 0 : 0xFF;
        while (!(SPSR & _BV(SPIF)))
            ;
    }
}

static void answer(void)
{
    static const char reply[] = "12345 ok is=moving at=12345 *1B0000\n";
    if (memchr(line, 'l', length))
        send_leds();
    for (const char *c = reply; *c != '\0'; c++) {
        while (!(UCSR0A & _BV(UDRE0)))
            ;
        UDR0 = (uint8_t)*c;
    }
    length = 0;
}

int main(void)
{
    DDRE |= _BV(3);
    DDRH |= _BV(5);
    DDRB |= _BV(0) | _BV(1) | _BV(2);
    SPCR = _BV(SPE) | _BV(MSTR);
    UBRR0 = F_CPU / 8 / 250000 - 1;
    UCSR0A = _BV(U2X0);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    TCCR1B = _BV(CS11);
    TIMSK1 = _BV(TOIE1);
    sei();
    uint32_t next = half_us() + INTERVAL_HALF_US;
    for (;;) {
        if ((int32_t)(half_us() - next) >= 0) {
            pin_high(PIN_STEP);
            next += INTERVAL_HALF_US;
            pin_low(PIN_STEP);
        }
        if (UCSR0A & _BV(RXC0)) {
            char character = (char)UDR0;
            if (character == '\n')
                answer();
            else if (length < sizeof line)
                line[length++] = character;
        }
    }
}
