// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static FILE *file;

void trace_open(const char *path)
{
    file = fopen(path, "w");
    if (file == NULL) {
        perror(path);
        exit(1);
    }
}

void trace(uint64_t cycle, const char *what, uint32_t value)
{
    if (file != NULL)
        fprintf(file, "%" PRIu64 " %s %" PRIu32 "\n", cycle, what, value);
}

void trace_flush(void)
{
    if (file != NULL)
        fflush(file);
}
