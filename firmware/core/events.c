#include "events.h"

#include "config.h"
#include "hal.h"
#include "identity.h"
#include "line.h"
#include "safety.h"

#include <stdbool.h>
#include <string.h>

static struct {
    volatile bool raised[EVENT_COUNT];
    uint8_t id[EVENT_COUNT]; /* of the event that waits for its acknowledgement; 0: none does */
    uint8_t last_id;
    enum reason fault; /* that EVENT_FAULT tells of, cleared by now or not */
    uint32_t sent_us;
} events;

static bool adopt_raised(void);
static bool repeat_is_due(void);
static void send(enum event event);

void events_init(void)
{
    memset(&events, 0, sizeof events);
}

void events_raise(enum event event)
{
    events.raised[event] = true;
}

void events_acknowledge(uint8_t id)
{
    for (uint8_t event = 0; event < EVENT_COUNT; event++)
        if (events.id[event] == id)
            events.id[event] = 0;
}

void events_poll(void)
{
    if (!safety_host_alive() || !(adopt_raised() || repeat_is_due()))
        return;
    events.sent_us = hal_time_us();
    for (uint8_t event = 0; event < EVENT_COUNT; event++)
        if (events.id[event] != 0)
            send((enum event)event);
}

static bool adopt_raised(void)
{
    bool any = false;
    for (uint8_t event = 0; event < EVENT_COUNT; event++) {
        if (!events.raised[event])
            continue;
        events.raised[event] = false;
        if (event == EVENT_FAULT)
            events.fault = safety_fault();
        events.last_id = events.last_id == 255 ? 1 : (uint8_t)(events.last_id + 1);
        events.id[event] = events.last_id;
        any = true;
    }
    return any;
}

static bool repeat_is_due(void)
{
    return hal_time_us() - events.sent_us >= EVENT_REPEAT_MS * 1000UL;
}

static void send(enum event event)
{
    struct line line;
    line_clear(&line);
    line_text(&line, "!");
    line_decimal(&line, events.id[event]);
    switch (event) {
    case EVENT_BOOT:
        line_text(&line, " boot");
        line_field(&line, "boot");
        line_hex(&line, identity_boot(), 8);
        break;
    case EVENT_BUTTON:
        line_text(&line, " button");
        break;
    case EVENT_FAULT:
        line_text(&line, " fault");
        line_field(&line, "fault");
        line_word(&line, reason_word(events.fault));
        break;
    case EVENT_COUNT:
        return;
    }
    line_send(&line);
}
