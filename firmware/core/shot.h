/* The strobe: one pulse per shot id, and never a second. */
#pragma once

#include <stdint.h>

#include "led_set.h"
#include "reason.h"

struct shot {
    uint64_t time_us;
    int32_t centidegrees;
    struct led_set lit;
};

void shot_init(void);
void shot_forget(void); /* ids start anew: a new host has said hello */
void shot_tick(void);   /* every millisecond: ends the pulse */

/* Ids rise. Returns REASON_NONE and how things stood at the pulse, or why there was none. */
enum reason shot_fire(int32_t id, struct shot *shot);
