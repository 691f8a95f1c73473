/* A set of LEDs. On the wire it is a hex number: bit n is LED n. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "config.h"
#include "line.h"

struct led_set {
    uint8_t bits[(LED_COUNT + 7) / 8];
};

bool led_set_has(const struct led_set *set, uint8_t led);
void led_set_add(struct led_set *set, uint8_t led);
void led_set_remove(struct led_set *set, uint8_t led);
bool led_set_empty(const struct led_set *set);

/* False if the word is not hex, or names a LED that the board lacks. */
bool led_set_read(struct led_set *set, const char *word);
void led_set_write(const struct led_set *set, struct line *line);
