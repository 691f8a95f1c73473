#include "crc.h"

/* Eight bits at once: the polynomial's three terms are far enough apart. */
uint16_t crc16_add(uint16_t crc, uint8_t byte)
{
    uint8_t high = (uint8_t)((crc >> 8) ^ byte);
    high = (uint8_t)(high ^ (high >> 4));
    uint16_t wide = high;
    return (uint16_t)((crc << 8) ^ (wide << 12) ^ (wide << 5) ^ wide);
}

uint16_t crc16(const char *text, uint8_t length)
{
    uint16_t crc = CRC_SEED;
    for (uint8_t i = 0; i < length; i++)
        crc = crc16_add(crc, (uint8_t)text[i]);
    return crc;
}
