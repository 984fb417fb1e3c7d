#include "fmu_log.h"

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

static int category_of(const char *name)
{
    for (size_t i = 0; i < sizeof CATEGORIES / sizeof *CATEGORIES; i++)
        if (strcmp(name, CATEGORIES[i].name) == 0)
            return CATEGORIES[i].categories;
    return 0;
}

FmuStatus fmu_report(const Log *log, FmuStatus status, const char *format, ...)
{
    char text[LONGEST_MESSAGE];
    int category = status == FMU_WARNING ? LOG_WARNINGS : LOG_ERRORS;
    if (log->write == NULL || !(log->categories & category))
        return status;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    log->write(log, status, category == LOG_WARNINGS ? "logStatusWarning" : "logStatusError", text);
    return status;
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

FmuStatus fmu_find_categories(const Log *log, size_t count, const char *const names[], int *found)
{
    int chosen = count == 0 ? LOG_ALL : 0;
    for (size_t i = 0; i < count; i++) {
        int category = names[i] == NULL ? 0 : category_of(names[i]);
        if (category == 0)
            return FMU_REFUSE(log, "A log category must be logAll, logStatusWarning or logStatusError, got %s.",
                              names[i] == NULL ? "NULL" : fmu_printable(names[i]).text);
        chosen |= category;
    }
    *found = chosen;
    return FMU_OK;
}
