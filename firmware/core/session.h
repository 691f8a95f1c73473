/* One command in flight: a command that comes again is answered again, and not done again. */
#pragma once

#include <stdint.h>

#include "reason.h"

void session_init(void);
void session_line(char *text, uint8_t length); /* writes one past the end */
void session_refuse(enum reason reason);       /* answers a line that cannot be read */

uint32_t session_commands(void);     /* done since boot, replays not counted */
uint32_t session_broken_lines(void); /* since boot */
