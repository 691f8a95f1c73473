#include "clock.h"
#include "core.h"
#include "hal.h"
#include "idle.h"
#include "serial.h"
#include "spi.h"

#include <avr/interrupt.h>
#include <avr/sleep.h>

static void sleep_until_something_happens(void);

int main(void)
{
    serial_init();
    spi_init();
    clock_init();
    core_init();
    sei();
    for (;;) {
        core_poll();
        sleep_until_something_happens();
#ifdef TEST_HANG /* a build for the watchdog's test alone */
        while (hal_button_pressed())
            ;
#endif
    }
}

/* A step wakes the processor too, but is nothing that the main loop must see. */
static void sleep_until_something_happens(void)
{
    cli();
    while (!idle_over()) {
        sleep_enable();
        sei(); /* takes effect after the next instruction: nothing slips in before the sleep */
        sleep_cpu();
        sleep_disable();
        cli();
    }
    idle_begin();
    sei();
}
