#include "core.h"

#include "button.h"
#include "events.h"
#include "hal.h"
#include "identity.h"
#include "light.h"
#include "motion.h"
#include "receive.h"
#include "safety.h"
#include "session.h"
#include "shot.h"
#include "uptime.h"

void core_init(void)
{
    light_init();
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
    hal_watchdog_feed();
}
