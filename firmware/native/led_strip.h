/* A strip of SK9822 LEDs, as it decodes what is clocked into it. */
#pragma once

#include <stdint.h>

#include "config.h"

struct led_strip {
    uint8_t levels[LED_COUNT]; /* what each LED shows */
    uint8_t zeros;             /* in a row: four begin a frame */
    uint8_t led;               /* the next to be set, plus 1; 0: no frame has begun */
    uint8_t byte;              /* of that LED's four */
};

void led_strip_clock(struct led_strip *strip, uint8_t byte);
