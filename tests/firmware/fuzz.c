/* Anything, in any order: what must always hold, holds. */
#include "bench.h"

#define ROUNDS 60000

static uint32_t seed;

static uint32_t draw(uint32_t below)
{
    seed = seed * 1664525 + 1013904223;
    return (uint32_t)(((uint64_t)seed * below) >> 32);
}

static void send_command(void)
{
    static const char *const forms[] = {
        "hello", "home", "off", "stat", "beat", "stop", "clear", "clear", "home",
    };
    char command[64];
    switch (draw(5)) {
    case 0:
        snprintf(command, sizeof command, "move %u", draw(36100));
        break;
    case 1:
        snprintf(command, sizeof command, "led %u %X%05X", draw(257), draw(1 << 17), draw(1 << 20));
        break;
    case 2:
        snprintf(command, sizeof command, "trig %u", draw(1000));
        break;
    default:
        snprintf(command, sizeof command, "%s", forms[draw(sizeof forms / sizeof forms[0])]);
        break;
    }
    ask(command);
}

static void send_noise(void)
{
    for (uint32_t i = draw(40); i > 0; i--)
        rig_host_byte((uint8_t)draw(256));
    bench_say("");
}

static void do_anything(void)
{
    switch (draw(11)) {
    case 0:
        send_noise();
        break;
    case 1:
        rig_press_estop(draw(3) == 0);
        break;
    case 2:
        rig_press_button(draw(2));
        break;
    case 3:
    case 4:
        rig_advance_us(draw(1200000));
        break;
    case 5:
        if (draw(20) == 0)
            rig_watchdog_reset(draw(1000));
        break;
    default:
        send_command();
        break;
    }
}

static void check_a_fault_leaves_everything_off(void)
{
    static const char *const faults[] = {"is=stop", "is=estop", "is=lease", "is=index"};
    const char *reply = bench_say("stat");
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++)
        CHECK(strstr(reply, faults[i]) == NULL || lit_count() == 0);
}

static void check_an_emergency_stop_freezes_the_rig(void)
{
    if (!rig_state()->estop)
        return;
    advance_ms(1);
    uint32_t steps = rig_state()->steps;
    advance_ms(30);
    CHECK(rig_state()->steps == steps && lit_count() == 0);
}

static void check_a_known_angle_is_true(void)
{
    const char *reply = bench_say("stat");
    if (strstr(reply, "is=ready") == NULL)
        return; /* a turning table goes on while the reply is sent */
    double apart = angle_deg() - (double)field(reply, "at") / 100;
    apart = apart > 180 ? apart - 360 : apart < -180 ? apart + 360 : apart;
    CHECK(apart < 0.02 && apart > -0.02);
}

void test_fuzz(void)
{
    seed = 2019;
    bench_boot();
    for (int round = 0; round < ROUNDS; round++) {
        do_anything();
        check_a_fault_leaves_everything_off();
        check_an_emergency_stop_freezes_the_rig();
        check_a_known_angle_is_true();
    }
    CHECK(rig_state()->strobes > 50 && rig_state()->steps > 100000);
}
