#include "button.h"

#include "config.h"
#include "events.h"
#include "hal.h"

#include <stdbool.h>
#include <stdint.h>

static struct {
    bool pressed;
    uint8_t differs_ms; /* how long the pin has disagreed with `pressed` */
} button;

void button_init(void)
{
    button.pressed = false;
    button.differs_ms = 0;
}

void button_tick(void)
{
    if (hal_button_pressed() == button.pressed) {
        button.differs_ms = 0;
        return;
    }
    if (++button.differs_ms < BUTTON_SETTLE_MS)
        return;
    button.pressed = !button.pressed;
    button.differs_ms = 0;
    if (button.pressed)
        events_raise(EVENT_BUTTON);
}
