#include "bench.h"

#include "crc.h"

static char heard[8192];
static char events[8192];
static unsigned sequence;

static void sort_output(void);
static void add_event(const char *line);

void bench_boot(void)
{
    rig_power_up(0x00C0FFEE);
    sequence = 0;
    events[0] = '\0';
}

const char *bench_say(const char *line)
{
    heard[0] = '\0';
    for (; *line != '\0'; line++)
        rig_host_byte((uint8_t)*line);
    rig_host_byte('\n');
    sort_output();
    return heard;
}

const char *ask(const char *command)
{
    static char answer[256];
    char body[128], line[160], prefix[16];
    snprintf(body, sizeof body, "%u %s", ++sequence, command);
    snprintf(line, sizeof line, "%s *%02X%04X", body, (unsigned)strlen(body),
             crc16(body, (uint8_t)strlen(body)));
    snprintf(answer, sizeof answer, "%s", bench_say(line));
    char *seal = strstr(answer, " *");
    CHECK(seal != NULL);
    *seal = '\0';
    snprintf(prefix, sizeof prefix, "%u ", sequence);
    CHECK(strncmp(answer, prefix, strlen(prefix)) == 0);
    return answer + strlen(prefix);
}

const char *state(void)
{
    static char word[16];
    const char *reply = ask("stat");
    CHECK(sscanf(reply, "ok is=%15s ", word) == 1);
    return word;
}

const char *lit_after(const char *command)
{
    static char digits[64];
    const char *reply = ask(command), *lit = strstr(reply, " lit=");
    snprintf(digits, sizeof digits, "%s", lit == NULL ? reply : lit + strlen(" lit="));
    digits[strcspn(digits, lit == NULL ? "" : " ")] = '\0';
    return digits;
}

const char *bench_events(void)
{
    static char taken[8192];
    sort_output();
    memcpy(taken, events, sizeof taken);
    events[0] = '\0';
    return taken;
}

long field(const char *reply, const char *key)
{
    char pattern[32];
    snprintf(pattern, sizeof pattern, " %s=", key);
    const char *place = strstr(reply, pattern);
    CHECK(place != NULL);
    return strtol(place + strlen(pattern), NULL, 10);
}

void advance_ms(uint64_t ms)
{
    rig_advance_us(ms * 1000);
}

void settle(void)
{
    for (int polls = 0; strstr(ask("stat"), "ing at=") != NULL; polls++) {
        CHECK(polls < 1000);
        advance_ms(20);
    }
}

double angle_deg(void)
{
    return rig_state()->angle_udeg / 1e6;
}

int lit_count(void)
{
    int count = 0;
    for (int led = 0; led < LED_COUNT; led++)
        count += rig_state()->levels[led] > 0;
    return count;
}

/* The first reply goes to `heard`, events to `events`. */
static void sort_output(void)
{
    char output[8192];
    output[rig_take_output(output, sizeof output - 1)] = '\0';
    for (char *line = strtok(output, "\n"); line != NULL; line = strtok(NULL, "\n")) {
        if (line[0] == '!')
            add_event(line);
        else if (heard[0] == '\0')
            snprintf(heard, sizeof heard, "%s", line);
    }
}

static void add_event(const char *line)
{
    size_t used = strlen(events);
    int body = (int)(strstr(line, " *") - line);
    snprintf(events + used, sizeof events - used, "%.*s;", body, line);
}
