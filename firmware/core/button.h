/* The operator's button, debounced: a short press is an event, a long one means stop. */
#pragma once

void button_init(void);
void button_tick(void); /* every millisecond */
