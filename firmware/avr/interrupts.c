/* hal.h's critical sections. */
#include "hal.h"

#include <avr/interrupt.h>

bool hal_interrupts_off(void)
{
    bool were_on = SREG & _BV(SREG_I);
    cli();
    return were_on;
}

void hal_interrupts_restore(bool were_on)
{
    __asm__ volatile("" ::: "memory"); /* what was written inside stays inside */
    if (were_on)
        sei();
}
