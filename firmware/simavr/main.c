// SPDX-License-Identifier: GPL-3.0-or-later
/* turnlight-simavr-<board> ELF [TRACE [paced]]: the native program's pty and side channel
 * (SIDE_CHANNEL.md), with the real chip behind them. TRACE is a file, or "" for none; `paced` answers
 * no sooner than the wall's clock allows. */
#include "chip.h"
#include "pace.h"
#include "rig_chip.h"
#include "trace.h"

#include <stdio.h>

int serve(void); /* native/main.c's main() */

int main(int argc, char *argv[])
{
    if (argc < 2 || argc > 4) {
        fprintf(stderr, "usage: %s ELF [TRACE [paced]]\n", argv[0]);
        return 2;
    }
    if (argc > 2 && *argv[2] != '\0')
        trace_open(argv[2]);
    if (argc > 3)
        pace_enable();
    rig_open(argv[1]);
    return serve();
}
