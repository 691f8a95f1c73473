/* What a port calls. core_init() first, with interrupts off; then the rest, from where hal.h says. */
#pragma once

#include <stdint.h>

void core_init(void);
void core_receive(uint8_t byte);
uint16_t core_step(void); /* the next step's interval in us, 0: no more steps */
void core_tick(void);     /* every millisecond */
void core_poll(void);     /* as often as there is time, and after every received byte */
