#include "serial.h"

#include "core.h"
#include "hal.h"
#include "idle.h"
#include "pins.h"

#include <avr/interrupt.h>

#define BAUD 250000UL

void serial_init(void)
{
    UBRR0 = F_CPU / 8 / BAUD - 1;
    UCSR0A = _BV(U2X0);
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

/* Steps may interrupt this. No second byte may, and no tick, which would take longer than the two
 * bytes that the chip can hold back. */
ISR(UART_RECEIVE_VECTOR)
{
    uint8_t byte = UDR0;
    uint8_t tick = TIMSK0;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0);
    TIMSK0 = 0;
    sei();
    core_receive(byte);
    idle_end();
    cli();
    TIMSK0 = tick;
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

/* Polled: an interrupt for each byte would disturb the steps, and the main loop has time. */
void hal_uart_write(uint8_t byte)
{
    while (!(UCSR0A & _BV(UDRE0)))
        ;
    UDR0 = byte;
}
