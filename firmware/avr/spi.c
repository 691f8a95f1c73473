#include "spi.h"

#include "hal.h"

#include <avr/io.h>

/* 4 MHz: the LEDs take more, a metre of wire does not. */
void spi_init(void)
{
    SPCR = _BV(SPE) | _BV(MSTR);
}

void hal_spi_write(uint8_t byte)
{
    SPDR = byte;
    while (!(SPSR & _BV(SPIF)))
        ;
}
