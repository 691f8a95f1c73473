#include "safety.h"

#include "config.h"
#include "events.h"
#include "hal.h"
#include "light.h"
#include "motion.h"

#include <stddef.h>

static struct {
    volatile enum fault fault;
    volatile uint16_t lease_ms;
} safety;

void safety_init(void)
{
    safety.fault = FAULT_NONE;
    safety.lease_ms = 0;
}

/* The first fault is the one to report, but an emergency stop outranks it. */
void safety_latch(enum fault fault)
{
    bool interrupts = hal_interrupts_off();
    if (fault == FAULT_LEASE)
        motion_brake();
    else
        motion_halt();
    if (fault == FAULT_ESTOP)
        motion_forget(); /* the switch cuts the motor's driver too */
    light_cut();
    bool outranks = safety.fault == FAULT_NONE || fault == FAULT_ESTOP;
    if (outranks && safety.fault != fault) {
        safety.fault = fault;
        events_raise(EVENT_FAULT);
    }
    hal_interrupts_restore(interrupts);
}

enum fault safety_fault(void)
{
    return safety.fault;
}

enum fault safety_check(void)
{
    if (hal_estop_pressed())
        safety_latch(FAULT_ESTOP);
    return safety.fault;
}

const char *safety_clear(void)
{
    if (motion_turning() && safety.fault != FAULT_NONE)
        return "busy";
    safety.fault = FAULT_NONE;
    return safety_check() == FAULT_NONE ? NULL : fault_word(safety.fault);
}

const char *fault_word(enum fault fault)
{
    switch (fault) {
    case FAULT_STOP:
        return "stop";
    case FAULT_ESTOP:
        return "estop";
    case FAULT_LEASE:
        return "lease";
    case FAULT_INDEX:
        return "index";
    case FAULT_NONE:
        break;
    }
    return "none";
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
        safety_latch(FAULT_INDEX);
    if (safety.lease_ms > 0 && --safety.lease_ms == 0 && (motion_turning() || light_any()))
        safety_latch(FAULT_LEASE);
}
