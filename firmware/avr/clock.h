/* Timer 1 runs free at 0.5 us a count and times the steps; timer 0 ticks every millisecond. */
#pragma once

void clock_init(void);
