#include "light.h"

#include "hal.h"
#include "safety.h"

#include <string.h>

#define TICK_MS 10
#define LIMIT (LED_ON_LIMIT_MS / TICK_MS)

static struct {
    struct led_set lit;
    uint8_t level;
    struct led_set resting;
    uint16_t warmth[LED_COUNT]; /* ticks: rises while lit, falls while dark */
    uint8_t ms;
    volatile bool stale; /* the LEDs do not show `lit` yet */
} light;

static void age(uint8_t led);
static void send_frame(void);

void light_init(void)
{
    memset(&light, 0, sizeof light);
    hal_led_supply(false);
}

const char *light_set(uint8_t level, const struct led_set *set)
{
    for (uint8_t led = 0; led < LED_COUNT; led++)
        if (led_set_has(set, led) && led_set_has(&light.resting, led))
            return "hot";
    bool interrupts = hal_interrupts_off();
    bool allowed = safety_check() == FAULT_NONE;
    if (allowed) {
        light.level = level;
        light.lit = *set;
        if (level == 0)
            memset(&light.lit, 0, sizeof light.lit);
        hal_led_supply(true);
    }
    hal_interrupts_restore(interrupts);
    if (!allowed)
        return fault_word(safety_fault());
    send_frame();
    return NULL;
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
    memset(&light.lit, 0, sizeof light.lit);
}

bool light_any(void)
{
    return !led_set_empty(&light.lit);
}

void light_report(struct line *line)
{
    line_field(line, "lit");
    led_set_write(&light.lit, line);
}

void light_tick(void)
{
    if (++light.ms < TICK_MS)
        return;
    light.ms = 0;
    for (uint8_t led = 0; led < LED_COUNT; led++)
        age(led);
}

void light_poll(void)
{
    if (!light.stale)
        return;
    light.stale = false;
    send_frame();
}

static void age(uint8_t led)
{
    uint16_t *warmth = &light.warmth[led];
    if (led_set_has(&light.lit, led)) {
        if (++*warmth >= LIMIT) {
            led_set_remove(&light.lit, led);
            led_set_add(&light.resting, led);
            light.stale = true;
        }
    } else if (*warmth > 0) {
        if (--*warmth <= LIMIT / 2)
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
        uint8_t level = led_set_has(&light.lit, led) ? light.level : 0;
        hal_spi_write(0xFF);
        for (uint8_t channel = 0; channel < 3; channel++)
            hal_spi_write(level);
    }
    for (uint8_t i = 0; i < 4 + LED_COUNT / 16 + 1; i++)
        hal_spi_write(0x00);
}
