#include "motion.h"

#include "config.h"
#include "hal.h"
#include "parameters.h"
#include "safety.h"

enum phase {
    REST,
    MOVE,
    RETURN,   /* homing a homed table: to just before the mark */
    LEAVE,    /* homing began on the mark: backward off it */
    SEEK,     /* forward to the mark, at speed */
    BACK_OFF, /* to before the mark again */
    APPROACH, /* slowly forward to the mark's edge */
};

static struct {
    uint16_t turn;   /* steps */
    uint16_t margin; /* steps: how far before the mark the slow approach begins */
    uint16_t start_rate, top_rate, home_rate, index_rate; /* steps/s */
    uint16_t rate_change;                                 /* a millisecond */
    bool reversed;
} scale;

static struct {
    volatile enum phase phase;
    volatile uint16_t position;  /* steps from the mark's edge */
    volatile uint16_t remaining; /* steps */
    volatile uint16_t interval_us;
    uint16_t rate, rate_limit; /* steps/s */
    bool forward;
    bool watching; /* for the mark's edge */
    bool edge_level;          /* what hal_index() says beyond it */
    uint16_t after_edge;      /* steps to go when it is seen */
    volatile bool edge_seen;
    volatile bool homed;
    bool was_homed, sought; /* before this homing, and in it */
    volatile bool missed_index;
    int16_t steps_lost;
} motion;

static enum reason why_not(void);
static void run(enum phase phase, bool forward, uint16_t steps, uint16_t rate_limit);
static void watch_for_edge(bool level, uint16_t after_edge);
static void seek(void);
static void leave(void);
static void approach(void);
static void next_phase(void);
static void arrive(void);
static void miss(void);
static void rest(void);
static void ramp(void);
static void look_for_edge(void);
static bool shorter_way(uint16_t target, uint16_t *steps);
static uint32_t braking_steps(uint16_t rate);
static uint16_t atomic_read(const volatile uint16_t *value);

void motion_init(void)
{
    motion.phase = REST;
    motion.position = motion.remaining = 0;
    motion.homed = motion.missed_index = false;
    motion.steps_lost = 0;
    hal_motor_enable(false);
    motion_configure();
}

/* Other gears make another angle of the same steps. */
void motion_configure(void)
{
    bool reversed = parameter(REVERSED) == 1;
    if (steps_per_turn() != scale.turn || reversed != scale.reversed) {
        motion.homed = false;
        motion.position = 0;
    }
    scale.reversed = reversed;
    scale.turn = steps_per_turn();
    scale.margin = scale.turn / 128;
    scale.start_rate = steps_per_second(parameter(START_SPEED));
    scale.top_rate = steps_per_second(parameter(TOP_SPEED));
    scale.home_rate = steps_per_second(parameter(HOME_SPEED));
    scale.index_rate = steps_per_second(parameter(INDEX_SPEED));
    scale.rate_change = steps_per_second_per_ms();
}

enum reason motion_home(void)
{
    bool interrupts = hal_interrupts_off();
    enum reason reason = why_not();
    if (reason == REASON_NONE) {
        motion.was_homed = motion.homed;
        motion.homed = motion.sought = false;
        if (hal_index()) {
            leave();
        } else if (motion.was_homed) {
            uint16_t steps;
            bool forward = shorter_way(scale.turn - scale.margin, &steps);
            run(RETURN, forward, steps, scale.top_rate);
        } else {
            seek();
        }
    }
    hal_interrupts_restore(interrupts);
    return reason;
}

