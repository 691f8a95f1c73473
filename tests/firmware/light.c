#include "bench.h"

static void lit_for_ms(int ms)
{
    for (; ms > 0; ms -= 500) {
        advance_ms(500);
        ask("beat");
    }
}

static void the_strip_shows_what_was_asked(void)
{
    bench_boot();
    CHECK_TEXT(lit_after("led 255 800000001"), "800000001");
    CHECK(rig_state()->levels[0] == 255 && rig_state()->levels[35] == 255 && lit_count() == 2);
    CHECK_TEXT(lit_after("led 7 FFFFFFFFF"), "FFFFFFFFF");
    CHECK(rig_state()->levels[20] == 7 && lit_count() == 36);
    CHECK_TEXT(lit_after("led 255 2"), "000000002");
    CHECK(lit_count() == 1);
    CHECK_TEXT(ask("off"), "ok");
    CHECK(lit_count() == 0);
}

static void level_zero_lights_nothing(void)
{
    bench_boot();
    CHECK_TEXT(lit_after("led 0 FFF"), "000000000");
    advance_ms(1500);
    CHECK_TEXT(state(), "unhomed");
}

static void an_led_has_a_limit_of_its_own(void)
{
    bench_boot();
    ask("led 255 1");
    lit_for_ms(15000);
    ask("led 255 3");
    lit_for_ms(6000);
    CHECK(rig_state()->levels[0] == 0 && rig_state()->levels[1] == 255);
    CHECK_TEXT(lit_after("stat all"), "000000002");
    CHECK_TEXT(ask("led 255 5"), "err hot");
    CHECK(rig_state()->levels[1] == 255);
    CHECK_TEXT(lit_after("led 255 4"), "000000004");
    lit_for_ms(11000);
    CHECK_TEXT(lit_after("led 255 1"), "000000001");
}

static void switching_does_not_get_around_the_limit(void)
{
    bench_boot();
    for (int i = 0; i < 30; i++) {
        ask("led 255 1");
        lit_for_ms(1000);
        ask("off");
        advance_ms(20);
    }
    CHECK_TEXT(ask("led 255 1"), "err hot");
}

static void one_led_changes_alone(void)
{
    bench_boot();
    CHECK_TEXT(lit_after("led 200 3"), "000000003");
    CHECK_TEXT(lit_after("lamp 35 9"), "800000003");
    CHECK_TEXT(lit_after("lamp 0 10"), "800000003");
    CHECK_TEXT(lit_after("lamp 1 0"), "800000001");
    CHECK(rig_state()->levels[0] == 10 && rig_state()->levels[35] == 9 && lit_count() == 2);
    CHECK_TEXT(lit_after("led 200 3"), "000000003");
    CHECK(rig_state()->levels[0] == 200 && lit_count() == 2);
}

static void all_together_take_no_more_than_the_supply_gives(void)
{
    bench_boot();
    ask("set supply_ma 180"); /* three LEDs of 60 mA */
    CHECK_TEXT(ask("led 255 F"), "err supply");
    CHECK(lit_count() == 0);
    CHECK_TEXT(lit_after("led 255 7"), "000000007");
    CHECK_TEXT(ask("lamp 3 2"), "err supply");
    CHECK_TEXT(lit_after("lamp 2 0"), "000000003");
    CHECK_TEXT(lit_after("lamp 3 255"), "00000000B");
    CHECK_TEXT(lit_after("led 21 FFFFFFFFF"), "FFFFFFFFF");
    CHECK_TEXT(ask("led 22 FFFFFFFFF"), "err supply");
    CHECK(rig_state()->levels[0] == 21);
}

static void the_settle_time_counts_the_supplys_rise(void)
{
    bench_boot();
    CHECK(field(ask("led 255 1"), "settle") == 7000);
    CHECK(field(ask("led 255 2"), "settle") == 2000);
    CHECK_TEXT(ask("set settle_us 150"), "err busy");
    ask("off");
    ask("set settle_us 150");
    CHECK(field(ask("lamp 0 1"), "settle") == 150);
}

void test_light(void)
{
    the_strip_shows_what_was_asked();
    level_zero_lights_nothing();
    an_led_has_a_limit_of_its_own();
    switching_does_not_get_around_the_limit();
    one_led_changes_alone();
    all_together_take_no_more_than_the_supply_gives();
    the_settle_time_counts_the_supplys_rise();
}
