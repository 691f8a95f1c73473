/* What the rig says unasked. An event is sent again until the host acknowledges its id; with no
 * host there is nobody to tell, so nothing is sent. */
#pragma once

#include <stdint.h>

enum event {
    EVENT_BOOT,
    EVENT_BUTTON,
    EVENT_FAULT,
    EVENT_COUNT,
};

void events_init(void);
void events_raise(enum event event); /* from any context; one not acknowledged yet is replaced */
void events_acknowledge(uint8_t id);
void events_poll(void);
