#include "fuzz.h"

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
            list[i] = any_of(type, careless() ? "iolp" : causalities);
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

static double usual_value(fmi2ValueReference reference)
{
    if (careless())
        return awkward();
    if (described[reference].causality == 'i')
        return usual_displacement();
    double start = described[reference].start;
    const char *name = described[reference].name;
    /* Other values would hardly ever be possible: knots go from one end of the range to the other. */
    int fixed = strcmp(name, "kA_0") == 0 || strncmp(name, "FE_knots", 8) == 0 ||
                (MODEL_KNOTS && strncmp(name, "displacement_m", 14) == 0);
    if (chance(50) || fixed)
        return start;
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
