/* The strobe: one pulse per shot id, and never a second. */
#pragma once

#include <stdint.h>

void shot_init(void);
void shot_forget(void); /* ids start anew: a new host has said hello */
void shot_tick(void);   /* every millisecond: ends the pulse */

/* Ids rise. Returns NULL, or the word for why no pulse was sent. */
const char *shot_fire(int32_t id);
