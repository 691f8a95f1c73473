/* The operator's button, debounced: a press is an event. */
#pragma once

void button_init(void);
void button_tick(void); /* every millisecond */
