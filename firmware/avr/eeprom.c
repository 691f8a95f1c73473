/* The core's parameters, in the first bytes of the EEPROM. */
#include "hal.h"

#include <avr/eeprom.h>

uint8_t hal_eeprom_read(uint8_t address)
{
    return eeprom_read_byte((const uint8_t *)(uint16_t)address);
}

void hal_eeprom_write(uint8_t address, uint8_t value)
{
    hal_watchdog_feed();
    eeprom_update_byte((uint8_t *)(uint16_t)address, value);
    eeprom_busy_wait();
}
