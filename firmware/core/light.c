#include "light.h"

#include "config.h"
#include "hal.h"
#include "parameters.h"
#include "safety.h"

#include <string.h>

#define AGE_MS 10
#define REFRESH_MS 100 /* a frame that interference has spoilt does not stay */

static struct {
    struct led_set lit;
    uint8_t levels[LED_COUNT]; /* of those that are lit */
    struct led_set resting;
    uint16_t warmth[LED_COUNT]; /* in AGE_MS: rises while lit, falls while dark */
    uint8_t next_aged; /* in this millisecond: this LED, and every tenth from it */
    bool supplied;
    bool supply_rose; /* with the last change */
    volatile uint8_t refresh_in_ms;
    volatile bool stale; /* a frame is due */
} light;

static enum reason change(const struct led_set *lit, const struct led_set *set, uint8_t level);
static uint32_t levels_of(const struct led_set *lit, const struct led_set *set, uint8_t level);
static void age(uint8_t led);
static void send_frame(void);

void light_init(void)
{
    memset(&light, 0, sizeof light);
    hal_led_supply(false);
}

enum reason light_set(uint8_t level, const struct led_set *set)
{
    struct led_set lit = *set;
    if (level == 0)
        memset(&lit, 0, sizeof lit);
    return change(&lit, set, level);
}

enum reason light_one(uint8_t led, uint8_t level)
{
    struct led_set one = {0}, lit = light_lit();
    led_set_add(&one, led);
    if (level > 0)
        led_set_add(&lit, led);
    else
        led_set_remove(&lit, led);
    return change(&lit, &one, level);
}

void light_off(void)
{
    bool interrupts = hal_interrupts_off();
    memset(&light.lit, 0, sizeof light.lit);
    hal_interrupts_restore(interrupts);
    send_frame();
}

void light_cut(void)
{
    hal_led_supply(false);
    light.supplied = false;
    memset(&light.lit, 0, sizeof light.lit);
}

struct led_set light_lit(void)
{
    bool interrupts = hal_interrupts_off();
    struct led_set lit = light.lit;
    hal_interrupts_restore(interrupts);
    return lit;
}

bool light_any(void)
{
    return !led_set_empty(&light.lit);
}

uint32_t light_settle_us(void)
{
    uint32_t rise_us = light.supply_rose ? SUPPLY_RISE_MS * 1000UL : 0;
    return rise_us + (uint32_t)parameter(SETTLE_US);
}

void light_tick(void)
{
    if (light.supplied && --light.refresh_in_ms == 0) {
        light.refresh_in_ms = REFRESH_MS;
        light.stale = true;
    }
    for (uint8_t led = light.next_aged; led < LED_COUNT; led = (uint8_t)(led + AGE_MS))
        age(led);
    light.next_aged = (uint8_t)((light.next_aged + 1) % AGE_MS);
}

void light_poll(void)
{
    if (!light.stale)
        return;
    light.stale = false;
    send_frame();
}

static enum reason change(const struct led_set *lit, const struct led_set *set, uint8_t level)
{
    for (uint8_t led = 0; led < LED_COUNT; led++)
        if (led_set_has(lit, led) && led_set_has(&light.resting, led))
            return REASON_HOT;
    if (levels_of(lit, set, level) * (uint32_t)parameter(LED_MA) > 255 * (uint32_t)parameter(SUPPLY_MA))
        return REASON_SUPPLY;
    for (uint8_t led = 0; led < LED_COUNT; led++)
        if (led_set_has(set, led))
            light.levels[led] = level;
    light.lit = *lit;
    bool supply_rises = !light.supplied;
    bool interrupts = hal_interrupts_off();
    enum reason fault = safety_check();
    if (fault == REASON_NONE) {
        light.supplied = true;
        hal_led_supply(true);
    }
    hal_interrupts_restore(interrupts);
    if (fault != REASON_NONE) {
        memset(&light.lit, 0, sizeof light.lit);
        return fault;
    }
    light.supply_rose = supply_rises;
    if (supply_rises)
        light.refresh_in_ms = SUPPLY_RISE_MS;
    send_frame();
    return REASON_NONE;
}

static uint32_t levels_of(const struct led_set *lit, const struct led_set *set, uint8_t level)
{
    uint32_t levels = 0;
    for (uint8_t led = 0; led < LED_COUNT; led++)
        if (led_set_has(lit, led))
            levels += led_set_has(set, led) ? level : light.levels[led];
    return levels;
}

static void age(uint8_t led)
{
    uint16_t *warmth = &light.warmth[led];
    int32_t limit_ms = parameter(LED_LIMIT_MS);
    if (led_set_has(&light.lit, led)) {
        if (AGE_MS * (int32_t)(++*warmth + 1) > limit_ms) {
            led_set_remove(&light.lit, led);
            led_set_add(&light.resting, led);
            light.stale = true;
        }
    } else if (*warmth > 0) {
        if (2 * AGE_MS * (int32_t)--*warmth <= limit_ms)
            led_set_remove(&light.resting, led);
    }
}

/* The 5-bit current stays at its maximum, because its own PWM is slow enough to band; the three
 * 8-bit channels dim. The zeros at the end clock the last LEDs through. */
static void send_frame(void)
{
    for (uint8_t i = 0; i < 4; i++)
        hal_spi_write(0x00);
    for (uint8_t led = 0; led < LED_COUNT; led++) {
        uint8_t level = led_set_has(&light.lit, led) ? light.levels[led] : 0;
        hal_spi_write(0xFF);
        for (uint8_t channel = 0; channel < 3; channel++)
            hal_spi_write(level);
    }
    for (uint8_t i = 0; i < 4 + LED_COUNT / 16 + 1; i++)
        hal_spi_write(0x00);
}
