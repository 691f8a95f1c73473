/* Whether an interrupt has left the main loop something to do: one bit in a register that a single
 * instruction sets. */
#pragma once

#include <avr/io.h>
#include <stdbool.h>

static inline void idle_end(void)
{
    GPIOR0 |= _BV(0);
}

static inline bool idle_over(void)
{
    return GPIOR0 & _BV(0);
}

static inline void idle_begin(void)
{
    GPIOR0 &= (uint8_t)~_BV(0);
}
