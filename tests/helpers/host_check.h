/* Of hosts in C: what must be, or the host ends with the exit status 1 and names the line. */
#include "fmi2Functions.h"

#include <stdio.h>
#include <stdlib.h>

#define CHECK(condition) \
    do { \
        if (!(condition)) { \
            fprintf(stderr, "line %d: %s\n", __LINE__, #condition); \
            exit(1); \
        } \
    } while (0)
#define OK(call) CHECK((call) == fmi2OK)
