#include "button.h"

#include "config.h"
#include "events.h"
#include "hal.h"
#include "safety.h"

#include <stdbool.h>
#include <stdint.h>

static struct {
    bool pressed;
    uint8_t differs_ms; /* how long the pin has disagreed with `pressed` */
    uint16_t held_ms;   /* counts up to a long press */
} button;

static bool debounce(void);

void button_init(void)
{
    button.pressed = false;
    button.differs_ms = 0;
    button.held_ms = 0;
}

void button_tick(void)
{
    bool changed = debounce();
    if (changed && !button.pressed && button.held_ms < BUTTON_LONG_MS)
        events_raise(EVENT_BUTTON);
    if (changed)
        button.held_ms = 0;
    else if (button.pressed && button.held_ms < BUTTON_LONG_MS && ++button.held_ms == BUTTON_LONG_MS)
        safety_latch(REASON_STOP);
}

/* True when `pressed` has changed. */
static bool debounce(void)
{
    if (hal_button_pressed() == button.pressed) {
        button.differs_ms = 0;
        return false;
    }
    if (++button.differs_ms < BUTTON_SETTLE_MS)
        return false;
    button.pressed = !button.pressed;
    button.differs_ms = 0;
    return true;
}
