/* The LEDs' clock and data lines. */
#pragma once

void spi_init(void);
