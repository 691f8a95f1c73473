// SPDX-License-Identifier: GPL-3.0-or-later
/* Holds an answer back until the wall's clock has come as far as virtual time, for measurements at
 * true speed. */
#pragma once

#include <stdint.h>

void pace_enable(void);               /* without it, the other two do nothing */
void pace_from(uint64_t virtual_us);  /* both clocks start */
void pace_until(uint64_t virtual_us); /* returns when the wall's has come this far too */
