#include "bench.h"

static void press_button(uint64_t ms)
{
    rig_press_button(true);
    advance_ms(ms);
    rig_press_button(false);
    advance_ms(30);
}

static void a_boot_is_told_to_the_first_host_until_acknowledged(void)
{
    bench_boot();
    advance_ms(3000);
    CHECK_TEXT(bench_events(), "");
    bench_say("stat");
    CHECK_TEXT(bench_events(), "");
    ask("beat");
    CHECK_TEXT(bench_events(), "!1 boot boot=00C0FFEE;");
    advance_ms(900);
    CHECK_TEXT(bench_events(), "!1 boot boot=00C0FFEE;");
    ask("ack 2");
    advance_ms(450);
    CHECK_TEXT(bench_events(), "!1 boot boot=00C0FFEE;");
    ask("ack 1");
    advance_ms(900);
    CHECK_TEXT(bench_events(), "");
}

static void a_button_is_debounced(void)
{
    bench_boot();
    ask("beat");
    ask("ack 1");
    bench_events();
    press_button(10);
    CHECK_TEXT(bench_events(), "");
    press_button(40);
    CHECK_TEXT(bench_events(), "!2 button;");
    ask("ack 2");
    press_button(40);
    CHECK_TEXT(bench_events(), "!3 button;");
}

static void a_long_press_means_stop_and_is_no_press(void)
{
    bench_boot();
    ask("led 255 1");
    ask("ack 1");
    bench_events();
    rig_press_button(true);
    advance_ms(900);
    ask("beat");
    CHECK(lit_count() == 1);
    advance_ms(200);
    CHECK(lit_count() == 0);
    CHECK_TEXT(state(), "stop");
    rig_press_button(false);
    advance_ms(100);
    CHECK_TEXT(bench_events(), "!2 fault fault=stop;");
}

static void a_fault_is_told_by_name(void)
{
    bench_boot();
    ask("beat");
    ask("ack 1");
    bench_events();
    rig_press_estop(true);
    advance_ms(5);
    CHECK_TEXT(bench_events(), "!2 fault fault=estop;");
    rig_press_estop(false);
    ask("clear");
    advance_ms(600);
    CHECK_TEXT(bench_events(), "!2 fault fault=estop;");
}

static void ids_go_around_without_zero(void)
{
    bench_boot();
    for (int i = 0; i < 300; i++) {
        ask("beat");
        press_button(30);
    }
    bench_events();
    ask("beat");
    advance_ms(600);
    CHECK(strstr(bench_events(), "!46 button;") != NULL);
}

void test_events(void)
{
    a_boot_is_told_to_the_first_host_until_acknowledged();
    a_button_is_debounced();
    a_long_press_means_stop_and_is_no_press();
    a_fault_is_told_by_name();
    ids_go_around_without_zero();
}
