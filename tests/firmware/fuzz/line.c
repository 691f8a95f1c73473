/* libFuzzer on the line parser: no input breaks it, and what is sealed is read again as it was. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "led_set.h"
#include "line.h"
#include "rig.h"

#define LONGEST 63
#define WORDS 5

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void parse(const uint8_t *data, uint8_t size);
static void seal_and_open(const uint8_t *data, uint8_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > LONGEST)
        return -1;
    parse(data, (uint8_t)size);
    seal_and_open(data, (uint8_t)size);
    return 0;
}

/* As the receiver hands it over: with room for one character more, and not one byte beyond. */
static void parse(const uint8_t *data, uint8_t size)
{
    char *text = malloc(size + 1U), *words[WORDS];
    memcpy(text, data, size);
    uint16_t crc;
    if (line_open(text, size, &crc) != LINE_BROKEN) {
        uint8_t count = line_split(text, words, WORDS);
        for (uint8_t i = 0; i < count && i < WORDS && count <= WORDS; i++) {
            int32_t value;
            struct led_set set;
            if (line_read_integer(words[i], -7, 70000, &value) && (value < -7 || value > 70000))
                abort();
            if (led_set_read(&set, words[i]) && strlen(words[i]) > (LED_COUNT + 3) / 4)
                abort();
        }
    }
    free(text);
}

static void seal_and_open(const uint8_t *data, uint8_t size)
{
    if (size == 0 || memchr(data, '\0', size) != NULL)
        return;
    struct line line = {.length = size};
    memcpy(line.body, data, size);
    rig_power_up(0);
    line_send(&line);
    char sent[256];
    size_t length = rig_take_output(sent, sizeof sent) - 1;
    uint16_t crc;
    if (line_open(sent, (uint8_t)length, &crc) != LINE_SEALED || memcmp(sent, data, size) != 0)
        abort();
}
