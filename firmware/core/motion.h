/* The turntable: a trapezoidal ramp to an absolute angle, and homing to the index mark. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

void motion_init(void);

/* Both start a motion and return at once: NULL, or the word for why it did not start. */
const char *motion_home(void);
const char *motion_move(int32_t centidegrees); /* 0 to 35999, the shorter way round */

void motion_brake(void); /* down the ramp; the angle stays known */
void motion_halt(void);  /* at once; a table that was turning must be homed again */
void motion_forget(void); /* the motor may have lost its hold: home again */

bool motion_turning(void);
bool motion_homed(void);
bool motion_missed_index(void); /* true once after a homing that found no mark */
int32_t motion_angle_centidegrees(void); /* from steps; 0 to 35999 */
const char *motion_word(void);

void motion_tick(void);     /* every millisecond: the ramp */
uint16_t motion_step(void); /* at every step: see hal_step_timer_start() */
