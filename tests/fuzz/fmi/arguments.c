#include "fuzz.h"

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static fmi2ValueReference any_of(char type, const char *causalities)
{
    fmi2ValueReference reference;
    do
        reference = (fmi2ValueReference)below(MODEL_VARIABLES);
    while (described[reference].type != type || strchr(causalities, described[reference].causality) == NULL);
    return reference;
}

static int exists(char type)
{
    for (int i = 0; i < MODEL_VARIABLES; i++)
        if (described[i].type == type)
            return 1;
    return 0;
}

References references(char type, const char *causalities)
{
    static const fmi2ValueReference strange[] = {MODEL_VARIABLES, MODEL_VARIABLES + 1, INT_MAX, UINT_MAX, 1u << 31};
    References made = {.count = !exists(type) && chance(80) ? 0 : count_of_elements(), .sound = 1};
    fmi2ValueReference *list = allocated(made.count * sizeof *list);
    for (size_t i = 0; i < made.count; i++) {
        if (!exists(type) || careless())
            list[i] = chance(30) ? strange[below(5)] : (fmi2ValueReference)below(MODEL_VARIABLES);
        else
            list[i] = any_of(type, careless() ? READABLE : causalities);
        made.sound = made.sound && list[i] < MODEL_VARIABLES && described[list[i]].type == type;
        trace("    [%zu] %u", i, list[i]);
    }
    made.at = exactly(list, made.count * sizeof *list);
    free(list);
    if (careless() && chance(20)) {
        free(made.at);
        made.at = NULL;
    }
    return made;
}

void *elements(size_t count, size_t size)
{
    if (count == 0 || (careless() && chance(20)))
        return NULL;
    return memset(allocated(count * size), 0x5a, count * size);
}

void must_be_given(Trial *trial, const void *array, size_t count)
{
    must(trial, count == 0 || array != NULL ? YES : NO);
}

void must_be_references(Trial *trial, const References *of)
{
    must_be_given(trial, of->at, of->count);
    must(trial, of->sound ? YES : NO);
}

int all_have(const References *of, const char *causalities)
{
    for (size_t i = 0; of->at != NULL && of->sound && i < of->count; i++)
        if (strchr(causalities, described[of->at[i]].causality) == NULL)
            return 0;
    return 1;
}

double usual_displacement(void)
{
    double low = described[variable("displacement_min")].start, high = described[variable("displacement_max")].start;
    return low + (high - low) * (chance(90) ? uniform(0.0, 1.0) : uniform(-1.0, 2.0));
}

double largest_given(fmi2ValueReference reference)
{
    char causality = described[reference].causality;
    return causality == 'p' ? DBL_MAX : causality == 'i' ? 1e9 : 1e100;
}

/* As far as a spring or its motion can go, where nothing may overflow. */
static double extreme_value(fmi2ValueReference reference)
{
    double low = described[variable("displacement_min")].start, high = described[variable("displacement_max")].start;
    double offset = described[variable("displacement_offset")].start, width = high - low;
    double reach = 1.01 * fmax(high - offset, offset - low), sign = chance(50) ? 1.0 : -1.0;
    const char *name = described[reference].name;
    if (described[reference].causality != 'p')
        return sign * largest_given(reference);
    if (strcmp(name, "rho") == 0)
        return sign > 0.0 ? 0.99e12 / width : 1.01e-9 / width;
    if (strcmp(name, "kappa_omega") == 0)
        return sign > 0.0 ? 1e15 : 1e-15;
    if (strcmp(name, "sigma") == 0)
        return sign > 0.0 ? 1000.0 : 0.5;
    if (strcmp(name, "n") == 0)
        return sign > 0.0 ? 100.0 : 0.01;
    if (strcmp(name, "input_resolution") == 0)
        return sign > 0.0 ? 1e9 : 5e-324;
    if (strncmp(name, "FE_forces", 9) == 0)
        return sign * 1e15;
    if (strncmp(name, "kE_", 3) == 0)
        return sign * 0.99e15 / pow(reach, atoi(name + 3));
    return strncmp(name, "kA_", 3) == 0 && atoi(name + 3) > 0 ? sign * 0.99e9 / pow(reach, atoi(name + 3))
                                                              : described[reference].start;
}

static double usual_value(fmi2ValueReference reference)
{
    if (careless())
        return awkward();
    if (chance(2))
        return extreme_value(reference);
    if (reference == (fmi2ValueReference)variable("displacement"))
        return usual_displacement();
    if (described[reference].causality != 'p')
        return uniform(-1.0, 1.0);
    double start = described[reference].start;
    const char *name = described[reference].name;
    /* Other values would hardly ever be possible: knots go from one end of the range to the other. */
    int fixed = strcmp(name, "kA_0") == 0 || strncmp(name, "FE_knots", 8) == 0 ||
                (MODEL_KNOTS && strncmp(name, "displacement_m", 14) == 0);
    if (chance(50) || fixed)
        return start;
    if (strcmp(name, "input_resolution") == 0)
        return described[variable("displacement_max")].start * pow(10.0, uniform(-4.0, 0.0));
    if (start == 0.0)
        return chance(20) ? copysign(1.0, uniform(-1.0, 1.0)) : uniform(-1.0, 1.0);
    return start * (chance(80) ? uniform(0.9, 1.1) : pow(10.0, uniform(-1.9, 1.9)));
}

double *usual_values(const References *of)
{
    double *values = elements(of->count, sizeof *values);
    for (size_t i = 0; values != NULL && i < of->count; i++)
        values[i] = of->at != NULL && of->at[i] < MODEL_VARIABLES ? usual_value(of->at[i]) : awkward();
    return values;
}

int any_is(const References *of, const char *name)
{
    for (size_t i = 0; of->at != NULL && i < of->count; i++)
        if (of->at[i] == (fmi2ValueReference)variable(name))
            return 1;
    return 0;
}
