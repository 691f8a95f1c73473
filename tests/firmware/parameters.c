#include "bench.h"

static const char *origin(void)
{
    return strstr(ask("hello"), " parameters=") + strlen(" parameters=");
}

static void a_rig_that_was_never_set_up_has_the_defaults(void)
{
    bench_boot();
    CHECK_TEXT(origin(), "default");
    CHECK_TEXT(ask("get gear"), "err name");
    CHECK_TEXT(ask("get microsteps"), "ok microsteps=16 lowest=1 highest=256 default=16");
}

static void what_was_set_outlives_a_reset(void)
{
    bench_boot();
    CHECK_TEXT(ask("set microsteps 8"), "ok microsteps=8 lowest=1 highest=256 default=16");
    ask("set settle_us 1000000");
    rig_watchdog_reset(1);
    CHECK_TEXT(origin(), "kept");
    CHECK(field(ask("get microsteps"), "microsteps") == 8);
    CHECK(field(ask("get settle_us"), "settle_us") == 1000000);
    CHECK(field(ask("get reversed"), "reversed") == 0);
}

/* Wherever the damage is, the version and the CRC included. */
static void a_corrupt_block_falls_back_to_the_defaults_and_says_so(void)
{
    for (uint8_t address = 0; address < 59; address++) {
        bench_boot();
        ask("set microsteps 8");
        rig_spoil_eeprom(address);
        rig_watchdog_reset(1);
        CHECK_TEXT(origin(), "corrupt");
        CHECK(field(ask("get microsteps"), "microsteps") == 16);
        ask("set microsteps 8");
        rig_watchdog_reset(2);
        CHECK_TEXT(origin(), "kept");
    }
    bench_boot();
    ask("set microsteps 8");
    rig_spoil_eeprom(59);
    rig_watchdog_reset(1);
    CHECK_TEXT(origin(), "kept");
}

static void what_does_not_fit_together_is_refused_and_changes_nothing(void)
{
    static const char *const refused[] = {
        "set microsteps 0",      "set microsteps 257", "set microsteps 64",  "set top_speed 45003",
        "set start_speed 9001",  "set index_speed 10", "set home_speed 100", "set acceleration 1000",
        "set reversed 2",        "set reversed -1",    "set settle_us 1000001",
    };
    bench_boot();
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++)
        CHECK_TEXT(ask(refused[i]), "err range");
    CHECK_TEXT(origin(), "default");
    ask("home");
    CHECK_TEXT(ask("set settle_us 1"), "err busy");
    settle();
    CHECK_TEXT(ask("stat"), "ok is=ready at=0");
}

void test_parameters(void)
{
    a_rig_that_was_never_set_up_has_the_defaults();
    what_was_set_outlives_a_reset();
    a_corrupt_block_falls_back_to_the_defaults_and_says_so();
    what_does_not_fit_together_is_refused_and_changes_nothing();
}
