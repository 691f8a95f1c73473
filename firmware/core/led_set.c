#include "led_set.h"

#include <string.h>

#define DIGITS ((LED_COUNT + 3) / 4)

bool led_set_has(const struct led_set *set, uint8_t led)
{
    return (set->bits[led / 8] >> (led % 8)) & 1;
}

void led_set_add(struct led_set *set, uint8_t led)
{
    set->bits[led / 8] = (uint8_t)(set->bits[led / 8] | (1 << (led % 8)));
}

void led_set_remove(struct led_set *set, uint8_t led)
{
    set->bits[led / 8] = (uint8_t)(set->bits[led / 8] & ~(1 << (led % 8)));
}

bool led_set_empty(const struct led_set *set)
{
    for (uint8_t i = 0; i < sizeof set->bits; i++)
        if (set->bits[i] != 0)
            return false;
    return true;
}

bool led_set_read(struct led_set *set, const char *word)
{
    memset(set, 0, sizeof *set);
    size_t digits = strlen(word);
    if (digits > DIGITS)
        return false;
    for (uint8_t place = 0; place < digits; place++) {
        int8_t digit = hex_digit(word[digits - 1 - place]);
        if (digit < 0)
            return false;
        for (uint8_t bit = 0; bit < 4; bit++) {
            uint8_t led = (uint8_t)(4 * place + bit);
            if (!((digit >> bit) & 1))
                continue;
            if (led >= LED_COUNT)
                return false;
            led_set_add(set, led);
        }
    }
    return true;
}

void led_set_write(const struct led_set *set, struct line *line)
{
    for (uint8_t place = DIGITS; place-- > 0;)
        line_hex(line, (uint32_t)(set->bits[place / 2] >> (place % 2 * 4)) & 0xF, 1);
}
