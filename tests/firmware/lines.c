#include "bench.h"

#include "line.h"

static void words_are_split_at_single_spaces(void)
{
    char text[] = "led 255 1", two_spaces[] = "led  255", trailing[] = "led ", many[] = "a b c d";
    char *words[3];
    CHECK(line_split(text, words, 3) == 3);
    CHECK_TEXT(words[0], "led");
    CHECK_TEXT(words[2], "1");
    CHECK(line_split(two_spaces, words, 3) == 0);
    CHECK(line_split(trailing, words, 3) == 0);
    CHECK(line_split(many, words, 3) == 4);
}

static void integers_are_read_within_their_range(void)
{
    int32_t value;
    CHECK(line_read_integer("-12", -12, 5, &value) && value == -12);
    CHECK(line_read_integer("999999999", 0, 999999999, &value) && value == 999999999);
    CHECK(!line_read_integer("6", -12, 5, &value));
    CHECK(!line_read_integer("", 0, 5, &value));
    CHECK(!line_read_integer("-", -5, 5, &value));
    CHECK(!line_read_integer("1.5", 0, 5, &value));
    CHECK(!line_read_integer("4294967297", 0, 5, &value));
}

static void numbers_are_written_in_decimal(void)
{
    struct line line;
    line_clear(&line);
    line_decimal(&line, 0);
    line_text(&line, " ");
    line_integer(&line, INT32_MIN);
    line_text(&line, " ");
    line_decimal(&line, UINT32_MAX);
    line_text(&line, " ");
    line_long_decimal(&line, 1000000009);
    line_text(&line, " ");
    line_long_decimal(&line, 4294967295000000001);
    line_text(&line, " ");
    line_long_decimal(&line, 70);
    CHECK(line.length == sizeof "0 -2147483648 4294967295 1000000009 4294967295000000001 70" - 1);
    CHECK(memcmp(line.body, "0 -2147483648 4294967295 1000000009 4294967295000000001 70", line.length) == 0);
}

static void a_line_never_outgrows_its_buffer(void)
{
    struct line line;
    line_clear(&line);
    for (int i = 0; i < 100; i++)
        line_long_decimal(&line, 4294967295000000001);
    CHECK(line.length == BODY_SIZE);
}

static void a_line_that_was_started_is_sent_once_and_whole(void)
{
    struct line line;
    char sent[64];
    bench_boot();
    rig_take_output(sent, sizeof sent);
    line_clear(&line);
    line_text(&line, "123");
    line_start(&line);
    CHECK(rig_take_output(sent, sizeof sent) == 2 && memcmp(sent, "12", 2) == 0);
    line_text(&line, "456789");
    line_send(&line);
    CHECK(rig_take_output(sent, sizeof sent) == 16 && memcmp(sent, "3456789 *0929B1\n", 16) == 0);
    line_send(&line);
    CHECK(rig_take_output(sent, sizeof sent) == 18 && memcmp(sent, "123456789 *0929B1\n", 18) == 0);
}

static void the_longest_reply_fits(void)
{
    CHECK(sizeof "65535 ok proto=2 firmware=10.10.10 build=v10.10.10-1000-g01234567-dirty "
                 "board=atmega2560 boot=00C0FFEE reset=brownout leds=36 parameters=corrupt" <= BODY_SIZE);
    CHECK(sizeof "65535 ok is=unhomed at=35999 time=18446744073709551615 lit=FFFFFFFFF lost=-29000 "
                 "done=4294967295 bad=4294967295" <= BODY_SIZE);
}

void test_lines(void)
{
    words_are_split_at_single_spaces();
    integers_are_read_within_their_range();
    numbers_are_written_in_decimal();
    a_line_never_outgrows_its_buffer();
    a_line_that_was_started_is_sent_once_and_whole();
    the_longest_reply_fits();
}
