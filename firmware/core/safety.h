/* What stops the rig, and keeps it stopped until the host clears it.
 *
 * Lights and motion need a live host: each accepted sealed line renews a lease, and what is lit or
 * turning when it ends is stopped. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "reason.h"

void safety_init(void);
void safety_latch(enum reason fault); /* from any context */
enum reason safety_fault(void);
enum reason safety_check(void); /* the same, after a look at the pin */
enum reason safety_clear(void); /* REASON_NONE, or why the fault stays */

void safety_renew_lease(void);
bool safety_host_alive(void);
void safety_tick(void); /* every millisecond */
