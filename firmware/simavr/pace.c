// SPDX-License-Identifier: GPL-3.0-or-later
#define _POSIX_C_SOURCE 200809L /* clock_nanosleep */
#include "pace.h"

#include <stdbool.h>
#include <time.h>

static struct {
    bool enabled;
    uint64_t virtual_us;
    struct timespec wall;
} start;

void pace_enable(void)
{
    start.enabled = true;
}

void pace_from(uint64_t virtual_us)
{
    start.virtual_us = virtual_us;
    clock_gettime(CLOCK_MONOTONIC, &start.wall);
}

void pace_until(uint64_t virtual_us)
{
    if (!start.enabled)
        return;
    struct timespec until = start.wall;
    uint64_t ns = (uint64_t)until.tv_nsec + (virtual_us - start.virtual_us) * 1000;
    until.tv_sec += (time_t)(ns / 1000000000);
    until.tv_nsec = (long)(ns % 1000000000);
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
}
