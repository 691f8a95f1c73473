/* The reference board, in numbers. A port may override any of them with -D. */
#pragma once

#define PROTOCOL_VERSION 1
#define FIRMWARE_VERSION "0.1.0"

#ifndef BUILD
#define BUILD "unknown"
#endif

#ifndef LED_COUNT
#define LED_COUNT 36
#endif

/* 200 full steps, 16 microsteps, a 1:5 belt: 0.0225 degrees a step. */
#ifndef STEPS_PER_TURN
#define STEPS_PER_TURN 16000
#endif

#define START_RATE 2000    /* steps/s the motor starts, stops and homes at without a ramp */
#define TOP_RATE 8000      /* steps/s; a sample that lies loose must not slide */
#define ACCELERATION 20000 /* steps/s^2 */

#define LEASE_MS 1000          /* a silent host's lights and motion last this long */
#define LED_ON_LIMIT_MS 20000  /* each LED's own limit, after which it rests for half as long */
#define EVENT_REPEAT_MS 500
#define BUTTON_SETTLE_MS 20

#define CENTIDEGREES_PER_TURN 36000
