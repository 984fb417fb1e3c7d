/* Calls of FMI 3.0 alone that must be refused in every mode: an error, one message, and no byte of the state changed. */
#include "fuzz.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static long blocks_before;
static const char *expected_name; /* that the next message must hold */

static void refused(Pair *pair, const char *call, fmi3Status status)
{
    unsigned char *before = exactly(pair->bytes, state_size);
    trace("    hostile %s: status %d", call, (int)status);
    statistics.hostile++;
    CHECK(status == fmi3Error, "%s returns %d where it must be refused (mode %d)", call, (int)status,
          (int)pair->twin.mode);
    CHECK(said[1].errors == pair->logger && said[1].discards + said[1].warnings == 0, "%s gives %d messages of errors",
          call, said[1].errors);
    int of_mode = strstr(said[1].text, " must be called ") != NULL;
    CHECK(expected_name == NULL || !pair->logger || of_mode || strstr(said[1].text, expected_name) != NULL,
          "%s does not name %s: %s", call, expected_name, said[1].text);
    CHECK(blocks == blocks_before, "%s keeps or loses %ld blocks of memory", call, blocks - blocks_before);
    look(pair);
    CHECK(memcmp(before, pair->bytes, state_size) == 0, "the state has changed though %s is refused", call);
    free(before);
    expected_name = NULL;
    listen(pair, pair->name);
    blocks_before = blocks;
}

#define REFUSED(pair, call, ...) refused((pair), #call, fmi3##call((pair)->three, __VA_ARGS__))

static fmi3ValueReference unknown_reference(void)
{
    static const fmi3ValueReference far[] = {UINT_MAX, 1u << 31, INT_MAX, UINT_MAX - PLACES, 0};
    return chance(50) ? INDICATOR3 + 1 + (fmi3ValueReference)below(30) : far[below(5)];
}

/* Any that is not calculated; an output; the Boolean. */
static fmi3ValueReference of_kind(char type, char causality, const char **name)
{
    unsigned at;
    do
        at = (unsigned)below(MODEL_VARIABLES);
    while (described[at].type != type || described[at].causality != causality);
    *name = described[at].name;
    return reference3(*name);
}

/* Variables that may be read and set, but one thing is wrong. */
static void values(Pair *pair)
{
    List list = drawn('R', "ip");
    if (list.count == 0) {
        free_list(&list);
        return;
    }
    fill(&list);
    fmi3ValueReference *references = list.three, calculated = TIME3, boolean;
    size_t count = list.count, size = list.size, last = count - 1;
    double *numbers = list.values3;
    int sets = below(2), which = below(3);
    const char *output, *flag;
    fmi3ValueReference force = of_kind('R', MODEL_NO_ENERGY ? 'i' : 'o', &output);
    boolean = of_kind('B', described[variable("extrapolating")].causality, &flag);
    switch (below(9)) {
    case 0: references[last] = unknown_reference(); break;
    case 1: size = (size_t[]){size + 1, size - 1, SIZE_MAX, size + 1000}[below(4)]; break;
    case 2: references = NULL; break;
    case 3: numbers = NULL; break;
    case 4:
        references[last] = boolean;
        expected_name = count == size ? "is Boolean" : NULL; /* or an array has gone, and values are too many */
        break;
    case 5: {
        fmi3Boolean *flags = allocated(size);
        refused(pair, "SetBoolean or GetBoolean",
                sets ? fmi3SetBoolean(pair->three, references, count, flags, size)
                     : fmi3GetBoolean(pair->three, references, count, flags, size));
        free(flags);
        free_list(&list);
        return;
    }
    case 6: /* what is calculated */
        sets = 1;
        calculated = which == 0 && !MODEL_NO_ENERGY ? force : which == 1 && INDICATORS ? INDICATOR3 : TIME3;
        expected_name = calculated == force ? output : calculated == TIME3 ? "`time`" : "`reversal_indicator`";
        references = &calculated;
        count = size = 1;
        break;
    case 7: /* what no variable can be */
        sets = 1;
        numbers[size - 1] = (double[]){NAN, INFINITY, -INFINITY}[below(3)];
        break;
    default: count = 0; /* values of no variables */
    }
    if (sets)
        REFUSED(pair, SetFloat64, references, count, numbers, size);
    else
        REFUSED(pair, GetFloat64, references, count, numbers, size);
    free_list(&list);
}

