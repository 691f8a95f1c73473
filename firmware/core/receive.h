/* Bytes from the host become lines; the stop byte never gets that far. */
#pragma once

#include <stdint.h>

#define STOP_BYTE 0x18 /* Ctrl-X */

void receive_init(void);
void receive_byte(uint8_t byte); /* from the receive interrupt */
void receive_poll(void);         /* hands complete lines to the session */
