/* The host's serial line: UART 0 at 250,000 baud, 8N1. */
#pragma once

void serial_init(void);
