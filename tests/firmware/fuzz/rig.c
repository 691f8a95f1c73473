/* libFuzzer on everything together: lines, noise, time and pins in any order, and what must hold
 * whatever they are. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config.h"
#include "crc.h"
#include "hal.h"
#include "line.h"
#include "motion.h"
#include "parameters.h"
#include "rig.h"
#include "safety.h"

#define SLICE_US 4000
#define LONGEST_US 5000000 /* of virtual time that one input may take */
#define SILENCE_US 1500000 /* after which a rig without a host is dark and still */
#define SLACK_US 20000     /* the on-time is looked at every 10 ms */

#define MUST(condition)                                                                   \
    do {                                                                                  \
        if (!(condition)) {                                                               \
            fprintf(stderr, "%s:%d: broken: %s\n", __FILE__, __LINE__, #condition);       \
            abort();                                                                      \
        }                                                                                 \
    } while (0)

struct input {
    const uint8_t *data;
    size_t left;
};

static struct {
    unsigned sequence;
    char line[160]; /* the last sealed one */
    uint64_t heard_us; /* when a line last ended */
    uint32_t lines, replies, lines_that_trigger;
    uint64_t lit_since_us[LED_COUNT];
    enum reason fault; /* when last looked at, and the steps made until then */
    uint32_t steps;
    bool disturbed; /* the table was turned or held, so that its angle may be wrong unseen */
} host;

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void act(struct input *input);
static void say_command(struct input *input);
static void say_anything_sealed(struct input *input);
static void say_noise(struct input *input);
static void say(const char *body);
static void send(const char *bytes, size_t length);
static void advance(uint64_t us);
static void check(void);
static void check_fault(void);
static void check_output(void);
static uint32_t take(struct input *input, uint8_t bytes);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct input input = {data, size};
    memset(&host, 0, sizeof host);
    rig_power_up(0x00C0FFEE);
    check();
    while (input.left > 0 && rig_state()->time_us < LONGEST_US)
        act(&input);
    if (rig_state()->estop)
        rig_press_estop(false);
    advance(SILENCE_US);
    return 0;
}

static void act(struct input *input)
{
    uint32_t steps = rig_state()->steps;
    bool held = rig_state()->estop;
    switch (take(input, 1) % 16) {
    case 0:
        say_noise(input);
        break;
    case 1:
        say_anything_sealed(input);
        break;
    case 2:
        send(host.line, strlen(host.line)); /* again */
        break;
    case 3:
        rig_press_button(!rig_state()->button);
        break;
    case 4:
        rig_press_estop(!held);
        host.disturbed = true;
        break;
    case 5:
        rig_hide_mark(!rig_state()->mark_hidden);
        host.disturbed |= strcmp(motion_word(), "homing") == 0; /* it may appear past its edge */
        break;
    case 6:
        rig_slip((int32_t)take(input, 2) - 32768);
        host.disturbed = true;
        break;
    case 7:
        rig_jam(take(input, 1) & 1);
        host.disturbed = true;
        break;
    case 8:
        rig_spoil_eeprom(take(input, 1) % HAL_EEPROM_SIZE);
        break;
    case 9:
        rig_watchdog_reset(take(input, 1));
        host.lines_that_trigger++; /* it has forgotten that the last line was done */
        break;
    case 10:
    case 11:
        advance((uint64_t)take(input, 2) * 20);
        break;
    default:
        say_command(input);
        break;
    }
    MUST(!(held && rig_state()->estop) || rig_state()->steps == steps);
    check();
}

static void say_command(struct input *input)
{
    static const char *const bare[] = {"hello", "stat", "stat all", "clear", "stop", "off",
                                       "beat",  "home", "home",     "clear"};
    static const char *const names[] = {
        "full_steps",  "microsteps",   "motor_teeth", "table_teeth", "reversed",
        "start_speed", "top_speed",    "acceleration", "home_speed", "index_speed",
        "led_ma",      "supply_ma",    "led_limit_ms", "settle_us",
    };
    char body[64];
    uint32_t verb = take(input, 1) % 9, which = take(input, 1), value = take(input, 3);
    const char *name = names[which % (sizeof names / sizeof names[0])];
    switch (verb) {
    case 0:
        snprintf(body, sizeof body, "move %u", value % 36010);
        break;
    case 1:
        snprintf(body, sizeof body, "led %u %X", which, value);
        break;
    case 2:
        snprintf(body, sizeof body, "lamp %u %u", which % 40, value % 260);
        break;
    case 3:
        snprintf(body, sizeof body, "trig %u", which);
        host.lines_that_trigger++;
        break;
    case 4:
        snprintf(body, sizeof body, "ack %u", which);
        break;
    case 5:
        snprintf(body, sizeof body, "get %s", name);
        break;
    case 6:
        snprintf(body, sizeof body, "set %s %u", name, value % 1000100);
        host.disturbed = true;
        break;
    default:
        snprintf(body, sizeof body, "%s", bare[which % (sizeof bare / sizeof bare[0])]);
        break;
    }
    say(body);
}

