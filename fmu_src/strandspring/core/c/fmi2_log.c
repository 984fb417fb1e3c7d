#include "fmi2_log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const struct {
    const char *name;
    int categories;
} CATEGORIES[] = {
    {"logAll", LOG_ALL},
    {"logStatusWarning", LOG_WARNINGS},
    {"logStatusError", LOG_ERRORS},
};

int fmu_log_category(const char *name)
{
    for (size_t i = 0; i < sizeof CATEGORIES / sizeof *CATEGORIES; i++)
        if (strcmp(name, CATEGORIES[i].name) == 0)
            return CATEGORIES[i].categories;
    return 0;
}

static void send(const Log *log, fmi2Status status, int category, const char *format, va_list arguments)
{
    char text[512];
    if (log->logger == NULL || !(log->categories & category))
        return;
    vsnprintf(text, sizeof text, format, arguments);
    /* The logger takes a format, which text that holds a value of the host must not be. */
    log->logger(log->environment, log->instance_name, status,
                category == LOG_WARNINGS ? "logStatusWarning" : "logStatusError", "%s", text);
}

fmi2Status fmu_refuse(const Log *log, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    send(log, fmi2Error, LOG_ERRORS, format, arguments);
    va_end(arguments);
    return fmi2Error;
}

fmi2Status fmu_discard(const Log *log, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    send(log, fmi2Discard, LOG_ERRORS, format, arguments);
    va_end(arguments);
    return fmi2Discard;
}

void fmu_warn(const Log *log, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    send(log, fmi2Warning, LOG_WARNINGS, format, arguments);
    va_end(arguments);
}

ShortText fmu_printable(const char *text)
{
    ShortText copy;
    size_t length = 0;
    while (text[length] != '\0' && length < sizeof copy.text - 1) {
        char c = text[length];
        /* FMI takes # as the mark of a value reference. */
        copy.text[length++] = c >= ' ' && c <= '~' && c != '#' ? c : '?';
    }
    copy.text[length] = '\0';
    return copy;
}
