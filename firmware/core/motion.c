#include "motion.h"

#include "config.h"
#include "hal.h"
#include "safety.h"

#include <stddef.h>

#define HOMING_LIMIT (STEPS_PER_TURN + STEPS_PER_TURN / 8)

enum phase {
    REST,
    MOVE,
    LEAVE_INDEX, /* homing began on the mark: back off it */
    SEEK_INDEX,  /* forward to the mark's edge, which is angle 0 */
};

static struct {
    volatile enum phase phase;
    volatile uint16_t position;  /* steps from the mark's edge */
    volatile uint16_t remaining; /* steps */
    volatile uint16_t interval_us;
    uint16_t rate; /* steps/s */
    bool forward;
    volatile bool homed;
    volatile bool missed_index;
} motion;

static const char *start(enum phase phase, bool forward, uint16_t steps);
static void turn(bool forward);
static void rest(void);
static void look_for_index(void);
static uint16_t atomic_read(const volatile uint16_t *value);
static uint32_t braking_steps(uint16_t rate);

void motion_init(void)
{
    motion.phase = REST;
    motion.position = motion.remaining = 0;
    motion.homed = motion.missed_index = false;
    hal_motor_enable(false);
}

const char *motion_home(void)
{
    bool on_index = hal_index();
    return start(on_index ? LEAVE_INDEX : SEEK_INDEX, !on_index, HOMING_LIMIT);
}

const char *motion_move(int32_t centidegrees)
{
    if (safety_fault() == FAULT_NONE && !motion_turning() && !motion.homed)
        return "home";
    int32_t scaled = centidegrees * (STEPS_PER_TURN / 20) + CENTIDEGREES_PER_TURN / 40;
    int32_t target = scaled / (CENTIDEGREES_PER_TURN / 20) % STEPS_PER_TURN;
    int32_t forward = (target - motion.position + STEPS_PER_TURN) % STEPS_PER_TURN;
    bool shorter_forward = forward <= STEPS_PER_TURN / 2;
    int32_t steps = shorter_forward ? forward : STEPS_PER_TURN - forward;
    return start(MOVE, shorter_forward, (uint16_t)steps);
}

void motion_brake(void)
{
    if (motion.phase != MOVE) {
        motion_halt();
        return;
    }
    bool interrupts = hal_interrupts_off();
    uint32_t needed = braking_steps(motion.rate) + 1;
    if (motion.remaining > needed)
        motion.remaining = (uint16_t)needed;
    hal_interrupts_restore(interrupts);
}

void motion_halt(void)
{
    bool interrupts = hal_interrupts_off();
    if (motion.phase != REST) {
        motion.homed = false;
        hal_step_timer_stop();
        rest();
    }
    hal_interrupts_restore(interrupts);
}

void motion_forget(void)
{
    motion.homed = false;
}

bool motion_turning(void)
{
    return motion.phase != REST;
}

bool motion_homed(void)
{
    return motion.homed;
}

bool motion_missed_index(void)
{
    bool missed = motion.missed_index;
    motion.missed_index = false;
    return missed;
}

int32_t motion_angle_centidegrees(void)
{
    int32_t scaled = (int32_t)atomic_read(&motion.position) * (CENTIDEGREES_PER_TURN / 20);
    return (scaled + STEPS_PER_TURN / 40) / (STEPS_PER_TURN / 20) % CENTIDEGREES_PER_TURN;
}

const char *motion_word(void)
{
    switch (motion.phase) {
    case MOVE:
        return "moving";
    case LEAVE_INDEX:
    case SEEK_INDEX:
        return "homing";
    case REST:
        break;
    }
    return "ready";
}

/* Speeds up until the way that is left is what braking takes. Homing stays at the start rate. */
void motion_tick(void)
{
    if (motion.phase != MOVE)
        return;
    uint16_t change = ACCELERATION / 1000;
    if (braking_steps(motion.rate) >= atomic_read(&motion.remaining)) {
        if (motion.rate >= START_RATE + change)
            motion.rate = (uint16_t)(motion.rate - change);
    } else if (motion.rate <= TOP_RATE - change) {
        motion.rate = (uint16_t)(motion.rate + change);
    }
    uint16_t interval_us = (uint16_t)(1000000 / motion.rate);
    bool interrupts = hal_interrupts_off();
    motion.interval_us = interval_us;
    hal_interrupts_restore(interrupts);
}

uint16_t motion_step(void)
{
    if (motion.phase == REST)
        return 0;
    hal_step_pulse();
    uint16_t last = STEPS_PER_TURN - 1;
    if (motion.forward)
        motion.position = (uint16_t)(motion.position == last ? 0 : motion.position + 1);
    else
        motion.position = (uint16_t)(motion.position == 0 ? last : motion.position - 1);
    motion.remaining--;
    if (motion.phase != MOVE)
        look_for_index();
    if (motion.remaining == 0)
        rest();
    return motion.phase == REST ? 0 : motion.interval_us;
}

/* The latch and the pin are asked with interrupts off: a stop that comes while the command is
 * being read must not be overtaken by the motion it should prevent. */
static const char *start(enum phase phase, bool forward, uint16_t steps)
{
    if (motion.phase != REST && safety_fault() == FAULT_NONE)
        return "busy";
    const char *error = NULL;
    bool interrupts = hal_interrupts_off();
    if (safety_check() != FAULT_NONE) {
        error = fault_word(safety_fault());
    } else if (steps > 0) {
        hal_motor_enable(true);
        motion.phase = phase;
        motion.remaining = steps;
        motion.rate = START_RATE;
        motion.interval_us = 1000000 / START_RATE;
        if (phase != MOVE)
            motion.homed = false;
        turn(forward);
        hal_step_timer_start(motion.interval_us);
    }
    hal_interrupts_restore(interrupts);
    return error;
}

static void turn(bool forward)
{
    motion.forward = forward;
    hal_step_direction(forward);
}

static void rest(void)
{
    motion.phase = REST;
    motion.remaining = 0;
}

static void look_for_index(void)
{
    bool on_index = hal_index();
    if (motion.phase == LEAVE_INDEX && !on_index) {
        motion.phase = SEEK_INDEX;
        motion.remaining = HOMING_LIMIT;
        turn(true);
    } else if (motion.phase == SEEK_INDEX && on_index) {
        motion.position = 0;
        motion.homed = true;
        rest();
    } else if (motion.remaining == 0) {
        motion.missed_index = true;
    }
}

static uint16_t atomic_read(const volatile uint16_t *value)
{
    bool interrupts = hal_interrupts_off();
    uint16_t read = *value;
    hal_interrupts_restore(interrupts);
    return read;
}

static uint32_t braking_steps(uint16_t rate)
{
    return (uint32_t)rate * rate / (2UL * ACCELERATION);
}
