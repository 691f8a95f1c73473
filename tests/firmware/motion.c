#include "bench.h"

static void home(void)
{
    bench_boot();
    CHECK_TEXT(ask("home"), "ok");
    settle();
}

static bool near(double angle, double expected)
{
    double difference = angle - expected;
    return difference < 0.02 && difference > -0.02;
}

static void homing_ends_on_the_marks_edge(void)
{
    home();
    const char *reply = ask("stat");
    CHECK(strstr(reply, "state=ready homed=1") != NULL);
    CHECK(field(reply, "angle") == 0);
    CHECK(angle_deg() == 0);
}

static void homing_from_the_mark_backs_off_first(void)
{
    home();
    ask("move 200");
    settle();
    CHECK(angle_deg() > 1.9 && angle_deg() < 2.1);
    ask("home");
    settle();
    CHECK(angle_deg() == 0);
    CHECK(field(ask("stat"), "angle") == 0);
}

static void moves_are_absolute_and_take_the_shorter_way(void)
{
    home();
    static const int targets[] = {9000, 9000, 27000, 35999, 1, 18001, 0};
    for (size_t i = 0; i < sizeof targets / sizeof targets[0]; i++) {
        char command[32];
        uint32_t before = rig_state()->steps;
        snprintf(command, sizeof command, "move %d", targets[i]);
        CHECK_TEXT(ask(command), "ok");
        settle();
        double angle = angle_deg() > 359.995 ? angle_deg() - 360 : angle_deg();
        CHECK(near(angle, targets[i] == 35999 ? -0.01 : targets[i] / 100.0));
        CHECK(rig_state()->steps - before <= STEPS_PER_TURN / 2);
    }
}

static void the_ramp_reaches_top_rate_and_comes_down_again(void)
{
    home();
    ask("move 18000");
    uint32_t fastest = 0, last = 0;
    uint64_t started_us = rig_state()->time_us;
    while (rig_state()->steps != last || rig_state()->time_us == started_us) {
        last = rig_state()->steps;
        advance_ms(10);
        uint32_t pace = rig_state()->steps - last;
        fastest = pace > fastest ? pace : fastest;
        ask("beat");
    }
    CHECK(fastest >= 99 && fastest <= 102); /* 10,000 steps/s for 10 ms, and a beat */
    CHECK(angle_deg() == 180);
    CHECK(rig_state()->time_us - started_us < 1200000);
}

static void a_move_refuses_to_start_where_the_angle_is_unknown_or_the_table_turns(void)
{
    bench_boot();
    CHECK_TEXT(ask("move 0"), "err home");
    CHECK_TEXT(ask("home"), "ok");
    CHECK_TEXT(ask("move 0"), "err busy");
    CHECK_TEXT(ask("clear"), "ok");
}

static void a_hidden_mark_is_a_fault_and_homing_works_again_after_it(void)
{
    bench_boot();
    rig_hide_mark(true);
    ask("home");
    settle();
    CHECK(strstr(ask("stat"), "state=index homed=0") != NULL);
    CHECK_TEXT(ask("home"), "err index");
    rig_hide_mark(false);
    CHECK_TEXT(ask("clear"), "ok");
    ask("home");
    settle();
    CHECK(strstr(ask("stat"), "state=ready homed=1") != NULL);
}

static void a_slip_is_not_seen_by_the_firmware(void)
{
    home();
    ask("move 9000");
    settle();
    rig_slip(-150);
    CHECK(field(ask("stat"), "angle") == 9000);
    CHECK(angle_deg() == 88.5);
}

void test_motion(void)
{
    homing_ends_on_the_marks_edge();
    homing_from_the_mark_backs_off_first();
    moves_are_absolute_and_take_the_shorter_way();
    the_ramp_reaches_top_rate_and_comes_down_again();
    a_move_refuses_to_start_where_the_angle_is_unknown_or_the_table_turns();
    a_hidden_mark_is_a_fault_and_homing_works_again_after_it();
    a_slip_is_not_seen_by_the_firmware();
}
