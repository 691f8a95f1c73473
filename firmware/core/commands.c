#include "commands.h"

#include "config.h"
#include "events.h"
#include "hal.h"
#include "identity.h"
#include "light.h"
#include "motion.h"
#include "parameters.h"
#include "safety.h"
#include "session.h"
#include "shot.h"
#include "uptime.h"

#include <stddef.h>

/* Adds the reply's fields; returns REASON_NONE, or what was wrong. */
typedef enum reason handler(char *arguments[], struct line *reply);

static const FLASH char all[] = "all";

static handler hello, stat, clear, stop, off, beat, ack, home, move, led, lamp, trig, get, set;

enum {
    TYPED = 1,    /* may come as a bare word */
    IN_FAULT = 2, /* is done while a fault is latched */
    OPTIONAL = 4, /* one argument more may come */
};

static const FLASH struct command {
    char verb[6];
    uint8_t arguments;
    uint8_t allowed;
    handler *run;
} commands[] = {
    {"hello", 0, TYPED | IN_FAULT, hello},
    {"stat", 0, TYPED | IN_FAULT | OPTIONAL, stat},
    {"clear", 0, IN_FAULT, clear},
    {"stop", 0, TYPED, stop},
    {"off", 0, TYPED, off},
    {"beat", 0, 0, beat},
    {"ack", 1, 0, ack},
    {"home", 0, 0, home},
    {"move", 1, 0, move},
    {"led", 2, 0, led},
    {"lamp", 2, 0, lamp},
    {"trig", 1, 0, trig},
    {"get", 1, 0, get},
    {"set", 2, 0, set},
};

static const FLASH struct command *find(const char *verb);
static enum reason why_not(const FLASH struct command *command, uint8_t arguments, bool typed);
static void field_lit(struct line *reply, const struct led_set *lit);
static void field_word(struct line *reply, const char *key, const FLASH char *word);
static void field_angle(struct line *reply, int32_t centidegrees);
static void field_time(struct line *reply, uint64_t time_us);
static void report_light(struct line *reply);
static void report_all(struct line *reply);

void command_run(char *words[], uint8_t count, bool typed, struct line *reply)
{
    uint8_t before = reply->length;
    const FLASH struct command *command = find(words[0]);
    enum reason reason = why_not(command, (uint8_t)(count - 1), typed);
    if (reason == REASON_NONE) {
        line_text(reply, " ok");
        reason = command->run(words + 1, reply);
    }
    if (reason != REASON_NONE) {
        reply->length = before;
        line_text(reply, " err ");
        line_word(reply, reason_word(reason));
    }
}

static enum reason hello(char *arguments[], struct line *reply)
{
    (void)arguments;
    shot_forget();
    line_field(reply, "proto");
    line_integer(reply, PROTOCOL_VERSION);
    line_field(reply, "firmware");
    line_text(reply, FIRMWARE_VERSION);
    line_field(reply, "build");
    line_text(reply, BUILD);
    line_field(reply, "board");
    line_text(reply, hal_board());
    line_field(reply, "boot");
    line_hex(reply, identity_boot(), 8);
    line_field(reply, "reset");
    line_text(reply, hal_reset_cause());
    line_field(reply, "leds");
    line_integer(reply, LED_COUNT);
    field_word(reply, "parameters", parameters_origin());
    return REASON_NONE;
}

/* Asked often, so kept short unless all is asked for. */
static enum reason stat(char *arguments[], struct line *reply)
{
    if (arguments[0] != NULL && !line_same_word(arguments[0], all))
        return REASON_RANGE;
    enum reason fault = safety_fault();
    field_word(reply, "is", fault == REASON_NONE ? motion_word() : reason_word(fault));
    field_angle(reply, motion_angle_centidegrees());
    if (arguments[0] != NULL)
        report_all(reply);
    return REASON_NONE;
}

static enum reason clear(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    return safety_clear();
}

static enum reason stop(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    safety_latch(REASON_STOP);
    return REASON_NONE;
}

static enum reason off(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    light_off();
    return REASON_NONE;
}

static enum reason beat(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    return REASON_NONE;
}

static enum reason ack(char *arguments[], struct line *reply)
{
    (void)reply;
    int32_t id;
    if (!line_read_integer(arguments[0], 1, 255, &id))
        return REASON_RANGE;
    events_acknowledge((uint8_t)id);
    return REASON_NONE;
}

