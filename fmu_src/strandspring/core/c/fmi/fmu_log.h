/* Messages to the host: one sentence for each call that is refused and for each excursion out of the range. */
#ifndef FMU_LOG_H
#define FMU_LOG_H

#include "../spring/spring_local.h"

#include <stddef.h>

/* What both versions of FMI have, whose values agree: an int, so that it passes for fmi2Status and fmi3Status. */
typedef int FmuStatus;
enum { FMU_OK, FMU_WARNING, FMU_DISCARD, FMU_ERROR };

enum { LONGEST_MESSAGE = 512 }; /* with its end */

/* Categories of the model description. */
enum { LOG_WARNINGS = 1, LOG_ERRORS = 2, LOG_ALL = LOG_WARNINGS | LOG_ERRORS };

/* Where messages go; copied from what the host gave. */
typedef struct Log Log;
struct Log {
    /* Calls `logger`; may be NULL. */
    void (*write)(const Log *log, FmuStatus status, const char *category, const char *text);
    void (*logger)(void); /* of the version of FMI */
    void *environment;
    const char *instance_name;
    int categories;
};

/* The categories of these names; all of them if there are no names. */
SPRING_LOCAL FmuStatus fmu_find_categories(const Log *log, size_t count, const char *const names[], int *found);

/* Log a message, written as by printf, and return its status. */
SPRING_COLD FmuStatus fmu_report(const Log *log, FmuStatus status, const char *format, ...);
#define FMU_REFUSE(log, ...) fmu_report((log), FMU_ERROR, __VA_ARGS__)
/* The same in place of a pointer. */
#define FMU_REFUSE_POINTER(log, ...) (FMU_REFUSE(log, __VA_ARGS__), NULL)

typedef struct {
    char text[64];
} ShortText;

/* Text of the host as it may stand in a message: cut short, and every character but plain ASCII replaced. */
SPRING_LOCAL ShortText fmu_printable(const char *text);

#endif
