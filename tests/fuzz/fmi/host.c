#include "fuzz.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

Messages messages;
long blocks, tables;
int starving;

static const void *expected_environment;
static const char *expected_name;

void host_listen(const void *environment, const char *name)
{
    messages = (Messages){0, 0, 0};
    expected_environment = environment;
    expected_name = name;
}

/* A message is a sentence in plain ASCII, whatever the host has put into it. */
static void check_text(const char *text)
{
    size_t length = strlen(text);
    CHECK(length > 10, "the message `%s` says nothing", text);
    CHECK(strstr(text, "failed in Python") == NULL, "an exception reaches the host: %s", text);
    for (size_t i = 0; i < length; i++)
        CHECK(text[i] >= ' ' && text[i] <= '~', "the message `%s` holds the byte %d", text, (unsigned char)text[i]);
}

static void log_message(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                        fmi2String format, ...)
{
    char text[8192];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    trace("    says: %s", text);
    check_text(text);
    CHECK(environment == expected_environment, "a message goes to the environment of another instance");
    CHECK(name != NULL && (expected_name == NULL || strcmp(name, expected_name) == 0),
          "a message comes from an instance of another name");
    switch (status) {
    case fmi2Warning: messages.warnings++; break;
    case fmi2Discard: messages.discards++; break;
    case fmi2Error: messages.errors++; break;
    default: FAIL("a message has the status %d", (int)status);
    }
    CHECK(strcmp(category, status == fmi2Warning ? "logStatusWarning" : "logStatusError") == 0,
          "a message of status %d has the category %s", (int)status, category);
}

/* Before each block stands this; malloc aligns what follows it, too. */
typedef union {
    struct {
        uint64_t mark;
        long *counter;
    } known;
    max_align_t alignment;
} Header;

static const uint64_t GIVEN = 0x676976656e2e2e2eu;
/* More than an instance or a state takes, and less than a table. */
static const size_t SMALL = 50000;

static void *counted_allocate(size_t count, size_t size)
{
    if (starving) {
        statistics.starved++;
        return NULL;
    }
    Header *header = calloc(1, sizeof *header + count * size);
    CHECK(header != NULL, "the test has no memory");
    header->known.mark = GIVEN;
    /* The laws of changed parameters are small, and the only ones that are asked for by two. */
    header->known.counter = count == 1 && size < SMALL ? &blocks : &tables;
    ++*header->known.counter;
    return header + 1;
}

static void counted_free(void *block)
{
    if (block == NULL)
        return;
    Header *header = (Header *)block - 1;
    CHECK(header->known.mark == GIVEN, "memory is returned that was not given");
    header->known.mark = 0;
    --*header->known.counter;
    free(header);
}

/* What the FMU takes from the C library: tables, states, and all memory for hosts that give no functions. */
void *library_calloc(size_t count, size_t size)
{
    return counted_allocate(count, size);
}

void library_free(void *block)
{
    counted_free(block);
}

fmi2CallbackFunctions host_callbacks(void *environment, int logging, int counting)
{
    return (fmi2CallbackFunctions){logging ? log_message : NULL, counting ? counted_allocate : NULL,
                                   counting ? counted_free : NULL, NULL, environment};
}

void *allocated(size_t size)
{
    void *memory = malloc(size);
    CHECK(memory != NULL || size == 0, "the test has no memory");
    return memory;
}

void *exactly(const void *content, size_t size)
{
    if (size == 0)
        return NULL;
    return memcpy(allocated(size), content, size);
}