enum reason motion_move(int32_t centidegrees)
{
    uint32_t scaled = (uint32_t)centidegrees * scale.turn + CENTIDEGREES_PER_TURN / 2;
    uint16_t target = (uint16_t)(scaled / CENTIDEGREES_PER_TURN % scale.turn), steps;
    bool interrupts = hal_interrupts_off();
    enum reason reason = why_not();
    if (reason == REASON_NONE && !motion.homed)
        reason = REASON_HOME;
    bool forward = shorter_way(target, &steps);
    if (reason == REASON_NONE && steps > 0)
        run(MOVE, forward, steps, scale.top_rate);
    hal_interrupts_restore(interrupts);
    return reason;
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

void motion_let_go(void)
{
    motion_halt();
    motion.homed = false;
    hal_motor_enable(false);
}

bool motion_turning(void)
{
    return motion.phase != REST;
}

bool motion_missed_index(void)
{
    bool missed = motion.missed_index;
    motion.missed_index = false;
    return missed;
}

int32_t motion_angle_centidegrees(void)
{
    uint32_t scaled = (uint32_t)atomic_read(&motion.position) * CENTIDEGREES_PER_TURN;
    uint32_t centidegrees = (scaled + scale.turn / 2) / scale.turn;
    return centidegrees == CENTIDEGREES_PER_TURN ? 0 : (int32_t)centidegrees;
}

int16_t motion_steps_lost(void)
{
    bool interrupts = hal_interrupts_off();
    int16_t steps = motion.steps_lost;
    hal_interrupts_restore(interrupts);
    return steps;
}

const FLASH char *motion_word(void)
{
    static const FLASH char words[][8] = {"unhomed", "ready", "moving", "homing"};
    if (motion.phase == REST)
        return words[motion.homed];
    return words[motion.phase == MOVE ? 2 : 3];
}

void motion_tick(void)
{
    if (motion.phase == REST)
        return;
    ramp();
    bool interrupts = hal_interrupts_off();
    if (motion.phase != REST && motion.remaining == 0)
        next_phase();
    hal_interrupts_restore(interrupts);
}

uint16_t motion_step(void)
{
    safety_check();
    if (motion.remaining == 0)
        return 0;
    hal_step_pulse();
    uint16_t last = (uint16_t)(scale.turn - 1);
    if (motion.forward)
        motion.position = (uint16_t)(motion.position == last ? 0 : motion.position + 1);
    else
        motion.position = (uint16_t)(motion.position == 0 ? last : motion.position - 1);
    motion.remaining--;
    if (motion.watching)
        look_for_edge();
    return motion.remaining == 0 ? 0 : motion.interval_us;
}

/* Asked with interrupts off, which stay off until the motion has begun: a stop that comes while the
 * command is being read must not be overtaken by the motion it should prevent. */
static enum reason why_not(void)
{
    enum reason fault = safety_check();
    if (fault != REASON_NONE)
        return fault;
    return motion.phase == REST ? REASON_NONE : REASON_BUSY;
}

static void run(enum phase phase, bool forward, uint16_t steps, uint16_t rate_limit)
{
    motion.phase = phase;
    motion.forward = forward;
    motion.remaining = steps;
    motion.rate_limit = rate_limit;
    motion.rate = rate_limit < scale.start_rate ? rate_limit : scale.start_rate;
    motion.interval_us = (uint16_t)(1000000 / motion.rate);
    motion.watching = motion.edge_seen = false;
    hal_motor_enable(true);
    hal_step_direction(forward != scale.reversed);
    hal_step_timer_start(motion.interval_us);
}

static void watch_for_edge(bool level, uint16_t after_edge)
{
    motion.edge_level = level;
    motion.after_edge = after_edge;
    motion.watching = true;
}

static void seek(void)
{
    motion.sought = true;
    run(SEEK, true, (uint16_t)(scale.turn + scale.turn / 8), scale.home_rate);
    watch_for_edge(true, (uint16_t)(braking_steps(scale.home_rate) + 1));
}

static void leave(void)
{
    run(LEAVE, false, scale.turn, scale.start_rate);
    watch_for_edge(false, scale.margin);
}

static void approach(void)
{
    run(APPROACH, true, (uint16_t)(3 * scale.margin), scale.index_rate);
    watch_for_edge(true, 0);
}

static void next_phase(void)
{
    switch (motion.phase) {
    case SEEK:
        if (motion.edge_seen)
            run(BACK_OFF, false, (uint16_t)(motion.after_edge + scale.margin), scale.home_rate);
        else
            miss();
        break;
    case LEAVE:
        if (motion.edge_seen && !hal_index())
            approach();
        else
            miss();
        break;
    case RETURN:
    case BACK_OFF:
        if (hal_index())
            leave();
        else
            approach();
        break;
    case APPROACH:
        if (motion.edge_seen)
            arrive();
        else if (!motion.sought)
            seek();
        else
            miss();
        break;
    case MOVE:
    case REST:
        rest();
        break;
    }
}

static void arrive(void)
{
    int32_t beyond = motion.position;
    if (beyond > scale.turn / 2)
        beyond -= scale.turn;
    motion.steps_lost = motion.was_homed ? (int16_t)beyond : 0;
    motion.position = 0;
    motion.homed = true;
    rest();
}

static void miss(void)
{
    motion.missed_index = true;
    rest();
}

static void rest(void)
{
    motion.phase = REST;
    motion.remaining = 0;
}

/* Speeds up until the way that is left is what braking takes. */
static void ramp(void)
{
    uint16_t rate = motion.rate, change = scale.rate_change;
    if (braking_steps(rate) >= atomic_read(&motion.remaining)) {
        if (rate > scale.start_rate)
            rate = (uint16_t)(rate - scale.start_rate > change ? rate - change : scale.start_rate);
    } else if (rate < motion.rate_limit) {
        rate = (uint16_t)(motion.rate_limit - rate > change ? rate + change : motion.rate_limit);
    }
    motion.rate = rate;
    uint16_t interval_us = (uint16_t)(1000000 / rate);
    bool interrupts = hal_interrupts_off();
    motion.interval_us = interval_us;
    hal_interrupts_restore(interrupts);
}

static void look_for_edge(void)
{
    if (motion.edge_seen || hal_index() != motion.edge_level)
        return;
    motion.edge_seen = true;
    if (motion.remaining > motion.after_edge)
        motion.remaining = motion.after_edge;
}

static bool shorter_way(uint16_t target, uint16_t *steps)
{
    uint16_t position = atomic_read(&motion.position);
    uint16_t forward = (uint16_t)(target >= position ? target - position
                                                     : scale.turn - (position - target));
    bool shorter_forward = forward <= scale.turn / 2;
    *steps = shorter_forward ? forward : (uint16_t)(scale.turn - forward);
    return shorter_forward;
}

/* Down to the start rate; the tick may be a millisecond late. */
static uint32_t braking_steps(uint16_t rate)
{
    if (rate <= scale.start_rate)
        return 0;
    uint32_t squares = (uint32_t)rate * rate - (uint32_t)scale.start_rate * scale.start_rate;
    return squares / ((uint32_t)2000 * scale.rate_change) + rate / 1000;
}

static uint16_t atomic_read(const volatile uint16_t *value)
{
    bool interrupts = hal_interrupts_off();
    uint16_t read = *value;
    hal_interrupts_restore(interrupts);
    return read;
}