static enum reason home(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    return motion_home();
}

static enum reason move(char *arguments[], struct line *reply)
{
    (void)reply;
    int32_t centidegrees;
    if (!line_read_integer(arguments[0], 0, CENTIDEGREES_PER_TURN - 1, &centidegrees))
        return REASON_RANGE;
    return motion_move(centidegrees);
}

static enum reason led(char *arguments[], struct line *reply)
{
    int32_t level;
    struct led_set set;
    if (!line_read_integer(arguments[0], 0, 255, &level) || !led_set_read(&set, arguments[1]))
        return REASON_RANGE;
    enum reason reason = light_set((uint8_t)level, &set);
    report_light(reply);
    return reason;
}

static enum reason lamp(char *arguments[], struct line *reply)
{
    int32_t index, level;
    if (!line_read_integer(arguments[0], 0, LED_COUNT - 1, &index)
        || !line_read_integer(arguments[1], 0, 255, &level))
        return REASON_RANGE;
    enum reason reason = light_one((uint8_t)index, (uint8_t)level);
    report_light(reply);
    return reason;
}

static enum reason trig(char *arguments[], struct line *reply)
{
    int32_t id;
    if (!line_read_integer(arguments[0], 0, 999999999, &id))
        return REASON_RANGE;
    struct shot shot;
    enum reason reason = shot_fire(id, &shot);
    if (reason != REASON_NONE)
        return reason;
    line_field(reply, "shot");
    line_integer(reply, id);
    field_time(reply, shot.time_us);
    field_angle(reply, shot.centidegrees);
    field_lit(reply, &shot.lit);
    return REASON_NONE;
}

static enum reason get(char *arguments[], struct line *reply)
{
    enum parameter found;
    if (!parameter_find(arguments[0], &found))
        return REASON_NAME;
    parameter_report(found, reply);
    return REASON_NONE;
}

static enum reason set(char *arguments[], struct line *reply)
{
    enum parameter found;
    int32_t value;
    if (!parameter_find(arguments[0], &found))
        return REASON_NAME;
    if (!line_read_integer(arguments[1], 0, 999999999, &value))
        return REASON_RANGE;
    if (motion_turning() || light_any())
        return REASON_BUSY;
    enum reason reason = parameter_set(found, value);
    if (reason == REASON_NONE) {
        motion_configure();
        parameter_report(found, reply);
    }
    return reason;
}

static const FLASH struct command *find(const char *verb)
{
    for (uint8_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        if (line_same_word(verb, commands[i].verb))
            return &commands[i];
    return NULL;
}

static enum reason why_not(const FLASH struct command *command, uint8_t arguments, bool typed)
{
    if (command == NULL)
        return REASON_VERB;
    if (typed && !(command->allowed & TYPED))
        return REASON_CHECK;
    bool one_more = command->allowed & OPTIONAL && arguments == command->arguments + 1;
    if (arguments != command->arguments && !one_more)
        return REASON_COUNT;
    return command->allowed & IN_FAULT ? REASON_NONE : safety_check();
}

static void field_lit(struct line *reply, const struct led_set *lit)
{
    line_field(reply, "lit");
    led_set_write(lit, reply);
}

static void field_word(struct line *reply, const char *key, const FLASH char *word)
{
    line_field(reply, key);
    line_word(reply, word);
}

static void field_angle(struct line *reply, int32_t centidegrees)
{
    line_field(reply, "at");
    line_integer(reply, centidegrees);
}

static void field_time(struct line *reply, uint64_t time_us)
{
    line_field(reply, "time");
    line_long_decimal(reply, time_us);
}

static void report_light(struct line *reply)
{
    struct led_set lit = light_lit();
    field_lit(reply, &lit);
    line_field(reply, "settle");
    line_decimal(reply, light_settle_us());
}

static void report_all(struct line *reply)
{
    struct led_set lit = light_lit();
    field_time(reply, uptime_us());
    field_lit(reply, &lit);
    line_field(reply, "lost");
    line_integer(reply, motion_steps_lost());
    line_field(reply, "done");
    line_decimal(reply, session_commands());
    line_field(reply, "bad");
    line_decimal(reply, session_broken_lines());
}
