/* What is around the controller, be that the core alone or a whole chip: the table and its motor, the
 * LEDs, and the wire to the host. */
#pragma once

#include "led_strip.h"
#include "rig.h"

struct world {
    struct rig_state state;
    bool forward;
    bool motor_enabled;
    bool jammed;
    bool led_supply;
    struct led_strip strip;
    char output[4096];
    size_t output_length;
};

void world_begin(struct world *world);
void world_step(struct world *world); /* a pulse to the motor's driver */
void world_turn(struct world *world, int64_t udeg);
bool world_on_mark(const struct world *world);
void world_supply_leds(struct world *world, bool on);
void world_clock_leds(struct world *world, uint8_t byte);
const struct rig_state *world_state(struct world *world); /* all but the time */
void world_send(struct world *world, uint8_t byte);
size_t world_take_output(struct world *world, char *text, size_t limit);
