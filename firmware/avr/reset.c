/* What happens before anything else, and why: safe outputs, the reset's cause, the watchdog. */
#include "hal.h"
#include "pins.h"

#include <avr/interrupt.h>
#include <avr/wdt.h>

#define WATCHDOG_MARK 0xB17E
#define ENTROPY_BYTES 512

/* These survive a reset. Some boot loaders clear MCUSR, so the watchdog leaves a mark of its own. */
static uint16_t watchdog_mark __attribute__((section(".noinit")));
static uint8_t reset_flags __attribute__((section(".noinit")));
static uint32_t seed __attribute__((section(".noinit")));

extern const uint8_t __heap_start[];

static inline void make_safe(void);

/* Runs before memory is initialised. At reset every pin floats, and the resistors in WIRING.md hold
 * the motor driver and the LED supply off; from here on the pins do. */
__attribute__((naked, used, section(".init3"))) void before_all_else(void)
{
    make_safe();
    reset_flags = MCUSR;
    MCUSR = 0;
    wdt_disable();
    if (watchdog_mark == WATCHDOG_MARK)
        reset_flags |= _BV(WDRF);
    watchdog_mark = 0;
}

const char *hal_reset_cause(void)
{
    if (reset_flags & _BV(PORF))
        return "power";
    if (reset_flags & _BV(WDRF))
        return "watchdog";
    if (reset_flags & _BV(BORF))
        return "brownout";
    if (reset_flags & _BV(EXTRF))
        return "external";
    return "unknown";
}

/* Feeding starts it: an interrupt after 120 ms, the reset after at most 120 more. */
void hal_watchdog_feed(void)
{
    wdt_reset();
    if (WDTCSR & _BV(WDE))
        return;
    bool interrupts = hal_interrupts_off();
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = _BV(WDIE) | _BV(WDE) | WDTO_120MS;
    hal_interrupts_restore(interrupts);
}

ISR(WDT_vect)
{
    make_safe();
    watchdog_mark = WATCHDOG_MARK;
    WDTCSR = _BV(WDCE) | _BV(WDE);
    WDTCSR = _BV(WDE) | WDTO_15MS;
    for (;;)
        ;
}

/* Memory that nobody has written holds noise after power-up (D. Holcomb, W. Burleson, K. Fu, "Power-Up
 * SRAM State as an Identifying Fingerprint and Source of True Random Numbers", 2009). After a reset
 * without power loss it does not, but then the last boot's seed is still there to go on from. */
uint32_t hal_entropy(void)
{
    for (uint16_t i = 0; i < ENTROPY_BYTES; i++)
        seed = (seed ^ __heap_start[i]) * 16777619UL + 1;
    return seed;
}

/* The level first, then the direction: no output is wrong for even a cycle. */
#define drive(pin) pin(DDR_OF) = (uint8_t)(pin(DDR_OF) | pin(MASK_OF))

static inline __attribute__((always_inline)) void make_safe(void)
{
    pin_low(PIN_LED_SUPPLY);
    drive(PIN_LED_SUPPLY);
    pin_high(PIN_ENABLE);
    drive(PIN_ENABLE);
    pin_low(PIN_STEP);
    drive(PIN_STEP);
    pin_low(PIN_STROBE);
    drive(PIN_STROBE);
    drive(PIN_DIRECTION);
    pin_high(PIN_SPI_SELECT);
    drive(PIN_SPI_SELECT);
    drive(PIN_SPI_CLOCK);
    drive(PIN_SPI_DATA);
    pin_high(PIN_ESTOP);
    pin_high(PIN_INDEX);
    pin_high(PIN_BUTTON);
}
