#include "core.h"

#include "button.h"
#include "events.h"
#include "hal.h"
#include "identity.h"
#include "light.h"
#include "motion.h"
#include "parameters.h"
#include "receive.h"
#include "safety.h"
#include "session.h"
#include "shot.h"
#include "uptime.h"

#include <stdbool.h>

static volatile bool ticked;

void core_init(void)
{
    light_init();
    parameters_init();
    motion_init();
    safety_init();
    events_init();
    button_init();
    identity_init();
    uptime_init();
    shot_init();
    session_init();
    receive_init();
    events_raise(EVENT_BOOT);
}

void core_receive(uint8_t byte)
{
    receive_byte(byte);
}

uint16_t core_step(void)
{
    return motion_step();
}

void core_tick(void)
{
    ticked = true;
    motion_tick();
    light_tick();
    button_tick();
    shot_tick();
    safety_tick();
}

void core_poll(void)
{
    receive_poll();
    light_poll();
    events_poll();
    uptime_us();
    if (ticked) /* the main loop and the tick must both be alive */
        hal_watchdog_feed();
    ticked = false;
}
