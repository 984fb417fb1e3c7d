/* Lists of variables, by references of both versions. */
#include "fuzz.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The elements of a variable, by their references in FMI 2.0. */
static unsigned elements_of(unsigned place, unsigned *count)
{
    static const unsigned arrays[] = {MODEL_ELASTIC, MODEL_KNOTS, MODEL_KNOTS, MODEL_AMPLIFIER};
    unsigned at = FIRST_ARRAY3 - 1, first = at;
    for (int i = 0; i < 4 && place >= at; i++) {
        if (arrays[i] > 0 && at++ == place)
            return *count = arrays[i], first;
        first += arrays[i];
    }
    return *count = 1, place < at ? place : first + (place - at);
}

fmi3ValueReference reference3(const char *name)
{
    unsigned count, element = variable(name);
    for (unsigned place = 0; place < PLACES; place++)
        if (elements_of(place, &count) == element)
            return place + 1;
    FAIL("FMI 3.0 has no variable %s", name);
}

static int fits(unsigned place, char type, const char *causalities)
{
    unsigned count, first = elements_of(place, &count);
    return described[first].type == type && strchr(causalities, described[first].causality) != NULL;
}

List drawn(char type, const char *causalities)
{
    enum { MOST = 200 };
    static const unsigned strange2[] = {MODEL_VARIABLES, MODEL_VARIABLES + 1, INT_MAX, UINT_MAX, 1u << 31};
    static const unsigned strange3[] = {INDICATOR3 + 1, INDICATOR3 + 30, INT_MAX, UINT_MAX, 0};
    unsigned two[MOST * 32], three[MOST];
    int exists = 0;
    for (unsigned place = 0; place < PLACES; place++)
        exists |= fits(place, type, causalities);
    List list = {.count = !exists && chance(80) ? 0 : count_of_elements(), .sound = 1};
    for (size_t i = 0; i < list.count; i++) {
        int wrong = careless() || !exists, number = below(5);
        unsigned place = (unsigned)below(PLACES), count;
        while (!wrong && !fits(place, type, careless() ? READABLE : causalities))
            place = (unsigned)below(PLACES);
        unsigned first = elements_of(place, &count);
        int absent = wrong && chance(30);
        list.sound = list.sound && !absent && described[first].type == type;
        three[i] = absent ? strange3[number] : place + 1;
        for (unsigned k = 0; k < (absent ? 1 : count); k++)
            two[list.size++] = absent ? strange2[number] : first + k;
        trace("    [%zu] %u", i, two[list.size - 1]);
    }
    int none = list.count > 0 && careless() && chance(20);
    list.three = none ? NULL : exactly(three, list.count * sizeof *three);
    list.two = none ? NULL : exactly(two, list.size * sizeof *two);
    list.values2 = type != 'R' ? NULL : elements(list.size, sizeof *list.values2);
    list.values3 = list.values2 == NULL ? NULL : memset(allocated(list.size * 8), 0x5a, list.size * 8);
    list.sound = list.sound && !none && (type != 'R' || list.size == 0 || list.values2 != NULL);
    return list;
}

void must_be_sound(Trial *trial, const List *list)
{
    must(trial, list->sound ? YES : NO);
    trial->words = trial->words && list->sound;
}

void fill(List *list)
{
    for (size_t i = 0; list->values2 != NULL && i < list->size; i++) {
        list->values2[i] = list->values3[i] = usual_value(list->two == NULL ? MODEL_VARIABLES : list->two[i]);
        trace("    value %.17g", list->values2[i]);
    }
}

void free_list(List *list)
{
    free(list->three);
    free(list->two);
    free(list->values2);
    free(list->values3);
}

int all_have(const List *list, const char *causalities)
{
    for (size_t i = 0; list->sound && i < list->size; i++)
        if (strchr(causalities, described[list->two[i]].causality) == NULL)
            return 0;
    return 1;
}

int holds(const List *list, const char *name)
{
    for (size_t i = 0; list->sound && i < list->size; i++)
        if (strcmp(described[list->two[i]].name, name) == 0)
            return 1;
    return 0;
}

void *elements(size_t count, size_t size)
{
    if (count == 0 || (careless() && chance(20)))
        return NULL;
    return memset(allocated(count * size), 0x5a, count * size);
}

void check_equal(const double *three, const double *two, size_t count, const char *of)
{
    for (size_t i = 0; i < count; i++)
        CHECK(memcmp(&three[i], &two[i], sizeof *two) == 0, "value %zu of %s is %.17g in FMI 3.0 and %.17g in FMI 2.0",
              i, of, three[i], two[i]);
    statistics.compared += (long)count;
}
