/* The verbs. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "line.h"

/* Runs words[0] with the words after it, a NULL behind the last, and adds the outcome to the reply,
 * which holds the sequence number. `typed`: the line had no seal, so only verbs that are safe to
 * mishear are done. */
void command_run(char *words[], uint8_t count, bool typed, struct line *reply);
