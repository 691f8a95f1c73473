/* The LEDs: SK9822 or APA102 on SPI, behind a supply that the firmware switches.
 *
 * Every LED has a maximum on-time of its own: one that has been lit for LED_LIMIT_MS goes dark, and
 * must rest for half as long before it may be lit again. All together may take SUPPLY_MA. */
#pragma once

#include <stdint.h>

#include "led_set.h"
#include "reason.h"

void light_init(void);

/* These LEDs at this level (0 to 255), all others off. REASON_NONE, or why nothing has changed. */
enum reason light_set(uint8_t level, const struct led_set *set);
/* This LED at this level, the others as they are. */
enum reason light_one(uint8_t led, uint8_t level);
void light_off(void);
void light_cut(void); /* from any context: the supply goes off, nothing is lit */

struct led_set light_lit(void);
bool light_any(void);
uint32_t light_settle_us(void); /* from the last change's reply to steady light */

void light_tick(void); /* every millisecond */
void light_poll(void); /* main loop: sends a frame when the tick asks for one */
