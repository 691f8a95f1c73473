#include "side_channel.h"

#include "entropy.h"
#include "hal.h"
#include "rig.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LONGEST_ADVANCE_MS 86400000.0

static bool run(const char *verb, bool has_value, double value);
static void describe(const struct rig_state *state, char *answer, size_t limit);

void side_channel_answer(const char *command, char *answer, size_t limit)
{
    char verb[16];
    double value = 0;
    char surplus;
    int items = sscanf(command, "%15s %lf %c", verb, &value, &surplus);
    if ((items == 1 || items == 2) && isfinite(value) && run(verb, items == 2, value))
        describe(rig_state(), answer, limit);
    else
        snprintf(answer, limit, "error unknown command or value: %.60s\n", command);
}

static bool run(const char *verb, bool has_value, double value)
{
    bool is_switch = has_value && (value == 0 || value == 1);
    if (strcmp(verb, "state") == 0 && !has_value)
        return true;
    if (strcmp(verb, "reset") == 0 && !has_value)
        rig_watchdog_reset(entropy());
    else if (strcmp(verb, "advance") == 0 && has_value && value >= 0 && value <= LONGEST_ADVANCE_MS)
        rig_advance_us((uint64_t)llround(value * 1000));
    else if (strcmp(verb, "slip") == 0 && has_value && fabs(value) <= CENTIDEGREES_PER_TURN)
        rig_slip((int32_t)lround(value));
    else if (strcmp(verb, "estop") == 0 && is_switch)
        rig_press_estop(value == 1);
    else if (strcmp(verb, "button") == 0 && is_switch)
        rig_press_button(value == 1);
    else if (strcmp(verb, "hide_mark") == 0 && is_switch)
        rig_hide_mark(value == 1);
    else if (strcmp(verb, "spoil") == 0 && has_value && value >= 0 && value < HAL_EEPROM_SIZE)
        rig_spoil_eeprom((uint8_t)value);
    else
        return false;
    return true;
}

static void describe(const struct rig_state *state, char *answer, size_t limit)
{
    char levels[2 * LED_COUNT + 1];
    for (size_t led = 0; led < LED_COUNT; led++)
        snprintf(levels + 2 * led, 3, "%02X", state->levels[led]);
    snprintf(answer, limit,
             "ok time_us=%" PRIu64 " angle_udeg=%" PRIu32 " leds=%s strobes=%" PRIu32
             " steps=%" PRIu32 " estop=%d button=%d\n",
             state->time_us, state->angle_udeg, levels, state->strobes, state->steps, state->estop,
             state->button);
}
