/* The firmware as a program: the wire protocol on a pty, the side channel on stdin and stdout. */
#include "entropy.h"
#include "pty.h"
#include "rig.h"
#include "side_channel.h"

#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define COMMAND_SIZE 128
#define ANSWER_SIZE 512

static void serve_host(int pty);
static bool serve_side_channel(void);
static bool answer_lines(char *pending, size_t *length);
static void flush(int pty);

int main(void)
{
    char path[64];
    int pty = pty_open(path, sizeof path);
    rig_power_up(entropy());
    printf("pty %s\n", path);
    fflush(stdout);

    struct pollfd inputs[] = {{.fd = pty, .events = POLLIN},
                              {.fd = STDIN_FILENO, .events = POLLIN}};
    while (poll(inputs, 2, -1) >= 0) {
        if (inputs[0].revents & POLLIN)
            serve_host(pty);
        if (inputs[1].revents && !serve_side_channel())
            return 0;
        flush(pty);
    }
    perror("turnlight-native: poll");
    return 1;
}

static void serve_host(int pty)
{
    uint8_t bytes[256];
    ssize_t count = read(pty, bytes, sizeof bytes);
    for (ssize_t i = 0; i < count; i++)
        rig_host_byte(bytes[i]);
}

/* False at the end of the input, or at `quit`: the program never outlives who started it. */
static bool serve_side_channel(void)
{
    static char pending[COMMAND_SIZE];
    static size_t length;
    ssize_t count = read(STDIN_FILENO, pending + length, sizeof pending - length);
    if (count <= 0)
        return false;
    length += (size_t)count;
    return answer_lines(pending, &length) && length < sizeof pending;
}

static bool answer_lines(char *pending, size_t *length)
{
    char *end;
    while ((end = memchr(pending, '\n', *length)) != NULL) {
        *end = '\0';
        if (strcmp(pending, "quit") == 0)
            return false;
        char answer[ANSWER_SIZE];
        side_channel_answer(pending, answer, sizeof answer);
        fputs(answer, stdout);
        fflush(stdout);
        *length -= (size_t)(end + 1 - pending);
        memmove(pending, end + 1, *length);
    }
    return true;
}

static void flush(int pty)
{
    char text[512];
    size_t count;
    while ((count = rig_take_output(text, sizeof text)) > 0)
        pty_write(pty, text, count);
}
