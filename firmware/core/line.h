/* Lines of the wire protocol: checking one that came, writing one that goes.
 *
 * A sealed line is `<body> *<length><crc>`: two hex digits for the body's length in bytes, four
 * for its CRC. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "flash.h"

#define BODY_SIZE 159 /* the longest that is sent; lines that come are shorter */

struct line {
    uint8_t length;
    uint8_t started; /* bytes of it that are sent already */
    char body[BODY_SIZE];
};

enum line_kind {
    LINE_SEALED, /* the seal was right */
    LINE_TYPED,  /* a bare verb, as a person types it */
    LINE_BROKEN,
};

/* Classifies `length` characters at `text`. Of a sealed line the seal is cut off: `text` then
 * holds the body as a C string, and *crc its CRC. Needs room for one character past the end. */
enum line_kind line_open(char *text, uint8_t length, uint16_t *crc);

/* Splits a body at single spaces, in place. Returns how many words there are; limit + 1 if more
 * than `limit`, 0 if one is empty. */
uint8_t line_split(char *text, char *words[], uint8_t limit);

/* Reads a decimal integer; false if it is none, or is outside [lowest, highest]. */
bool line_read_integer(const char *word, int32_t lowest, int32_t highest, int32_t *value);
bool line_same_word(const char *word, const FLASH char *other);
int8_t hex_digit(char character); /* 0 to 15, or -1; only capitals */

void line_clear(struct line *line);
void line_text(struct line *line, const char *text);
void line_word(struct line *line, const FLASH char *word);
void line_integer(struct line *line, int32_t value);
void line_decimal(struct line *line, uint32_t value);
void line_long_decimal(struct line *line, uint64_t value); /* below 2^32 times 10^9 */
void line_hex(struct line *line, uint32_t value, uint8_t digits);
void line_field(struct line *line, const char *key); /* " key=", the value comes next */
void line_start(struct line *line); /* sends the first bytes of a line whose rest is yet to come */
void line_send(struct line *line);  /* all of it, or what was not started, with its seal and a newline */
