#include "safety.h"

#include "config.h"
#include "events.h"
#include "hal.h"
#include "light.h"
#include "motion.h"

static struct {
    volatile enum reason fault;
    volatile uint16_t lease_ms;
} safety;

void safety_init(void)
{
    safety.fault = REASON_NONE;
    safety.lease_ms = 0;
}

/* The host clears a lease or an index fault by itself, but never what a person has stopped. */
static uint8_t rank(enum reason fault)
{
    switch (fault) {
    case REASON_NONE:
        return 0;
    case REASON_STOP:
        return 2;
    case REASON_ESTOP:
        return 3;
    default:
        return 1;
    }
}

/* The first fault of the highest rank is the one to report. */
void safety_latch(enum reason fault)
{
    bool interrupts = hal_interrupts_off();
    if (fault == REASON_LEASE)
        motion_brake();
    else if (fault == REASON_ESTOP)
        motion_let_go(); /* the switch cuts the motor's supply, whose return must turn nothing */
    else
        motion_halt();
    light_cut();
    if (rank(fault) > rank(safety.fault)) {
        safety.fault = fault;
        events_raise(EVENT_FAULT);
    }
    hal_interrupts_restore(interrupts);
}

enum reason safety_fault(void)
{
    return safety.fault;
}

enum reason safety_check(void)
{
    if (hal_estop_pressed())
        safety_latch(REASON_ESTOP);
    return safety.fault;
}

/* With interrupts off a stop byte that comes meanwhile is not cleared unseen. */
enum reason safety_clear(void)
{
    bool interrupts = hal_interrupts_off();
    enum reason reason = REASON_BUSY;
    if (!motion_turning() || safety.fault == REASON_NONE) {
        safety.fault = REASON_NONE;
        reason = safety_check();
    }
    hal_interrupts_restore(interrupts);
    return reason;
}

void safety_renew_lease(void)
{
    bool interrupts = hal_interrupts_off();
    safety.lease_ms = LEASE_MS;
    hal_interrupts_restore(interrupts);
}

bool safety_host_alive(void)
{
    bool interrupts = hal_interrupts_off();
    bool alive = safety.lease_ms > 0;
    hal_interrupts_restore(interrupts);
    return alive;
}

void safety_tick(void)
{
    safety_check();
    if (motion_missed_index())
        safety_latch(REASON_INDEX);
    if (safety.lease_ms > 0 && --safety.lease_ms == 0 && (motion_turning() || light_any()))
        safety_latch(REASON_LEASE);
}
