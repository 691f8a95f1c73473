#include "session.h"

#include "commands.h"
#include "line.h"
#include "safety.h"

#include <stdbool.h>
#include <stddef.h>

#define WORD_LIMIT 5

static struct {
    int32_t sequence; /* of the last command, whose answer `reply` keeps; 0 before the first */
    uint16_t crc;
    struct line reply;
    uint32_t commands;
    uint32_t broken_lines;
} session;

static void answer_sealed(char *body, uint16_t crc);
static void answer_typed(char *verb);

void session_init(void)
{
    session.sequence = 0;
    session.commands = session.broken_lines = 0;
}

void session_line(char *text, uint8_t length)
{
    uint16_t crc = 0;
    switch (line_open(text, length, &crc)) {
    case LINE_SEALED:
        answer_sealed(text, crc);
        break;
    case LINE_TYPED:
        answer_typed(text);
        break;
    case LINE_BROKEN:
        session_refuse(REASON_CHECK);
        break;
    }
}

void session_refuse(enum reason reason)
{
    struct line reply;
    line_clear(&reply);
    line_text(&reply, "0 err ");
    line_word(&reply, reason_word(reason));
    line_send(&reply);
    session.broken_lines++;
}

uint32_t session_commands(void)
{
    return session.commands;
}

uint32_t session_broken_lines(void)
{
    return session.broken_lines;
}

static void answer_sealed(char *body, uint16_t crc)
{
    char *words[WORD_LIMIT + 1];
    uint8_t count = line_split(body, words, WORD_LIMIT);
    int32_t sequence;
    if (count < 2 || count > WORD_LIMIT || !line_read_integer(words[0], 1, 65535, &sequence)) {
        session_refuse(REASON_FORM);
        return;
    }
    words[count] = NULL;
    safety_renew_lease();
    if (sequence != session.sequence || crc != session.crc) {
        session.sequence = sequence;
        session.crc = crc;
        session.commands++;
        line_clear(&session.reply);
        line_integer(&session.reply, sequence);
        line_start(&session.reply); /* is on the wire while the command is done */
        command_run(words + 1, (uint8_t)(count - 1), false, &session.reply);
    }
    line_send(&session.reply);
}

/* The kept reply stays as it is: a person at the keyboard must not make the host's retry a new
 * command. */
static void answer_typed(char *verb)
{
    struct line reply;
    char *words[] = {verb, NULL};
    line_clear(&reply);
    line_text(&reply, "0");
    command_run(words, 1, true, &reply);
    line_send(&reply);
}
