/* A test's view of the rig: say a line, hear the answer. */
#pragma once

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rig.h"

#define CHECK(condition)                                                                  \
    do {                                                                                  \
        if (!(condition)) {                                                               \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);               \
            exit(1);                                                                      \
        }                                                                                 \
    } while (0)

#define CHECK_TEXT(actual, expected)                                                      \
    do {                                                                                  \
        const char *is = (actual), *should_be = (expected);                               \
        if (strcmp(is, should_be) != 0) {                                                 \
            fprintf(stderr, "%s:%d: \"%s\" instead of \"%s\"\n", __FILE__, __LINE__, is,  \
                    should_be);                                                           \
            exit(1);                                                                      \
        }                                                                                 \
    } while (0)

void bench_boot(void);

/* Sends the characters, and a newline, as they are. Returns the first line that is not an event,
 * without its newline; "" if there is none. */
const char *bench_say(const char *line);

/* Seals `command` under the next sequence number; returns the reply's body after that number. */
const char *ask(const char *command);

const char *state(void);                           /* the word that stat says */
const char *lit_after(const char *command);        /* the `lit` in the reply, or the whole refusal */

const char *bench_events(void); /* bodies of the events since last asked, each ended by ';' */
long field(const char *reply, const char *key);
void advance_ms(uint64_t ms);
void settle(void); /* until the table rests, the lease renewed */
double angle_deg(void); /* the table's true angle */
int lit_count(void);    /* LEDs that really shine */

void test_vectors(const char *path);
void test_lines(void);
void test_session(void);
void test_motion(void);
void test_light(void);
void test_safety(void);
void test_events(void);
void test_parameters(void);
