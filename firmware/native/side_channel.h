/* The side channel of SIDE_CHANNEL.md: what the optics' simulation sees and does. */
#pragma once

#include <stddef.h>

/* Runs one command line and writes the answer, newline included, into `answer`. */
void side_channel_answer(const char *command, char *answer, size_t limit);
