#include "commands.h"

#include "config.h"
#include "events.h"
#include "hal.h"
#include "identity.h"
#include "light.h"
#include "motion.h"
#include "safety.h"
#include "session.h"
#include "shot.h"
#include "uptime.h"

#include <string.h>

/* Adds the reply's fields; returns NULL, or the word for what was wrong. */
typedef const char *handler(char *arguments[], struct line *reply);

static handler hello, home, move, led, off, trig, stat, beat, ack, stop, clear;

static const struct command {
    const char *verb;
    uint8_t arguments;
    bool may_be_typed;
    handler *run;
} commands[] = {
    {"hello", 0, true, hello},
    {"home", 0, false, home},
    {"move", 1, false, move},
    {"led", 2, false, led},
    {"off", 0, true, off},
    {"trig", 1, false, trig},
    {"stat", 0, true, stat},
    {"beat", 0, false, beat},
    {"ack", 1, false, ack},
    {"stop", 0, true, stop},
    {"clear", 0, false, clear},
};

static void head(struct line *reply, int32_t sequence, const char *outcome);
static const struct command *find(const char *verb);
static const char *why_not(const struct command *command, uint8_t arguments, bool typed);
static void report(struct line *reply);

void command_run(int32_t sequence, char *words[], uint8_t count, bool typed, struct line *reply)
{
    const struct command *command = find(words[0]);
    const char *error = why_not(command, (uint8_t)(count - 1), typed);
    if (error == NULL) {
        head(reply, sequence, " ok");
        error = command->run(words + 1, reply);
    }
    if (error != NULL) {
        head(reply, sequence, " err ");
        line_text(reply, error);
    }
    line_seal(reply);
}

static const char *hello(char *arguments[], struct line *reply)
{
    (void)arguments;
    shot_forget();
    line_field(reply, "proto");
    line_decimal(reply, PROTOCOL_VERSION);
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
    line_decimal(reply, LED_COUNT);
    return NULL;
}

static const char *home(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    return motion_home();
}

static const char *move(char *arguments[], struct line *reply)
{
    (void)reply;
    int32_t centidegrees;
    if (!line_read_integer(arguments[0], 0, CENTIDEGREES_PER_TURN - 1, &centidegrees))
        return "range";
    return motion_move(centidegrees);
}

static const char *led(char *arguments[], struct line *reply)
{
    int32_t level;
    struct led_set set;
    if (!line_read_integer(arguments[0], 0, 255, &level) || !led_set_read(&set, arguments[1]))
        return "range";
    const char *error = light_set((uint8_t)level, &set);
    light_report(reply);
    return error;
}

static const char *off(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    light_off();
    return NULL;
}

static const char *trig(char *arguments[], struct line *reply)
{
    int32_t id;
    if (!line_read_integer(arguments[0], 0, 999999999, &id))
        return "range";
    const char *error = shot_fire(id);
    if (error != NULL)
        return error;
    line_field(reply, "shot");
    line_decimal(reply, (uint64_t)id);
    report(reply);
    return NULL;
}

static const char *stat(char *arguments[], struct line *reply)
{
    (void)arguments;
    report(reply);
    line_field(reply, "state");
    line_text(reply, safety_fault() != FAULT_NONE ? fault_word(safety_fault()) : motion_word());
    line_field(reply, "homed");
    line_decimal(reply, motion_homed());
    line_field(reply, "done");
    line_decimal(reply, session_commands());
    line_field(reply, "bad");
    line_decimal(reply, session_broken_lines());
    return NULL;
}

static const char *beat(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    return NULL;
}

static const char *ack(char *arguments[], struct line *reply)
{
    (void)reply;
    int32_t id;
    if (!line_read_integer(arguments[0], 1, 255, &id))
        return "range";
    events_acknowledge((uint8_t)id);
    return NULL;
}

static const char *stop(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    safety_latch(FAULT_STOP);
    return NULL;
}

static const char *clear(char *arguments[], struct line *reply)
{
    (void)arguments, (void)reply;
    return safety_clear();
}

static void head(struct line *reply, int32_t sequence, const char *outcome)
{
    line_clear(reply);
    line_decimal(reply, (uint64_t)sequence);
    line_text(reply, outcome);
}

static const struct command *find(const char *verb)
{
    for (uint8_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        if (strcmp(commands[i].verb, verb) == 0)
            return &commands[i];
    return NULL;
}

static const char *why_not(const struct command *command, uint8_t arguments, bool typed)
{
    if (command == NULL)
        return "verb";
    if (typed && !command->may_be_typed)
        return "check";
    return arguments == command->arguments ? NULL : "count";
}

static void report(struct line *reply)
{
    line_field(reply, "time");
    line_decimal(reply, uptime_us());
    line_field(reply, "angle");
    line_decimal(reply, (uint64_t)motion_angle_centidegrees());
    light_report(reply);
}
