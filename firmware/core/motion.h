/* The turntable: a trapezoidal ramp to an absolute angle, and homing to the index mark.
 *
 * Homing: forward at speed until the mark is seen, down the ramp, back before the mark, and slowly
 * forward to its edge, which is angle 0. A table that is homed already goes straight to just before
 * the mark, and where the edge is then found tells how many steps were lost since. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "reason.h"

void motion_init(void);
void motion_configure(void); /* takes the parameters over, at rest */

/* Both start a motion and return at once: REASON_NONE, or why it did not start. */
enum reason motion_home(void);
enum reason motion_move(int32_t centidegrees); /* 0 to 35999, the shorter way round */

void motion_brake(void);  /* down the ramp; the angle stays known unless this was homing */
void motion_halt(void);   /* at once; a table that was turning must be homed again */
void motion_let_go(void); /* at once, and the motor's driver off: home again */

bool motion_turning(void);
bool motion_missed_index(void);          /* true once after a homing that found no mark */
int32_t motion_angle_centidegrees(void); /* from steps; 0 to 35999 */
int16_t motion_steps_lost(void); /* found by homing a homed table; positive: it lagged behind */
const FLASH char *motion_word(void);

void motion_tick(void);     /* every millisecond: the ramp */
uint16_t motion_step(void); /* at every step: see hal_step_timer_start() */
