#include "shot.h"

#include "hal.h"
#include "safety.h"

#include <stddef.h>

#define PULSE_TICKS 2 /* the first is cut short: 1 to 2 ms */

static struct {
    int32_t last_id;
    volatile uint8_t ticks_left;
} shot;

void shot_init(void)
{
    shot.ticks_left = 0;
    hal_strobe(false);
    shot_forget();
}

void shot_forget(void)
{
    shot.last_id = -1;
}

void shot_tick(void)
{
    if (shot.ticks_left > 0 && --shot.ticks_left == 0)
        hal_strobe(false);
}

const char *shot_fire(int32_t id)
{
    if (safety_fault() != FAULT_NONE)
        return fault_word(safety_fault());
    if (id <= shot.last_id)
        return "spent";
    shot.last_id = id;
    shot.ticks_left = PULSE_TICKS;
    hal_strobe(true);
    return NULL;
}
