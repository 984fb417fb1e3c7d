/* Calls to FMI 3.0 that must be refused in every mode. */
#include "pairs.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define REFUSED(pair, call, ...) refused((pair), #call, fmi3##call((pair)->three, __VA_ARGS__))

/* From the last one on. */
static const char *const LAST_NAMES[] = {INDICATORS ? "`reversal_indicator`" : "`time`", "`time`"};

/* The next one must name this variable, and say `more` of it. */
static void must_name_variable(fmi3ValueReference reference, const char *more)
{
    static char text[100];
    snprintf(text, sizeof text, "`%s`%s", described[reference - 1].name, more);
    must_name(text);
}

static fmi3ValueReference unknown_reference(void)
{
    static const fmi3ValueReference far[] = {UINT_MAX, 1u << 31, INT_MAX, UINT_MAX - REFERENCES, 0};
    return chance(50) ? REFERENCES + 1 + (fmi3ValueReference)below(30) : far[below(5)];
}

/* Variables that may be read and set, but one thing is wrong. */
static void values(Pair *pair)
{
    List list;
    do {
        list = some_variables("ip");
        if (list.count == 0)
            free_list(&list);
    } while (list.count == 0);
    fill_usually(&list);
    fmi3ValueReference *references = list.references;
    size_t count = list.count, size = list.size, last = count - 1;
    double *numbers = list.values;
    fmi3ValueReference calculated = chance(50) ? FORCE3 : (fmi3ValueReference)(REFERENCES - below(1 + INDICATORS));
    int sets = below(2), boolean = 0;
    switch (below(9)) {
    case 0: references[last] = unknown_reference(); break;
    case 1: size = (size_t[]){size + 1, size - 1, SIZE_MAX, size + 1000}[below(4)]; break;
    case 2: references = NULL; break;
    case 3: numbers = NULL; break;
    case 4:
        references[last] = EXTRAPOLATING3;
        must_name_variable(
            EXTRAPOLATING3, OF_SYSTEM ? " (value reference 1) is Boolean" : " (value reference 5) is Boolean");
        break;
    case 5: boolean = 1; break;
    case 6: /* what is calculated */
        sets = 1;
        references = &calculated;
        count = size = 1;
        if (calculated == FORCE3)
            must_name_variable(FORCE3, "");
        else
            must_name(LAST_NAMES[REFERENCES - calculated]);
        break;
    case 7: /* what no variable can be */
        sets = 1;
        numbers[size - 1] = (double[]){NAN, INFINITY, -INFINITY}[below(3)];
        break;
    default: count = 0; /* values of no variables */
    }
    fmi3Boolean *flags = allocated(size < 10000 ? size : 1);
    if (boolean)
        refused(pair, "SetBoolean or GetBoolean",
                sets ? fmi3SetBoolean(pair->three, references, count, flags, size)
                     : fmi3GetBoolean(pair->three, references, count, flags, size));
    else
        refused(pair, "SetFloat64 or GetFloat64",
                sets ? fmi3SetFloat64(pair->three, references, count, numbers, size)
                     : fmi3GetFloat64(pair->three, references, count, numbers, size));
    free(flags);
    free_list(&list);
}

/* Types that no variable has; for no variables there is nothing to refuse. */
static void other_types(Pair *pair)
{
    size_t count = (size_t)below(3), sizes[2] = {1, 1};
    fmi3ValueReference list[2] = {chance(80) ? 1 + (fmi3ValueReference)below(REFERENCES) : unknown_reference(), 0};
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
        refused(pair, "GetOtherType", status);
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
    fmi3ValueReference unknowns[] = {FORCE3, STIFFNESS3}, knowns[] = {DISPLACEMENT3, FIRST_ARRAY3};
    unsigned of_first = MODEL_KNOTS ? MODEL_KNOTS : MODEL_ELASTIC;
    double small[2] = {1.0, 1.0}, large[64];
    size_t rows = 2, columns = 1 + of_first;
    for (int i = 0; i < 64; i++)
        large[i] = 1.0;
    double *of_unknowns = small, *of_knowns = large;
    const fmi3ValueReference *u = unknowns, *k = knowns;
    int adjoint = below(2);
    switch (below(9)) {
    case 0:
        unknowns[below(2)] = (fmi3ValueReference[]){DISPLACEMENT3, EXTRAPOLATING3, FIRST_ARRAY3, REFERENCES,
                                                    unknown_reference()}[below(5)];
        break;
    case 1:
        knowns[0] =
            (fmi3ValueReference[]){FORCE3, EXTRAPOLATING3, STIFFNESS3, REFERENCES, unknown_reference()}[below(5)];
        break;
    case 2: rows += (size_t)(chance(50) ? 1 : -1); break;
    case 3: columns += (size_t)(chance(50) ? 1 : -1); break;
    case 4: knowns[1] = FORCE3; columns = 2; break; /* a known that is an output */
    case 5: u = NULL; break;
    case 6: k = NULL; break;
    case 7: *(chance(50) ? &of_unknowns : &of_knowns) = NULL; break;
    default: (adjoint ? of_unknowns : of_knowns)[below(2)] = (double[]){NAN, INFINITY, -INFINITY}[below(3)];
    }
    if (adjoint)
        REFUSED(pair, GetAdjointDerivative, u, 2, k, 2, of_unknowns, rows, of_knowns, columns);
    else
        REFUSED(pair, GetDirectionalDerivative, u, 2, k, 2, of_knowns, columns, of_unknowns, rows);
}

