#include "crc.h"

/* A byte at a time, and each half of the CRC for itself: a small controller shifts bytes best. */
uint16_t crc16_add(uint16_t crc, uint8_t byte)
{
    uint8_t mixed = (uint8_t)((crc >> 8) ^ byte);
    mixed = (uint8_t)(mixed ^ (mixed >> 4));
    uint8_t upper = (uint8_t)(mixed << 4), lower = (uint8_t)(mixed << 5);
    uint8_t high = (uint8_t)((uint8_t)crc ^ upper ^ (mixed >> 3));
    return (uint16_t)((uint16_t)high << 8 | (uint8_t)(mixed ^ lower));
}

uint16_t crc16(const char *text, uint8_t length)
{
    uint16_t crc = CRC_SEED;
    for (uint8_t i = 0; i < length; i++)
        crc = crc16_add(crc, (uint8_t)text[i]);
    return crc;
}
