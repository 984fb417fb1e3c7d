#include "pairs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NAMED3(name, modes) #name,
const char *const call3_names[CALL3_COUNT] = {FMI3_CALLS(NAMED3)};
#undef NAMED3

int is_legal(const Pair *pair, Call3 call)
{
#define MODES(name, modes) modes,
    static const char *const table[CALL3_COUNT] = {FMI3_CALLS(MODES)};
#undef MODES
    static const int exchange[] = {
        [INSTANTIATED] = 0, [INITIALIZATION] = 1, [EVENT] = 2, [CONTINUOUS_TIME] = 3, [TERMINATED] = 4};
    static const int simulation[] = {[INSTANTIATED] = 6, [INITIALIZATION] = 7, [STEP] = 8, [TERMINATED] = 9};
    return table[call][(pair->exchange ? exchange : simulation)[pair->mode]] != '-';
}

/* The elements of a variable, by their references in FMI 2.0. */
static unsigned elements_of(fmi3ValueReference reference, unsigned *count)
{
    static const unsigned arrays[] = {MODEL_ELASTIC, MODEL_KNOTS, MODEL_KNOTS, MODEL_AMPLIFIER};
    unsigned first = 0, place = 0;
    for (; place + 1 < FIRST_ARRAY3; place++, first++)
        if (place == reference)
            return *count = 1, first;
    for (int i = 0; i < 4; i++) {
        if (arrays[i] > 0 && place++ == reference)
            return *count = arrays[i], first;
        first += arrays[i];
    }
    return *count = 1, first + (reference - place);
}

char kind_of(unsigned element)
{
    if (element >= MODEL_VARIABLES)
        return element == TIME ? 't' : 'e';
    return described[element].type == 'B' ? 'B' : described[element].causality;
}

List some_variables(const char *kinds)
{
    enum { MOST = 200 };
    fmi3ValueReference references[MOST];
    unsigned elements[MOST * 25];
    List list = {.count = count_of_elements()};
    list.count = list.count > MOST ? MOST : list.count;
    for (size_t i = 0; i < list.count; i++) {
        unsigned first, count;
        do
            first = elements_of((references[i] = 1 + (fmi3ValueReference)below(REFERENCES)) - 1, &count);
        while (strchr(kinds, kind_of(first)) == NULL);
        for (unsigned k = 0; k < count; k++)
            elements[list.size++] = first + k;
    }
    list.references = exactly(references, list.count * sizeof *references);
    list.elements = exactly(elements, list.size * sizeof *elements);
    list.values = allocated(list.size * sizeof *list.values);
    for (size_t i = 0; i < list.size; i++)
        list.values[i] = NAN;
    return list;
}

static double usual_value(unsigned element)
{
    const char *name = described[element].name;
    /* Never so small that a step of co-simulation takes long. */
    if (strcmp(name, "step") == 0)
        return MODEL_LARGEST_STEP * pow(10.0, uniform(-2.0, 0.2));
    if (careless())
        return awkward();
    if (element == 0)
        return usual_displacement();
    if (kind_of(element) != 'p')
        return uniform(-1.0, 1.0) * (!OF_SYSTEM ? 1.0 : strncmp(name, "load_", 5) == 0 ? 1e3 : 1e2);
    double start = described[element].start;
    int is_fixed =
        strcmp(name, "kA_0") == 0 || strncmp(name, "FE_knots", 8) == 0 || strncmp(name, "displacement_", 13) == 0;
    if (chance(50) || is_fixed)
        return start;
    if (start == 0.0)
        return uniform(-1.0, 1.0);
    return start * (chance(80) ? uniform(0.9, 1.1) : pow(10.0, uniform(-1.9, 1.9)));
}

void fill_usually(List *list)
{
    for (size_t i = 0; i < list->size; i++)
        list->values[i] = usual_value(list->elements[i]);
}

void free_list(List *list)
{
    free(list->references);
    free(list->elements);
    free(list->values);
}

int holds(const List *list, unsigned element)
{
    for (size_t i = 0; i < list->size; i++)
        if (list->elements[i] == element)
            return 1;
    return 0;
}
