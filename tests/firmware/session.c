#include "bench.h"

#include "crc.h"

static const char *seal(const char *body)
{
    static char line[160];
    snprintf(line, sizeof line, "%s *%02X%04X", body, (unsigned)strlen(body),
             crc16(body, (uint8_t)strlen(body)));
    return line;
}

static void a_repeated_line_is_answered_and_not_done(void)
{
    bench_boot();
    char first[256];
    snprintf(first, sizeof first, "%s", bench_say(seal("9 trig 4")));
    advance_ms(50);
    CHECK_TEXT(bench_say(seal("9 trig 4")), first);
    CHECK(rig_state()->strobes == 1);
}

static void a_typed_line_or_noise_leaves_the_kept_reply_alone(void)
{
    bench_boot();
    char first[256];
    snprintf(first, sizeof first, "%s", bench_say(seal("9 trig 4")));
    bench_say("stat");
    bench_say("9 trig 4 *08");
    CHECK_TEXT(bench_say(seal("9 trig 4")), first);
    CHECK(rig_state()->strobes == 1);
}

static void a_sequence_number_may_come_back_with_another_command(void)
{
    bench_boot();
    bench_say(seal("9 trig 4"));
    bench_say(seal("9 trig 5"));
    CHECK(rig_state()->strobes == 2);
}

static void done_and_broken_lines_are_counted(void)
{
    bench_boot();
    ask("beat");
    bench_say(seal("2 off"));
    bench_say(seal("2 off"));
    bench_say("noise!");
    bench_say("stat");
    const char *reply = bench_say(seal("3 stat all"));
    CHECK(field(reply, "done") == 3);
    CHECK(field(reply, "bad") == 1);
}

static void an_overlong_line_does_not_spoil_the_next(void)
{
    bench_boot();
    char line[301];
    memset(line, 'x', 300);
    line[300] = '\0';
    CHECK(strncmp(bench_say(line), "0 err long", 10) == 0);
    CHECK_TEXT(ask("beat"), "ok");
}

static void a_carriage_return_ends_a_line_and_empty_lines_are_skipped(void)
{
    bench_boot();
    CHECK(strncmp(bench_say("\r\n\n\nstat\r"), "0 ok is=", 8) == 0);
    CHECK_TEXT(bench_say(""), "");
}

static void a_shot_fires_once_until_the_next_hello(void)
{
    bench_boot();
    ask("led 255 11");
    const char *reply = ask("trig 7");
    CHECK(field(reply, "shot") == 7);
    CHECK(strstr(reply, " lit=000000011") != NULL);
    CHECK_TEXT(ask("trig 7"), "err spent");
    CHECK_TEXT(ask("trig 6"), "err spent");
    CHECK(rig_state()->strobes == 1);
    CHECK(strstr(ask("hello"), " boot=00C0FFEE reset=power leds=36") != NULL);
    CHECK(strncmp(ask("trig 0"), "ok shot=0", 9) == 0);
    CHECK(rig_state()->strobes == 2);
}

static void time_does_not_wrap_with_the_timer(void)
{
    bench_boot();
    advance_ms(3600000);
    advance_ms(3600000);
    const char *reply = ask("stat all");
    CHECK(strtoull(strstr(reply, "time=") + 5, NULL, 10) > 7200000000ULL);
}

void test_session(void)
{
    a_repeated_line_is_answered_and_not_done();
    a_typed_line_or_noise_leaves_the_kept_reply_alone();
    a_sequence_number_may_come_back_with_another_command();
    done_and_broken_lines_are_counted();
    an_overlong_line_does_not_spoil_the_next();
    a_carriage_return_ends_a_line_and_empty_lines_are_skipped();
    a_shot_fires_once_until_the_next_hello();
    time_does_not_wrap_with_the_timer();
}