/* Types that no variable has; for no variables there is nothing to refuse. */
static void types(Pair *pair)
{
    size_t count = (size_t)below(3), sizes[2] = {1, 1};
    fmi3ValueReference list[2] = {chance(80) ? 1 + (fmi3ValueReference)below(PLACES) : unknown_reference(), 0};
    const fmi3ValueReference *references = chance(10) ? NULL : list;
    union {
        double number[2];
        fmi3UInt64 integer[2];
        fmi3String text[2];
        fmi3Binary binary[2];
        fmi3Clock clock[2];
    } v, w;
    fmi3IntervalQualifier qualifiers[2];
    fmi3Status status;
    fmi3Instance c = pair->three;
    memset(&v, 0, sizeof v);
    memset(&w, 1, sizeof w);
#define TYPE(number, type) \
    case number: status = fmi3Get##type(c, references, count, (void *)&v, count); break; \
    case number + 1: status = fmi3Set##type(c, references, count, (const void *)&v, count); break;
    switch (below(32)) {
    TYPE(0, Float32) TYPE(2, Int8) TYPE(4, UInt8) TYPE(6, Int16) TYPE(8, UInt16) TYPE(10, Int32)
    TYPE(12, UInt32) TYPE(14, Int64) TYPE(16, UInt64) TYPE(18, String)
    case 20: status = fmi3GetBinary(c, references, count, sizes, v.binary, count); break;
    case 21: status = fmi3SetBinary(c, references, count, sizes, v.binary, count); break;
    case 22: status = fmi3GetClock(c, references, count, v.clock); break;
    case 23: status = fmi3SetClock(c, references, count, v.clock); break;
    case 24: status = fmi3GetIntervalDecimal(c, references, count, v.number, qualifiers); break;
    case 25: status = fmi3SetIntervalDecimal(c, references, count, v.number); break;
    case 26: status = fmi3GetIntervalFraction(c, references, count, v.integer, w.integer, qualifiers); break;
    case 27: status = fmi3SetIntervalFraction(c, references, count, v.integer, w.integer); break;
    case 28: status = fmi3GetShiftDecimal(c, references, count, v.number); break;
    case 29: status = fmi3SetShiftDecimal(c, references, count, v.number); break;
    case 30: status = fmi3GetShiftFraction(c, references, count, v.integer, w.integer); break;
    default: status = fmi3SetShiftFraction(c, references, count, v.integer, w.integer);
    }
    if (count > 0)
        refused(pair, "a call of another type", status);
    else
        CHECK(status == fmi3OK, "nothing is refused");
}

static void absent(Pair *pair)
{
    size_t number = 1;
    fmi3ValueReference independent;
    fmi3DependencyKind kind;
    switch (below(6)) {
    case 0: refused(pair, "EnterConfigurationMode", fmi3EnterConfigurationMode(pair->three)); break;
    case 1: refused(pair, "ExitConfigurationMode", fmi3ExitConfigurationMode(pair->three)); break;
    case 2: refused(pair, "EnterStepMode", fmi3EnterStepMode(pair->three)); break;
    case 3: REFUSED(pair, ActivateModelPartition, unknown_reference(), awkward()); break;
    case 4: REFUSED(pair, GetNumberOfVariableDependencies, 1, chance(50) ? NULL : &number); break;
    default: REFUSED(pair, GetVariableDependencies, 1, &number, &independent, &number, &kind, 1);
    }
}

