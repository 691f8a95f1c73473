/* CRC-16/CCITT-FALSE: polynomial 0x1021, seed 0xFFFF, "123456789" gives 0x29B1. */
#pragma once

#include <stdint.h>

#define CRC_SEED 0xFFFF

uint16_t crc16_add(uint16_t crc, uint8_t byte);
uint16_t crc16(const char *text, uint8_t length);
