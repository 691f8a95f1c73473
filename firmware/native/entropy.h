/* A number that differs from boot to boot. */
#pragma once

#include <stdint.h>

uint32_t entropy(void);
