#define _GNU_SOURCE /* cfmakeraw, ptsname_r */
#include "pty.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

static void fail(const char *what);

/* The slave side stays open here too: without it a host that comes and goes would end the pty. */
int pty_open(char *path, size_t limit)
{
    int master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (master < 0 || grantpt(master) < 0 || unlockpt(master) < 0
        || ptsname_r(master, path, limit) != 0)
        fail("open a pty");
    int slave = open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    struct termios settings;
    if (slave < 0 || tcgetattr(slave, &settings) < 0)
        fail("open the pty's other side");
    cfmakeraw(&settings);
    if (tcsetattr(slave, TCSANOW, &settings) < 0)
        fail("make the pty raw");
    return master;
}

void pty_write(int pty, const char *text, size_t length)
{
    while (length > 0) {
        ssize_t written = write(pty, text, length);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return;
        text += written;
        length -= (size_t)written;
    }
}

static void fail(const char *what)
{
    fprintf(stderr, "turnlight-native: cannot ");
    perror(what);
    exit(1);
}
