/* Microseconds since boot, without the wrap of the 32-bit timer. Main loop only. */
#pragma once

#include <stdint.h>

void uptime_init(void);
uint64_t uptime_us(void); /* must be asked once in 71 minutes; core_poll() sees to it */
