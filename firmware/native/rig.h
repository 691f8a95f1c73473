/* The rig around the firmware, in virtual time: hal.h on one side, the physical state on the other.
 *
 * Time moves only in rig_host_byte() and rig_advance_us(), so a run depends on nothing but the
 * bytes and the calls it was given. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config.h"

#define RIG_STEPS_PER_TURN 16000 /* 200 full steps, 16 microsteps, a 20:100 belt */

struct rig_state {
    uint64_t time_us;
    uint32_t angle_udeg; /* where the table really is: 0 to 359,999,999 */
    uint8_t levels[LED_COUNT];
    uint32_t strobes;
    uint32_t steps;
    bool estop;
    bool button;
    bool mark_hidden;
};

void rig_power_up(uint32_t entropy);
void rig_watchdog_reset(uint32_t entropy); /* the controller restarts; the table stays where it is */

void rig_host_byte(uint8_t byte); /* and the time that the byte takes on the wire */
void rig_advance_us(uint64_t us);
size_t rig_take_output(char *text, size_t limit); /* what the firmware has sent since last asked */

void rig_slip(int32_t centidegrees); /* turns the table without the firmware's knowledge */
void rig_jam(bool jammed); /* the table does not follow the motor */
void rig_press_estop(bool pressed);
void rig_press_button(bool pressed);
void rig_hide_mark(bool hidden);
void rig_spoil_eeprom(uint8_t address); /* flips every bit of one byte */
const struct rig_state *rig_state(void);
