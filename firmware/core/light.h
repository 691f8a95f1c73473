/* The LEDs: SK9822 or APA102 on SPI, behind a supply that the firmware switches.
 *
 * Every LED has a maximum on-time of its own: one that has been lit for LED_ON_LIMIT_MS goes dark,
 * and must rest for half as long before it may be lit again. */
#pragma once

#include <stdint.h>

#include "led_set.h"

void light_init(void);

/* These LEDs at this level (0 to 255), all others off. Returns NULL, or the word for why not. */
const char *light_set(uint8_t level, const struct led_set *set);
void light_off(void);
void light_cut(void); /* from any context: the supply goes off, nothing is lit */

bool light_any(void);
void light_report(struct line *line); /* " lit=<set>" */

void light_tick(void); /* every millisecond */
void light_poll(void); /* main loop: sends a frame when the tick has changed one */
