/* Messages to the host: one sentence for each call that is refused and for each excursion out of the range. */
#ifndef FMI2_LOG_H
#define FMI2_LOG_H

#include "fmi2_api.h"
#include "spring_local.h"

#include <stddef.h>

/* Categories of the model description. */
enum { LOG_WARNINGS = 1, LOG_ERRORS = 2, LOG_ALL = LOG_WARNINGS | LOG_ERRORS };

/* Where messages go; copied from what the host gave. */
typedef struct {
    fmi2CallbackLogger logger; /* may be NULL */
    fmi2ComponentEnvironment environment;
    fmi2String instance_name;
    int categories;
} Log;

/* What fmi2SetDebugLogging asks for; without names every category. */
SPRING_LOCAL fmi2Status fmu_choose_categories(
    Log *log, fmi2Boolean logging, size_t count, const fmi2String names[]);

/* Log a message, written as by printf, and return its status. */
SPRING_LOCAL fmi2Status fmu_report(const Log *log, fmi2Status status, const char *format, ...);
#define FMU_REFUSE(log, ...) fmu_report((log), fmi2Error, __VA_ARGS__)
/* The same in place of a pointer. */
#define FMU_REFUSE_POINTER(log, ...) (FMU_REFUSE(log, __VA_ARGS__), NULL)

typedef struct {
    char text[64];
} ShortText;

/* Text of the host as it may stand in a message: cut short, and every character but plain ASCII replaced. */
SPRING_LOCAL ShortText fmu_printable(const char *text);

#endif
