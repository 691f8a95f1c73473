#include "receive.h"

#include "safety.h"
#include "session.h"

#include <stdbool.h>

#define RING_SIZE 64 /* a power of two */
#define LINE_LIMIT 63

static struct {
    volatile uint8_t head;
    volatile uint8_t tail;
    uint8_t ring[RING_SIZE];
    uint8_t length;
    bool overlong;
    char text[LINE_LIMIT + 1];
} rx;

static void take(char character);

void receive_init(void)
{
    rx.head = rx.tail = rx.length = 0;
    rx.overlong = false;
}

void receive_byte(uint8_t byte)
{
    if (byte == STOP_BYTE) {
        safety_latch(REASON_STOP);
        return;
    }
    uint8_t next = (uint8_t)((rx.head + 1) % RING_SIZE);
    if (next == rx.tail)
        return; /* the seal will tell */
    rx.ring[rx.head] = byte;
    rx.head = next;
}

void receive_poll(void)
{
    while (rx.tail != rx.head) {
        char character = (char)rx.ring[rx.tail];
        rx.tail = (uint8_t)((rx.tail + 1) % RING_SIZE);
        take(character);
    }
}

static void take(char character)
{
    if (character != '\n' && character != '\r') {
        if (rx.length < LINE_LIMIT)
            rx.text[rx.length++] = character;
        else
            rx.overlong = true;
        return;
    }
    if (rx.overlong)
        session_refuse(REASON_LONG);
    else if (rx.length > 0)
        session_line(rx.text, rx.length);
    rx.length = 0;
    rx.overlong = false;
}