static void states(Pair *pair)
{
    static double nothing[400];
    size_t size = 0;
    fmi3FMUState junk[] = {nothing, pair->probe2, NULL}, state = junk[below(3)], held = state, empty = NULL;
    fmi3FMUState other_type = state_of_other_type(pair);
    unsigned char *bytes = exactly(pair->bytes, state_size());
    switch (below(10)) {
    case 0: REFUSED(pair, SetFMUState, state); break;
    case 1: REFUSED(pair, SerializedFMUStateSize, state, &size); break;
    case 2: REFUSED(pair, SerializedFMUStateSize, pair->probe3, NULL); break;
    case 3: REFUSED(pair, SerializeFMUState, state, bytes, state_size()); break;
    case 4: REFUSED(pair, SerializeFMUState, pair->probe3, chance(50) ? NULL : bytes, chance(50) ? SIZE_MAX : 0); break;
    case 5: REFUSED(pair, GetFMUState, state == NULL ? NULL : &held); break;
    case 6: REFUSED(pair, DeserializeFMUState, bytes, state_size(), state == NULL ? NULL : &held); break;
    case 7:
        bytes[random_bits() % state_size()] ^= (unsigned char)(1 << below(8));
        REFUSED(pair, DeserializeFMUState, chance(10) ? NULL : bytes, state_size(), &empty);
        break;
    case 8:
        starving = 1;
        REFUSED(pair, GetFMUState, &empty);
        starving = 1;
        REFUSED(pair, DeserializeFMUState, pair->bytes, state_size(), &empty);
        starving = 0;
        break;
    default:
        if (state != NULL)
            REFUSED(pair, FreeFMUState, &held);
        if (other_type != NULL)
            REFUSED(pair, SetFMUState, other_type);
    }
    CHECK(held == state && empty == NULL, "a refused call has changed the pointer to a state");
    free(bytes);
}

static void others(Pair *pair)
{
    fmi3Boolean flags[5];
    fmi3Boolean *given[5] = {&flags[0], &flags[1], &flags[2], &flags[3], &flags[4]};
    double numbers[3] = {0.0, 0.0, 0.0}, number;
    int which = below(5);
    size_t wrong = (size_t)(MODEL_STATES + 2 + below(3)); /* number of states or of event indicators */
    switch (below(10)) {
    case 0:
        given[which % 3] = NULL;
        REFUSED(pair, DoStep, pair->time, 0.1, 1, given[0], given[1], given[2], &number);
        break;
    case 1: REFUSED(pair, DoStep, pair->time, chance(50) ? NAN : -1.0, 1, given[0], given[1], given[2], &number); break;
    case 2: REFUSED(pair, DoStep, pair->time, 0.1, 1, given[0], given[1], given[2], NULL); break;
    case 3:
        given[which] = NULL;
        REFUSED(pair, UpdateDiscreteStates, given[0], given[1], given[2], given[3], given[4], &number);
        break;
    case 4:
        given[which % 2] = NULL;
        REFUSED(pair, CompletedIntegratorStep, 1, given[0], given[1]);
        break;
    case 5: REFUSED(pair, SetTime, (double[]){NAN, INFINITY, -INFINITY}[below(3)]); break;
    case 6:
        REFUSED(pair, GetContinuousStates, numbers, wrong);
        REFUSED(pair, GetContinuousStateDerivatives, numbers, wrong);
        break;
    case 7:
        REFUSED(pair, SetContinuousStates, numbers, wrong);
        REFUSED(pair, GetNominalsOfContinuousStates, numbers, wrong);
        break;
    case 8:
        REFUSED(pair, GetEventIndicators, numbers, wrong);
        REFUSED(pair, GetNumberOfEventIndicators, NULL);
        REFUSED(pair, GetNumberOfContinuousStates, NULL);
        break;
    default:
        REFUSED(pair, GetOutputDerivatives, (fmi3ValueReference[]){FORCE3}, 1, which ? (fmi3Int32[]){2} : NULL, numbers,
                1);
        which = below(1 + INDICATORS);
        must_name(OF_SYSTEM ? NULL : LAST_NAMES[which]);
        REFUSED(pair, GetOutputDerivatives, (fmi3ValueReference[]){(fmi3ValueReference)(REFERENCES - which)}, 1,
                (fmi3Int32[]){1}, numbers, 1);
    }
}

