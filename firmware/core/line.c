#include "line.h"

#include "crc.h"
#include "hal.h"

#define SEAL_LENGTH 8 /* " *LLCCCC" */

static bool is_hex(const char *text, uint16_t value, uint8_t digits);
static const FLASH uint32_t powers_of_ten[] = {1000000000, 100000000, 10000000, 1000000, 100000,
                                               10000,      1000,      100,      10,      1};

static void put(struct line *line, char character);
static void put_decimal(struct line *line, uint32_t value, uint8_t least_digits);
static void send_hex(uint16_t value, uint8_t digits);
static uint8_t hex_character(uint8_t nibble);

enum line_kind line_open(char *text, uint8_t length, uint16_t *crc)
{
    text[length] = '\0';
    bool bare = true;
    for (uint8_t i = 0; i < length && bare; i++)
        bare = text[i] >= 'a' && text[i] <= 'z';
    if (bare)
        return LINE_TYPED;
    if (length <= SEAL_LENGTH)
        return LINE_BROKEN;

    uint8_t body = (uint8_t)(length - SEAL_LENGTH);
    *crc = crc16(text, body);
    if (text[body] != ' ' || text[body + 1] != '*' || !is_hex(text + body + 2, body, 2)
        || !is_hex(text + body + 4, *crc, 4))
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

bool line_same_word(const char *word, const FLASH char *other)
{
    while (*word != '\0' && *word == *other)
        word++, other++;
    return *word == *other;
}

int8_t hex_digit(char character)
{
    if (character >= '0' && character <= '9')
        return (int8_t)(character - '0');
    if (character >= 'A' && character <= 'F')
        return (int8_t)(character - 'A' + 10);
    return -1;
}

void line_clear(struct line *line)
{
    line->length = line->started = 0;
}

void line_text(struct line *line, const char *text)
{
    while (*text != '\0')
        put(line, *text++);
}

void line_word(struct line *line, const FLASH char *word)
{
    while (*word != '\0')
        put(line, *word++);
}

void line_integer(struct line *line, int32_t value)
{
    if (value < 0)
        put(line, '-');
    line_decimal(line, value < 0 ? 0 - (uint32_t)value : (uint32_t)value);
}

void line_decimal(struct line *line, uint32_t value)
{
    put_decimal(line, value, 1);
}

void line_long_decimal(struct line *line, uint64_t value)
{
    uint32_t high = (uint32_t)(value / powers_of_ten[0]), low = (uint32_t)(value % powers_of_ten[0]);
    if (high > 0)
        put_decimal(line, high, 1);
    put_decimal(line, low, high > 0 ? 9 : 1);
}

void line_hex(struct line *line, uint32_t value, uint8_t digits)
{
    while (digits > 0)
        put(line, (char)hex_character((uint8_t)(value >> (4 * --digits))));
}

void line_field(struct line *line, const char *key)
{
    put(line, ' ');
    line_text(line, key);
    put(line, '=');
}

/* A UART takes two bytes without making anybody wait: one that it sends, one behind it. */
void line_start(struct line *line)
{
    for (; line->started < 2 && line->started < line->length; line->started++)
        hal_uart_write((uint8_t)line->body[line->started]);
}

/* The CRC is computed while the first bytes are already on their way. */
void line_send(struct line *line)
{
    uint16_t crc = CRC_SEED;
    for (uint8_t i = 0; i < line->length; i++) {
        uint8_t byte = (uint8_t)line->body[i];
        if (i >= line->started)
            hal_uart_write(byte);
        crc = crc16_add(crc, byte);
    }
    line->started = 0;
    hal_uart_write(' ');
    hal_uart_write('*');
    send_hex(line->length, 2);
    send_hex(crc, 4);
    hal_uart_write('\n');
}

static void send_hex(uint16_t value, uint8_t digits)
{
    while (digits > 0)
        hal_uart_write(hex_character((uint8_t)(value >> (4 * --digits))));
}

static uint8_t hex_character(uint8_t nibble)
{
    nibble &= 0xF;
    return (uint8_t)(nibble < 10 ? '0' + nibble : 'A' + nibble - 10);
}

static bool is_hex(const char *text, uint16_t value, uint8_t digits)
{
    while (digits > 0)
        if (*text++ != (char)hex_character((uint8_t)(value >> (4 * --digits))))
            return false;
    return true;
}

static void put(struct line *line, char character)
{
    if (line->length < BODY_SIZE)
        line->body[line->length++] = character;
}

/* By subtraction: a small controller divides slowly. Most numbers are short. */
static void put_decimal(struct line *line, uint32_t value, uint8_t least_digits)
{
    bool begun = false;
    uint8_t left = value < 100000 && least_digits <= 5 ? 5 : 10;
    for (const FLASH uint32_t *power = powers_of_ten + 10 - left; left > 0; left--, power++) {
        char digit = '0';
        for (uint32_t one = *power; value >= one; value -= one)
            digit++;
        begun = begun || digit != '0' || left <= least_digits;
        if (begun)
            put(line, digit);
    }
}
