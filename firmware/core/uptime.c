#include "uptime.h"

#include "hal.h"

static uint64_t uptime;

void uptime_init(void)
{
    uptime = hal_time_us();
}

uint64_t uptime_us(void)
{
    uptime += (uint32_t)(hal_time_us() - (uint32_t)uptime);
    return uptime;
}
