/* What is the same on every rig. What differs from rig to rig is in parameters.h. */
#pragma once

#define PROTOCOL_VERSION 2
#define FIRMWARE_VERSION "0.2.0"

#ifndef BUILD
#define BUILD "unknown"
#endif

#ifndef LED_COUNT
#define LED_COUNT 36
#endif

#define LEASE_MS 1000 /* a silent host's lights and motion last this long */
#define SUPPLY_RISE_MS 5 /* from the LEDs' supply to LEDs that listen */
#define EVENT_REPEAT_MS 500
#define BUTTON_SETTLE_MS 20
#define BUTTON_LONG_MS 1000 /* held this long it means stop */

#define CENTIDEGREES_PER_TURN 36000
