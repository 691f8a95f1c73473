#include "bench.h"

static void begin_a_lit_move(void)
{
    bench_boot();
    ask("home");
    settle();
    ask("led 255 FFF");
    ask("move 18000");
    advance_ms(300);
    CHECK(lit_count() == 12 && angle_deg() > 10);
}

static uint32_t steps_in_ms(uint64_t ms)
{
    uint32_t before = rig_state()->steps;
    advance_ms(ms);
    return rig_state()->steps - before;
}

static void the_stop_byte_stops_and_latches_even_inside_a_line(void)
{
    begin_a_lit_move();
    rig_host_byte('9');
    rig_host_byte(0x18);
    CHECK(lit_count() == 0);
    CHECK(steps_in_ms(100) == 0);
    CHECK_TEXT(bench_say("") + 2, "err check *0BABBC");
    CHECK_TEXT(state(), "stop");
    CHECK_TEXT(ask("home"), "err stop");
    CHECK_TEXT(ask("led 255 1"), "err stop");
    CHECK_TEXT(ask("clear"), "ok");
    CHECK_TEXT(ask("move 0"), "err home");
    CHECK_TEXT(ask("home"), "ok");
}

static void a_table_stopped_at_rest_keeps_its_angle(void)
{
    bench_boot();
    ask("home");
    settle();
    ask("stop");
    ask("clear");
    CHECK_TEXT(state(), "ready");
}

static void a_silent_host_loses_lights_and_motion_after_a_second(void)
{
    begin_a_lit_move();
    ask("beat");
    rig_slip(9000); /* has no say in it */
    advance_ms(990);
    CHECK(lit_count() == 12);
    advance_ms(20);
    CHECK(lit_count() == 0);
    CHECK_TEXT(state(), "lease");
    CHECK_TEXT(ask("led 255 1"), "err lease");
    CHECK_TEXT(ask("clear"), "ok");
    CHECK_TEXT(lit_after("led 255 1"), "000000001");
}

static void a_lease_that_ends_in_a_move_brakes_down_the_ramp(void)
{
    bench_boot();
    ask("home");
    settle();
    ask("move 18000");
    advance_ms(1000);
    CHECK_TEXT(state(), "lease");
    CHECK_TEXT(ask("clear"), "err busy");
    CHECK(steps_in_ms(300) > 100 && steps_in_ms(10) == 0);
    CHECK_TEXT(ask("clear"), "ok");
    const char *reply = ask("stat");
    CHECK(strstr(reply, "is=ready") != NULL);
    double apart = (double)field(reply, "at") / 100 - angle_deg();
    CHECK(apart < 0.02 && apart > -0.02);
}

static void a_lease_that_ends_in_homing_halts_it(void)
{
    bench_boot();
    ask("home");
    advance_ms(1010);
    CHECK_TEXT(state(), "lease");
    CHECK(steps_in_ms(100) == 0);
}

static void only_whole_sealed_lines_renew_the_lease(void)
{
    bench_boot();
    ask("led 255 1");
    for (int i = 0; i < 6; i++) {
        advance_ms(200);
        bench_say("stat");
        bench_say("5 beat *06FFFF");
    }
    CHECK(lit_count() == 0);
    CHECK_TEXT(state(), "lease");
}

static void an_idle_rig_needs_no_host(void)
{
    bench_boot();
    ask("beat");
    advance_ms(5000);
    CHECK_TEXT(state(), "unhomed");
}

static void an_emergency_stop_holds_until_released_and_cleared(void)
{
    begin_a_lit_move();
    rig_press_estop(true);
    CHECK(steps_in_ms(2) < 20 && steps_in_ms(100) == 0);
    CHECK(lit_count() == 0);
    CHECK_TEXT(state(), "estop");
    CHECK_TEXT(ask("clear"), "err estop");
    rig_press_estop(false);
    CHECK_TEXT(ask("home"), "err estop");
    CHECK_TEXT(ask("clear"), "ok");
    CHECK_TEXT(ask("home"), "ok");
}

/* The pin may change between two looks of the tick: a start looks for itself. */
static void nothing_starts_while_the_emergency_stop_is_pressed(void)
{
    bench_boot();
    rig_press_estop(true);
    CHECK_TEXT(ask("home"), "err estop");
    CHECK_TEXT(ask("led 255 1"), "err estop");
    CHECK(rig_state()->steps == 0 && lit_count() == 0);
}

static void an_emergency_stop_outranks_a_stop(void)
{
    bench_boot();
    ask("stop");
    rig_press_estop(true);
    advance_ms(2);
    CHECK_TEXT(state(), "estop");
    rig_press_estop(false);
    ask("stop");
    CHECK_TEXT(state(), "estop");
}

static void a_watchdog_reset_leaves_everything_off(void)
{
    begin_a_lit_move();
    rig_watchdog_reset(0x12345678);
    CHECK(lit_count() == 0 && steps_in_ms(100) == 0);
    CHECK(strstr(ask("hello"), "boot=12345678 reset=watchdog") != NULL);
    CHECK_TEXT(state(), "unhomed");
}

void test_safety(void)
{
    the_stop_byte_stops_and_latches_even_inside_a_line();
    a_table_stopped_at_rest_keeps_its_angle();
    a_silent_host_loses_lights_and_motion_after_a_second();
    a_lease_that_ends_in_a_move_brakes_down_the_ramp();
    a_lease_that_ends_in_homing_halts_it();
    only_whole_sealed_lines_renew_the_lease();
    an_idle_rig_needs_no_host();
    an_emergency_stop_holds_until_released_and_cleared();
    nothing_starts_while_the_emergency_stop_is_pressed();
    an_emergency_stop_outranks_a_stop();
    a_watchdog_reset_leaves_everything_off();
}