static void logging(Pair *pair)
{
    static const fmi3String unknown[] = {"logall", "", NULL, "logStatusError "};
    fmi3String names[] = {"logAll", chance(50) ? awkward_text() : unknown[below(4)]};
    REFUSED(pair, SetDebugLogging, below(2), 2, chance(10) ? NULL : names);
}

/* Without an instance there is nobody to tell. */
static void no_instance(Pair *pair)
{
    double number = 0.0;
    size_t size = 0;
    fmi3Boolean flag = 0;
    fmi3FMUState state = NULL;
    const fmi3ValueReference first[] = {0};
    const fmi3Status statuses[] = {
        fmi3EnterInitializationMode(NULL, 0, 0.0, 0.0, 0, 0.0), fmi3ExitInitializationMode(NULL), fmi3Terminate(NULL),
        fmi3Reset(NULL), fmi3GetFloat64(NULL, first, 1, &number, 1), fmi3SetFloat64(NULL, first, 1, &number, 1),
        fmi3GetInt32(NULL, first, 1, NULL, 1), fmi3GetBoolean(NULL, first, 1, &flag, 1), fmi3GetFMUState(NULL, &state),
        fmi3SetFMUState(NULL, pair->probe3), fmi3FreeFMUState(NULL, &state),
        fmi3SerializedFMUStateSize(NULL, pair->probe3, &size), fmi3EnterEventMode(NULL), fmi3SetTime(NULL, 0.0),
        fmi3GetEventIndicators(NULL, &number, 1), fmi3SetDebugLogging(NULL, 1, 0, NULL), fmi3EnterStepMode(NULL),
        fmi3GetClock(NULL, first, 1, NULL),
        fmi3GetDirectionalDerivative(NULL, first, 1, first, 1, &number, 1, &number, 1),
        fmi3GetAdjointDerivative(NULL, first, 1, first, 1, &number, 1, &number, 1), fmi3EvaluateDiscreteStates(NULL),
        fmi3DoStep(NULL, 0.0, 0.1, 1, &flag, &flag, &flag, &number),
    };
    for (size_t i = 0; i < sizeof statuses / sizeof *statuses; i++)
        CHECK(statuses[i] == fmi3Error, "a call without an instance has the status %d", (int)statuses[i]);
    fmi3FreeInstance(NULL);
}

/* What an FMU without energy leaves out. */
static void left_out(Pair *pair)
{
    const fmi3ValueReference energy[] = {ENERGY3}, displacement[] = {DISPLACEMENT3};
    double value = 1.0, seed = 1.0;
    if (!MODEL_NO_ENERGY)
        return;
    switch (below(3)) {
    case 0: REFUSED(pair, GetFloat64, energy, 1, &value, 1); break;
    case 1: REFUSED(pair, GetOutputDerivatives, energy, 1, (fmi3Int32[]){1}, &value, 1); break;
    default: REFUSED(pair, GetDirectionalDerivative, energy, 1, displacement, 1, &seed, 1, &value, 1);
    }
}

void be_hostile(Pair *pair)
{
    static void (*const calls[])(Pair *) = {values, values, values, other_types, absent, derivatives, derivatives,
                                            states, states, others, others, logging, no_instance, left_out};
    int before = carelessness;
    carelessness = 0;
    listen(pair);
    calls[below(sizeof calls / sizeof *calls)](pair);
    carelessness = before;
}
