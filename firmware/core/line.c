#include "line.h"

#include "crc.h"
#include "hal.h"

#define SEAL_LENGTH 8 /* " *LLCCCC" */

static bool read_hex(const char *text, uint8_t digits, uint16_t *value);
static void put(struct line *line, char character);

enum line_kind line_open(char *text, uint8_t length, uint16_t *crc)
{
    text[length] = '\0';
    bool bare = true;
    for (uint8_t i = 0; i < length; i++)
        bare = bare && text[i] >= 'a' && text[i] <= 'z';
    if (bare)
        return LINE_TYPED;
    if (length <= SEAL_LENGTH)
        return LINE_BROKEN;

    uint8_t body = (uint8_t)(length - SEAL_LENGTH);
    uint16_t stated_length;
    if (text[body] != ' ' || text[body + 1] != '*' || !read_hex(text + body + 2, 2, &stated_length)
        || !read_hex(text + body + 4, 4, crc))
        return LINE_BROKEN;
    if (stated_length != body || *crc != crc16(text, body))
        return LINE_BROKEN;
    text[body] = '\0';
    return LINE_SEALED;
}

uint8_t line_split(char *text, char *words[], uint8_t limit)
{
    uint8_t count = 0;
    for (;;) {
        if (count == limit)
            return (uint8_t)(limit + 1);
        if (*text == ' ' || *text == '\0')
            return 0;
        words[count++] = text;
        while (*text != ' ' && *text != '\0')
            text++;
        if (*text == '\0')
            return count;
        *text++ = '\0';
    }
}

bool line_read_integer(const char *word, int32_t lowest, int32_t highest, int32_t *value)
{
    bool negative = *word == '-';
    if (negative)
        word++;
    uint8_t digits = 0;
    int32_t magnitude = 0;
    for (; *word != '\0'; word++) {
        if (*word < '0' || *word > '9' || ++digits > 9)
            return false;
        magnitude = magnitude * 10 + (*word - '0');
    }
    *value = negative ? -magnitude : magnitude;
    return digits > 0 && *value >= lowest && *value <= highest;
}

void line_clear(struct line *line)
{
    line->length = 0;
}

void line_text(struct line *line, const char *text)
{
    while (*text != '\0')
        put(line, *text++);
}

void line_decimal(struct line *line, uint64_t value)
{
    char digits[20];
    uint8_t count = 0;
    do {
        digits[count++] = (char)('0' + value % 10);
        value /= 10;
    } while (value > 0);
    while (count > 0)
        put(line, digits[--count]);
}

void line_hex(struct line *line, uint32_t value, uint8_t digits)
{
    while (digits > 0)
        put(line, "0123456789ABCDEF"[(value >> (4 * --digits)) & 0xF]);
}

void line_field(struct line *line, const char *key)
{
    put(line, ' ');
    line_text(line, key);
    put(line, '=');
}

void line_seal(struct line *line)
{
    uint8_t body = line->length;
    uint16_t crc = crc16(line->text, body);
    line_text(line, " *");
    line_hex(line, body, 2);
    line_hex(line, crc, 4);
    put(line, '\n');
}

void line_send(const struct line *line)
{
    for (uint8_t i = 0; i < line->length; i++)
        hal_uart_write((uint8_t)line->text[i]);
}

int8_t hex_digit(char character)
{
    if (character >= '0' && character <= '9')
        return (int8_t)(character - '0');
    if (character >= 'A' && character <= 'F')
        return (int8_t)(character - 'A' + 10);
    return -1;
}

static bool read_hex(const char *text, uint8_t digits, uint16_t *value)
{
    *value = 0;
    for (; digits > 0; digits--) {
        int8_t digit = hex_digit(*text++);
        if (digit < 0)
            return false;
        *value = (uint16_t)((uint16_t)(*value << 4) | (uint16_t)digit);
    }
    return true;
}

static void put(struct line *line, char character)
{
    if (line->length < LINE_SIZE)
        line->text[line->length++] = character;
}
