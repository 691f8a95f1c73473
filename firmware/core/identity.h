/* Which run of the firmware this is: a new boot id means that angle and lights were lost. */
#pragma once

#include <stdint.h>

void identity_init(void);
uint32_t identity_boot(void);
