#include "shot.h"

#include "hal.h"
#include "light.h"
#include "motion.h"
#include "safety.h"
#include "uptime.h"

#define PULSE_TICKS 2 /* the first is cut short: 1 to 2 ms */

static struct {
    int32_t last_id;
    volatile uint8_t ticks_left;
} strobe;

void shot_init(void)
{
    strobe.ticks_left = 0;
    hal_strobe(false);
    shot_forget();
}

void shot_forget(void)
{
    strobe.last_id = -1;
}

void shot_tick(void)
{
    if (strobe.ticks_left > 0 && --strobe.ticks_left == 0)
        hal_strobe(false);
}

enum reason shot_fire(int32_t id, struct shot *shot)
{
    if (id <= strobe.last_id)
        return REASON_SPENT;
    bool interrupts = hal_interrupts_off();
    enum reason fault = safety_check();
    if (fault == REASON_NONE) {
        hal_strobe(true);
        strobe.ticks_left = PULSE_TICKS;
        strobe.last_id = id;
        shot->time_us = uptime_us();
        shot->centidegrees = motion_angle_centidegrees();
        shot->lit = light_lit();
    }
    hal_interrupts_restore(interrupts);
    return fault;
}
