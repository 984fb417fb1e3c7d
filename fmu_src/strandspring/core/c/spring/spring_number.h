/* A number as Python's repr writes it, whatever the locale. */
#ifndef SPRING_NUMBER_H
#define SPRING_NUMBER_H

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    char text[40];
} SpringNumber;

static inline SpringNumber spring_number(double value)
{
    SpringNumber number;
    if (isnan(value)) {
        strcpy(number.text, "nan");
        return number;
    }
    double size = fabs(value);
    /* repr writes 1e15, but not 1e16, without an exponent; a denormal number has fewer digits than 15. */
    int least = size < DBL_MIN ? 1 : size >= 1e15 && size < 1e16 ? 16 : 15;
    for (int digits = least; digits <= 17; digits++) {
        snprintf(number.text, sizeof number.text, "%.*g", digits, value);
        if (strtod(number.text, NULL) == value)
            break;
    }
    for (char *c = number.text; *c != '\0'; c++)
        if (*c == ',')
            *c = '.';
    if (strpbrk(number.text, ".en") == NULL)
        memcpy(number.text + strlen(number.text), ".0", sizeof ".0");
    return number;
}

#endif
