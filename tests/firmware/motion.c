#include "bench.h"

#include "motion.h"

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
    static const int targets[] = {9000, 9000, 1000, 35999, 1, 18001, 0};
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

static uint32_t steps_in_10_ms(void)
{
    uint32_t before = rig_state()->steps;
    advance_ms(10);
    return rig_state()->steps - before;
}

static void the_ramp_reaches_top_rate_and_comes_down_again(void)
{
    home();
    CHECK_TEXT(ask("move 18000"), "ok");
    uint32_t fastest = 0, slower = 0, pace = steps_in_10_ms();
    uint64_t ms = 0;
    CHECK(pace < START_RATE / 100 + 4);
    for (uint32_t next; (next = steps_in_10_ms()) > 0; ms += 10) {
        CHECK(next <= pace + 4);
        fastest = next > fastest ? next : fastest;
        slower = pace;
        pace = next;
        if (ms == 500)
            ask("beat");
    }
    CHECK(fastest >= TOP_RATE / 100 - 1 && fastest <= TOP_RATE / 100 + 1);
    CHECK(slower <= START_RATE / 100 + 3);
    CHECK(angle_deg() == 180);
    CHECK(ms > 1000 && ms < 1400);
}

static void braking_shortens_the_move_and_keeps_the_angle(void)
{
    home();
    ask("move 18000");
    advance_ms(400);
    CHECK(steps_in_10_ms() >= TOP_RATE / 100 - 1);
    uint32_t before = rig_state()->steps;
    motion_brake();
    settle();
    uint32_t braking = rig_state()->steps - before;
    CHECK(braking > 1000 && braking < 1800);
    CHECK(strstr(ask("stat"), "state=ready homed=1") != NULL);
    CHECK(near(angle_deg(), (double)field(ask("stat"), "angle") / 100));
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
    braking_shortens_the_move_and_keeps_the_angle();
    a_move_refuses_to_start_where_the_angle_is_unknown_or_the_table_turns();
    a_hidden_mark_is_a_fault_and_homing_works_again_after_it();
    a_slip_is_not_seen_by_the_firmware();
}
