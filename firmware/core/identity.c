#include "identity.h"

#include "hal.h"

static uint32_t boot;

void identity_init(void)
{
    boot = hal_entropy();
}

uint32_t identity_boot(void)
{
    return boot;
}
