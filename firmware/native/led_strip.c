#include "led_strip.h"

void led_strip_clock(struct led_strip *strip, uint8_t byte)
{
    if (strip->byte == 0) {
        if (byte == 0) {
            if (++strip->zeros == 4) {
                strip->zeros = 0;
                strip->led = 1;
            }
            return;
        }
        strip->zeros = 0;
        if (byte < 0xE0 || strip->led == 0 || strip->led > LED_COUNT)
            return;
        strip->byte = 1;
        return;
    }
    strip->levels[strip->led - 1] = byte;
    if (++strip->byte == 4) {
        strip->byte = 0;
        strip->led++;
    }
}