static void derivatives(Pair *pair)
{
    const char *output, *input;
    fmi3ValueReference unknowns[] = {of_kind('R', 'o', &output), 0}, knowns[] = {of_kind('R', 'i', &input), FIRST_ARRAY3};
    unsigned of_first = MODEL_KNOTS ? MODEL_KNOTS : MODEL_ELASTIC;
    double small[2] = {1.0, 1.0}, large[64];
    size_t height = 2, width = 1 + of_first;
    for (int i = 0; i < 64; i++)
        large[i] = 1.0;
    unknowns[1] = unknowns[0];
    double *of_unknowns = small, *of_knowns = large;
    const fmi3ValueReference *u = unknowns, *k = knowns;
    int adjoint = below(2);
    switch (below(9)) {
    case 0: unknowns[below(2)] = (fmi3ValueReference[]){knowns[0], TIME3, FIRST_ARRAY3, unknown_reference()}[below(4)]; break;
    case 1: knowns[0] = (fmi3ValueReference[]){unknowns[0], TIME3, unknown_reference()}[below(3)]; break;
    case 2: height += (size_t)(chance(50) ? 1 : -1); break;
    case 3: width += (size_t)(chance(50) ? 1 : -1); break;
    case 4: knowns[1] = unknowns[0]; width = 2; break; /* a known that is an output */
    case 5: u = NULL; break;
    case 6: k = NULL; break;
    case 7: *(chance(50) ? &of_unknowns : &of_knowns) = NULL; break;
    default: (adjoint ? of_unknowns : of_knowns)[below(2)] = (double[]){NAN, INFINITY, -INFINITY}[below(3)];
    }
    if (adjoint)
        REFUSED(pair, GetAdjointDerivative, u, 2, k, 2, of_unknowns, height, of_knowns, width);
    else
        REFUSED(pair, GetDirectionalDerivative, u, 2, k, 2, of_knowns, width, of_unknowns, height);
}

static void others(Pair *pair)
{
    fmi3Boolean flags[5];
    fmi3Boolean *given[5] = {&flags[0], &flags[1], &flags[2], &flags[3], &flags[4]};
    const char *names[2];
    fmi3ValueReference output[] = {of_kind('R', 'o', &names[0])}, own[] = {below(2) ? TIME3 : INDICATOR3};
    double time = pair->twin.time, number;
    int which = below(5);
    switch (below(6)) {
    case 0:
        given[which % 3] = NULL;
        REFUSED(pair, DoStep, time, 0.1, 1, given[0], given[1], given[2], &number);
        break;
    case 1: REFUSED(pair, DoStep, time, chance(50) ? NAN : -1.0, 1, given[0], given[1], given[2], &number); break;
    case 2: REFUSED(pair, DoStep, time, 0.1, 1, given[0], given[1], given[2], NULL); break;
    case 3:
        given[which] = NULL;
        REFUSED(pair, UpdateDiscreteStates, given[0], given[1], given[2], given[3], given[4], &number);
        break;
    case 4: REFUSED(pair, GetOutputDerivatives, output, 1, which ? (fmi3Int32[]){2} : NULL, &number, 1); break;
    default: REFUSED(pair, GetOutputDerivatives, own, 1, (fmi3Int32[]){1}, &number, 1);
    }
}

/* Without an instance there is nobody to tell. */
static void no_instance(Pair *pair)
{
    double number = 0.0;
    const fmi3ValueReference first[] = {0};
    fmi3Boolean flag = 0;
    const fmi3Status statuses[] = {
        fmi3GetInt32(NULL, first, 1, NULL, 1), fmi3EnterStepMode(NULL), fmi3GetClock(NULL, first, 1, NULL),
        fmi3GetAdjointDerivative(NULL, first, 1, first, 1, &number, 1, &number, 1),
        fmi3DoStep(NULL, 0.0, 0.1, 1, &flag, &flag, &flag, &number),
    };
    for (size_t i = 0; i < sizeof statuses / sizeof *statuses; i++)
        CHECK(statuses[i] == fmi3Error, "a call without an instance has the status %d", (int)statuses[i]);
    fmi3FreeInstance(NULL);
    fmi2FreeInstance(NULL);
    CHECK(said[1].errors == 0 && pair->three != NULL, "what has no instance gives messages");
}

void be_hostile(Pair *pair)
{
    static void (*const calls[])(Pair *) = {values, values, values, types, absent, derivatives, others, no_instance};
    int before = carelessness;
    carelessness = 0;
    listen(pair, pair->name);
    blocks_before = blocks;
    calls[below(sizeof calls / sizeof *calls)](pair);
    carelessness = before;
}
