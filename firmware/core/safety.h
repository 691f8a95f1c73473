/* What stops the rig, and keeps it stopped until the host clears it.
 *
 * Lights and motion need a live host: each accepted sealed line renews a lease, and what is lit or
 * turning when it ends is stopped. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum fault {
    FAULT_NONE,
    FAULT_STOP,  /* the stop byte or verb */
    FAULT_ESTOP, /* the emergency stop is, or was, pressed */
    FAULT_LEASE, /* the host fell silent while something was lit or turning */
    FAULT_INDEX, /* homing did not find the mark */
};

void safety_init(void);
void safety_latch(enum fault fault); /* from any context */
enum fault safety_fault(void);
enum fault safety_check(void);  /* the same, after a look at the pin */
const char *safety_clear(void); /* NULL, or the word for why the fault stays */
const char *fault_word(enum fault fault);

void safety_renew_lease(void);
bool safety_host_alive(void);
void safety_tick(void); /* every millisecond */