static void say_anything_sealed(struct input *input)
{
    char body[50];
    uint8_t length = (uint8_t)(take(input, 1) % sizeof body);
    for (uint8_t i = 0; i < length; i++)
        body[i] = (char)take(input, 1);
    body[length] = '\0';
    host.lines_that_trigger++;
    host.disturbed = true;
    say(body);
}

static void say_noise(struct input *input)
{
    char bytes[80];
    uint8_t length = (uint8_t)(take(input, 1) % sizeof bytes);
    for (uint8_t i = 0; i < length; i++)
        bytes[i] = (char)take(input, 1);
    host.lines_that_trigger += length;
    host.disturbed = true;
    send(bytes, length);
}

static void say(const char *body)
{
    char text[80];
    host.sequence = host.sequence % 65535 + 1;
    snprintf(text, sizeof text, "%u %s", host.sequence, body);
    snprintf(host.line, sizeof host.line, "%s *%02X%04X\n", text, (unsigned)strlen(text),
             crc16(text, (uint8_t)strlen(text)));
    send(host.line, strlen(host.line));
}

static void send(const char *bytes, size_t length)
{
    for (size_t i = 0; i < length; i++) {
        bool ends = bytes[i] == '\n' || bytes[i] == '\r';
        host.lines += ends;
        if (ends)
            host.heard_us = rig_state()->time_us;
        rig_host_byte((uint8_t)bytes[i]);
        if (ends)
            check();
    }
}

static void advance(uint64_t us)
{
    for (uint64_t passed = 0; passed < us; passed += SLICE_US) {
        uint32_t steps = rig_state()->steps;
        rig_advance_us(SLICE_US);
        MUST(rig_state()->time_us < host.heard_us + SILENCE_US || rig_state()->steps == steps);
        check();
    }
}

static void check(void)
{
    const struct rig_state *rig = rig_state();
    uint32_t levels = 0;
    for (uint8_t led = 0; led < LED_COUNT; led++) {
        levels += rig->levels[led];
        if (rig->levels[led] == 0)
            host.lit_since_us[led] = rig->time_us;
        uint64_t limit_us = (uint64_t)parameter(LED_LIMIT_MS) * 1000 + SLACK_US;
        MUST(rig->time_us <= host.lit_since_us[led] + limit_us);
    }
    MUST(levels * (uint64_t)parameter(LED_MA) <= 255 * (uint64_t)parameter(SUPPLY_MA));
    MUST(levels == 0 || safety_fault() == REASON_NONE);
    MUST(levels == 0 || rig->time_us < host.heard_us + SILENCE_US);
    MUST(rig->strobes <= host.lines_that_trigger);
    if (!host.disturbed && strcmp(motion_word(), "ready") == 0) {
        int64_t apart = (int64_t)rig->angle_udeg - motion_angle_centidegrees() * (int64_t)10000;
        MUST(llabs((apart + 540000000) % 360000000 - 180000000) < 20000);
    }
    check_fault();
    check_output();
}

/* A latched fault keeps the table still, but for the ramp that ends a lease; what a person has
 * stopped is never taken for what a host clears by itself. */
static void check_fault(void)
{
    enum reason before = host.fault;
    uint32_t steps = host.steps;
    host.fault = safety_fault();
    host.steps = rig_state()->steps;
    MUST(before == REASON_NONE || before == REASON_LEASE || host.steps == steps);
    bool by_person = before == REASON_STOP || before == REASON_ESTOP;
    MUST(!by_person || (host.fault != REASON_LEASE && host.fault != REASON_INDEX));
}

/* Every line is whole, and every reply was asked for. */
static void check_output(void)
{
    static char output[4096], line[256];
    size_t length = rig_take_output(output, sizeof output), start = 0;
    for (size_t i = 0; i < length; i++) {
        if (output[i] != '\n')
            continue;
        uint16_t crc;
        MUST(i - start < sizeof line);
        memcpy(line, output + start, i - start);
        MUST(line_open(line, (uint8_t)(i - start), &crc) == LINE_SEALED);
        host.replies += line[0] != '!';
        start = i + 1;
    }
    MUST(start == length);
    MUST(host.replies <= host.lines);
}

static uint32_t take(struct input *input, uint8_t bytes)
{
    uint32_t value = 0;
    for (; bytes > 0 && input->left > 0; bytes--, input->left--)
        value = value << 8 | *input->data++;
    return value;
}
