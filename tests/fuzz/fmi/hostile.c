/* Calls of FMI 3.0 alone that must be refused in every mode: an error, one message, and no byte of the state changed. */
#include "fuzz.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

long hostile;

/* Types that no variable has, and what this FMU does not do at all. */
static fmi3Status of_others(fmi3Instance c, fmi3ValueReference one)
{
    const fmi3ValueReference *references = &one;
    double number[2] = {0.0};
    uint64_t integer[2] = {0};
    size_t sizes[2] = {1, 1}, count = 1;
    const void *pointers[2] = {integer, NULL};
    fmi3IntervalQualifier qualifier;
    fmi3DependencyKind kind;
#define TYPE(number, type) \
    case number: return fmi3Get##type(c, references, count, (void *)integer, count); \
    case number + 1: return fmi3Set##type(c, references, count, (const void *)pointers, count);
    switch (below(36)) {
    TYPE(0, Float32) TYPE(2, Int8) TYPE(4, UInt8) TYPE(6, Int16) TYPE(8, UInt16) TYPE(10, Int32)
    TYPE(12, UInt32) TYPE(14, Int64) TYPE(16, UInt64) TYPE(18, String)
    case 20: return fmi3GetBinary(c, references, count, sizes, (fmi3Binary *)(void *)pointers, count);
    case 21: return fmi3SetBinary(c, references, count, sizes, (const fmi3Binary *)(void *)pointers, count);
    case 22: return fmi3GetClock(c, references, count, (fmi3Clock *)(void *)integer);
    case 23: return fmi3SetClock(c, references, count, (fmi3Clock *)(void *)integer);
    case 24: return fmi3GetIntervalDecimal(c, references, count, number, &qualifier);
    case 25: return fmi3SetIntervalDecimal(c, references, count, number);
    case 26: return fmi3GetIntervalFraction(c, references, count, integer, integer, &qualifier);
    case 27: return fmi3SetIntervalFraction(c, references, count, integer, integer);
    case 28: return fmi3GetShiftDecimal(c, references, count, number);
    case 29: return fmi3SetShiftDecimal(c, references, count, number);
    case 30: return fmi3GetShiftFraction(c, references, count, integer, integer);
    case 31: return fmi3SetShiftFraction(c, references, count, integer, integer);
    case 32: return chance(50) ? fmi3EnterConfigurationMode(c) : fmi3ExitConfigurationMode(c);
    case 33: return chance(50) ? fmi3EnterStepMode(c) : fmi3ActivateModelPartition(c, one, awkward());
    case 34: return fmi3GetNumberOfVariableDependencies(c, one, chance(50) ? NULL : sizes);
    default: return fmi3GetVariableDependencies(c, one, sizes, &one, sizes, &kind, 1);
    }
}

/* Sound references, but numbers of values that do not fit them, or places for results that are missing. */
static fmi3Status of_sizes(fmi3Instance c, const List *list)
{
    const size_t wrong = (size_t[]){list->size + 1, list->size - 1, SIZE_MAX, list->size + 1000}[below(4)];
    const fmi3ValueReference input = 1, force = 2, calculated = TIME3;
    double numbers[64] = {1.0}, *values = list->values3;
    fmi3Boolean flags[5], *places[5] = {&flags[0], &flags[1], &flags[2], &flags[3], &flags[4]};
    int which = below(5);
    switch (below(8)) {
    case 0: return fmi3GetFloat64(c, list->three, list->count, values, wrong);
    case 1: return fmi3SetFloat64(c, list->three, list->count, values, wrong);
    case 2: return fmi3SetFloat64(c, &calculated, 1, numbers, 1);
    case 3: return fmi3GetDirectionalDerivative(c, &force, 1, &input, 1, numbers, below(2) ? 2 : 0, numbers, 1);
    case 4: return fmi3GetAdjointDerivative(c, &force, 1, &input, 1, numbers, 1, numbers, below(2) ? 2 : 0);
    case 5: return fmi3GetAdjointDerivative(c, &input, 1, &force, 1, numbers, 1, numbers, 1);
    case 6:
        places[which] = NULL;
        return fmi3UpdateDiscreteStates(c, places[0], places[1], places[2], places[3], places[4], numbers);
    default:
        places[which % 3] = NULL;
        return fmi3DoStep(c, 0.0, 0.1, 1, places[0], places[1], places[2], which > 2 ? NULL : numbers);
    }
}

void be_hostile(Pair *pair)
{
    int without = chance(5), logger = pair->logger && !without;
    fmi3Instance c = without ? NULL : pair->three;
    fmi3ValueReference one = chance(80) ? 1 + (fmi3ValueReference)below(PLACES) : (fmi3ValueReference)random_bits();
    unsigned char *before = exactly(pair->bytes, state_size);
    long blocks_before = blocks;
    int loans_before = loans;
    List list = drawn('R', "ip");
    listen(pair, pair->name);
    fmi3Status status = list.sound && list.count > 0 && chance(50) ? of_sizes(c, &list) : of_others(c, one);
    CHECK(status == fmi3Error, "a call is answered by the status %d where it must be refused", (int)status);
    CHECK(said[1].errors == logger && said[1].warnings == 0, "a refused call gives %d messages", said[1].errors);
    CHECK(blocks == blocks_before, "a refused call keeps or loses %ld blocks of memory", blocks - blocks_before);
    look(pair);
    CHECK(memcmp(before, pair->bytes, state_size) == 0, "the state has changed though a call is refused");
    free(before);
    take_back(loans_before);
    hostile++;
}
