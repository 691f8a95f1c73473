#include "bench.h"

#include "motion.h"

#define START_RATE 2000 /* steps/s, as the defaults make them */
#define TOP_RATE 8000

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
    CHECK_TEXT(ask("stat"), "ok is=ready at=0");
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
    CHECK(field(ask("stat"), "at") == 0);
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
        CHECK(rig_state()->steps - before <= RIG_STEPS_PER_TURN / 2);
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
    CHECK(slower <= START_RATE / 100 + 5);
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
    CHECK_TEXT(state(), "ready");
    CHECK(near(angle_deg(), (double)field(ask("stat"), "at") / 100));
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
    CHECK_TEXT(state(), "index");
    CHECK_TEXT(ask("home"), "err index");
    rig_hide_mark(false);
    CHECK_TEXT(ask("clear"), "ok");
    ask("home");
    settle();
    CHECK_TEXT(state(), "ready");
}

/* What homing takes for the edge then lies in the mark. */
static void a_mark_that_is_seen_late_is_left_and_found_again(void)
{
    bench_boot();
    rig_hide_mark(true);
    rig_slip(36000 - 21600 - 300);
    ask("home");
    while (angle_deg() > 180 || angle_deg() < 3.5)
        advance_ms(1);
    rig_hide_mark(false);
    settle();
    CHECK_TEXT(ask("stat"), "ok is=ready at=0");
    CHECK(near(angle_deg(), 0));
}

static int32_t lost_in_a_second_homing(int32_t slip_centidegrees)
{
    home();
    ask("move 9000");
    settle();
    rig_slip(slip_centidegrees);
    CHECK(field(ask("stat"), "at") == 9000); /* not seen yet */
    CHECK_TEXT(ask("home"), "ok");
    settle();
    CHECK_TEXT(ask("stat"), "ok is=ready at=0");
    CHECK(near(angle_deg() > 359.9 ? angle_deg() - 360 : angle_deg(), 0));
    return (int32_t)field(ask("stat all"), "lost");
}

static void homing_a_homed_table_tells_how_many_steps_were_lost(void)
{
    CHECK(lost_in_a_second_homing(0) == 0);
    CHECK(lost_in_a_second_homing(-180) == 80);
    CHECK(lost_in_a_second_homing(180) == -80);
    CHECK(lost_in_a_second_homing(450) == -200);    /* homing starts on the mark */
    CHECK(lost_in_a_second_homing(-4500) == 2000);  /* the mark has to be sought */
    CHECK(lost_in_a_second_homing(4500) == -2000);
    CHECK(lost_in_a_second_homing(-17100) == 7600);
}

static void a_homed_table_goes_straight_to_the_mark(void)
{
    home();
    ask("move 27000");
    settle();
    uint32_t before = rig_state()->steps;
    ask("home");
    settle();
    CHECK(rig_state()->steps - before == RIG_STEPS_PER_TURN / 4);
}

/* From anywhere, the mark included, and with any start of the ramp. */
static void homing_ends_on_the_edge_from_anywhere(void)
{
    for (int32_t slip = 0; slip < 36000; slip += 441) {
        bench_boot();
        rig_slip(slip);
        ask("home");
        settle();
        CHECK_TEXT(ask("stat"), "ok is=ready at=0");
        CHECK(near(angle_deg() > 359.9 ? angle_deg() - 360 : angle_deg(), 0));
        CHECK(field(ask("stat all"), "lost") == 0);
    }
}

static void a_table_that_does_not_leave_the_mark_is_a_fault(void)
{
    home();
    ask("move 200");
    settle();
    rig_jam(true);
    ask("home");
    settle();
    CHECK_TEXT(state(), "index");
}

static void gears_and_microsteps_scale_the_way(void)
{
    home();
    CHECK(strncmp(ask("set microsteps 32"), "ok microsteps=32 ", 17) == 0);
    CHECK_TEXT(ask("move 9000"), "err home");
    ask("home");
    settle();
    ask("move 4500");
    settle();
    CHECK(near(angle_deg(), 90)); /* the driver's switches still say 16 */
    ask("set motor_teeth 40");
    ask("home");
    settle();
    ask("move 4500");
    settle();
    CHECK(near(angle_deg(), 45));
}

static void a_reversed_motor_turns_the_other_way(void)
{
    bench_boot();
    ask("set reversed 1");
    double before = angle_deg();
    ask("home");
    advance_ms(100);
    CHECK(angle_deg() < before);
}

static void twenty_thousand_steps_a_second_are_reached(void)
{
    home();
    ask("set acceleration 200000");
    ask("set top_speed 45000");
    ask("move 18000");
    uint32_t fastest = 0;
    for (uint32_t next; (next = steps_in_10_ms()) > 0;)
        fastest = next > fastest ? next : fastest;
    CHECK(fastest == 200);
    CHECK(angle_deg() == 180);
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
    a_mark_that_is_seen_late_is_left_and_found_again();
    homing_a_homed_table_tells_how_many_steps_were_lost();
    a_homed_table_goes_straight_to_the_mark();
    homing_ends_on_the_edge_from_anywhere();
    a_table_that_does_not_leave_the_mark_is_a_fault();
    gears_and_microsteps_scale_the_way();
    a_reversed_motor_turns_the_other_way();
    twenty_thousand_steps_a_second_are_reached();
}
