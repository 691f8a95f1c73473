/* hal.h's critical sections, inlined everywhere: what they guard is shorter than a call. */
#include "hal.h"

#include <avr/interrupt.h>

inline __attribute__((always_inline)) bool hal_interrupts_off(void)
{
    bool were_on = SREG & _BV(SREG_I);
    cli();
    return were_on;
}

inline __attribute__((always_inline)) void hal_interrupts_restore(bool were_on)
{
    __asm__ volatile("" ::: "memory"); /* what was written inside stays inside */
    if (were_on)
        sei();
}
