// SPDX-License-Identifier: GPL-3.0-or-later
/* What happened on the pins, one line each: `<cycle> <what> <value>`. */
#pragma once

#include <stdint.h>

void trace_open(const char *path); /* without it, nothing is written */
void trace(uint64_t cycle, const char *what, uint32_t value);
void trace_flush(void);
