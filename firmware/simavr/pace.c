// SPDX-License-Identifier: GPL-3.0-or-later
#define _POSIX_C_SOURCE 200809L /* clock_nanosleep */
#include "pace.h"

#include <stdbool.h>
#include <time.h>

#define NS_PER_S 1000000000
#define WATCH_NS 200000 /* a sleep ends up to this much late, so the clock is watched at the end */

static struct {
    bool enabled;
    uint64_t virtual_us;
    uint64_t wall_ns;
} start;

static uint64_t wall_ns(void);

void pace_enable(void)
{
    start.enabled = true;
}

void pace_from(uint64_t virtual_us)
{
    start.virtual_us = virtual_us;
    start.wall_ns = wall_ns();
}

void pace_until(uint64_t virtual_us)
{
    if (!start.enabled)
        return;
    uint64_t due_ns = start.wall_ns + (virtual_us - start.virtual_us) * 1000;
    uint64_t watch_ns = due_ns - WATCH_NS;
    struct timespec watch = {(time_t)(watch_ns / NS_PER_S), (long)(watch_ns % NS_PER_S)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &watch, NULL);
    while (wall_ns() < due_ns)
        ;
}

static uint64_t wall_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}
