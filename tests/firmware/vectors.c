/* The vectors that the host's tests read too. */
#include "bench.h"

#include "crc.h"
#include "line.h"

static void check_vector(char *kind, char *first, char *second);
static void check_line(const char *body, const char *sealed);
static void check_damaged(const char *damaged);

void test_vectors(const char *path)
{
    FILE *file = fopen(path, "r");
    CHECK(file != NULL);
    char row[512];
    int count = 0;
    while (fgets(row, sizeof row, file) != NULL) {
        row[strcspn(row, "\n")] = '\0';
        if (row[0] == '#' || row[0] == '\0')
            continue;
        char *first = strchr(row, '|');
        CHECK(first != NULL);
        *first++ = '\0';
        char *second = strchr(first, '|');
        if (second != NULL)
            *second++ = '\0';
        check_vector(row, first, second);
        count++;
    }
    fclose(file);
    CHECK(count > 50);
}

static void check_vector(char *kind, char *first, char *second)
{
    if (strcmp(kind, "crc") == 0) {
        CHECK(strtoul(first, NULL, 16) == crc16(second, (uint8_t)strlen(second)));
    } else if (strcmp(kind, "line") == 0) {
        check_line(first, second);
    } else if (strcmp(kind, "damaged") == 0) {
        check_damaged(first);
    } else {
        bool anew = strcmp(kind, "exchange") == 0;
        CHECK(anew || strcmp(kind, "then") == 0);
        if (anew)
            bench_boot();
        CHECK_TEXT(bench_say(first), second);
    }
}

static void check_line(const char *body, const char *sealed)
{
    struct line line;
    line_clear(&line);
    line_text(&line, body);
    bench_boot();
    line_send(&line);
    char sent[256];
    size_t length = rig_take_output(sent, sizeof sent);
    CHECK(length == strlen(sealed) + 1 && sent[length - 1] == '\n');
    CHECK(memcmp(sent, sealed, length - 1) == 0);

    uint16_t crc;
    CHECK(line_open(sent, (uint8_t)(length - 1), &crc) == LINE_SEALED);
    CHECK_TEXT(sent, body);
    CHECK(crc == crc16(body, (uint8_t)strlen(body)));
}

static void check_damaged(const char *damaged)
{
    char text[256];
    uint16_t crc;
    snprintf(text, sizeof text, "%s", damaged);
    CHECK(line_open(text, (uint8_t)strlen(damaged), &crc) == LINE_BROKEN);
}
