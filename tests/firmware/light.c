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
    CHECK_TEXT(ask("led 255 800000001"), "ok lit=800000001");
    CHECK(rig_state()->levels[0] == 255 && rig_state()->levels[35] == 255 && lit_count() == 2);
    CHECK_TEXT(ask("led 7 FFFFFFFFF"), "ok lit=FFFFFFFFF");
    CHECK(rig_state()->levels[20] == 7 && lit_count() == 36);
    CHECK_TEXT(ask("led 255 2"), "ok lit=000000002");
    CHECK(lit_count() == 1);
    CHECK_TEXT(ask("off"), "ok");
    CHECK(lit_count() == 0);
}

static void level_zero_lights_nothing(void)
{
    bench_boot();
    CHECK_TEXT(ask("led 0 FFF"), "ok lit=000000000");
    advance_ms(1500);
    CHECK(strstr(ask("stat"), "state=ready") != NULL);
}

static void an_led_has_a_limit_of_its_own(void)
{
    bench_boot();
    ask("led 255 1");
    lit_for_ms(15000);
    ask("led 255 3");
    lit_for_ms(6000);
    CHECK(rig_state()->levels[0] == 0 && rig_state()->levels[1] == 255);
    CHECK(strstr(ask("stat"), "lit=000000002 state=ready") != NULL);
    CHECK_TEXT(ask("led 255 5"), "err hot");
    CHECK(rig_state()->levels[1] == 255);
    CHECK_TEXT(ask("led 255 4"), "ok lit=000000004");
    lit_for_ms(11000);
    CHECK_TEXT(ask("led 255 1"), "ok lit=000000001");
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

void test_light(void)
{
    the_strip_shows_what_was_asked();
    level_zero_lights_nothing();
    an_led_has_a_limit_of_its_own();
    switching_does_not_get_around_the_limit();
}
