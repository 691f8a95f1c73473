#include "world.h"

#include <string.h>

#define TURN_UDEG 360000000
#define STEP_UDEG (TURN_UDEG / RIG_STEPS_PER_TURN)
#define MARK_UDEG 4000000 /* the mark is in the sensor from 0 to here */
#define START_UDEG 216000000

void world_begin(struct world *world)
{
    memset(world, 0, sizeof *world);
    world->state.angle_udeg = START_UDEG;
}

/* The emergency stop cuts the motor's driver in hardware. */
void world_step(struct world *world)
{
    world->state.steps++;
    if (world->motor_enabled && !world->state.estop && !world->jammed)
        world_turn(world, world->forward ? STEP_UDEG : -STEP_UDEG);
}

void world_turn(struct world *world, int64_t udeg)
{
    int64_t angle = ((int64_t)world->state.angle_udeg + udeg) % TURN_UDEG;
    world->state.angle_udeg = (uint32_t)(angle < 0 ? angle + TURN_UDEG : angle);
}

bool world_on_mark(const struct world *world)
{
    return !world->state.mark_hidden && world->state.angle_udeg < MARK_UDEG;
}

void world_supply_leds(struct world *world, bool on)
{
    if (!on)
        memset(&world->strip, 0, sizeof world->strip);
    world->led_supply = on;
}

void world_clock_leds(struct world *world, uint8_t byte)
{
    if (world->led_supply)
        led_strip_clock(&world->strip, byte);
}

const struct rig_state *world_state(struct world *world)
{
    for (uint8_t led = 0; led < LED_COUNT; led++)
        world->state.levels[led] = world->led_supply ? world->strip.levels[led] : 0;
    return &world->state;
}

void world_send(struct world *world, uint8_t byte)
{
    if (world->output_length < sizeof world->output)
        world->output[world->output_length++] = (char)byte;
}

size_t world_take_output(struct world *world, char *text, size_t limit)
{
    size_t length = world->output_length < limit ? world->output_length : limit;
    memcpy(text, world->output, length);
    world->output_length -= length;
    memmove(world->output, world->output + length, world->output_length);
    return length;
}
