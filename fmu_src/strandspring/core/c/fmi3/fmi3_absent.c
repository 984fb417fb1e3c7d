/* Calls of FMI 3.0 about what this FMU does not have: other types, clocks, structural parameters, dependencies of
 * elements. */
#include "fmi3_arguments.h"

/* Declares `instance`, which may be in any mode. */
#define REQUIRE_INSTANCE(c) \
    const Instance *instance = (c); \
    do { \
        if (instance == NULL) \
            return fmi3Error; \
    } while (0)

#define REFUSE_TYPE(call, type) \
    do { \
        REQUIRE_INSTANCE(c); \
        return fmi3_refuse_type(instance, "fmi3" #call, valueReferences, nValueReferences, type); \
    } while (0)

#define EXCHANGE_NONE(type) \
    fmi3Status fmi3Get##type(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                             fmi3##type values[], size_t nValues) \
    { \
        (void)values; \
        (void)nValues; \
        REFUSE_TYPE(Get##type, #type); \
    } \
    fmi3Status fmi3Set##type(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                             const fmi3##type values[], size_t nValues) \
    { \
        (void)values; \
        (void)nValues; \
        REFUSE_TYPE(Set##type, #type); \
    }

EXCHANGE_NONE(Float32)
EXCHANGE_NONE(Int8)
EXCHANGE_NONE(UInt8)
EXCHANGE_NONE(Int16)
EXCHANGE_NONE(UInt16)
EXCHANGE_NONE(Int32)
EXCHANGE_NONE(UInt32)
EXCHANGE_NONE(Int64)
EXCHANGE_NONE(UInt64)
EXCHANGE_NONE(String)

/* The remaining arguments are of no use. */
#define REFUSE_BINARY(call, Sizes, Values) \
    fmi3Status fmi3##call(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                          Sizes valueSizes[], Values values[], size_t nValues) \
    { \
        (void)valueSizes; \
        (void)values; \
        (void)nValues; \
        REFUSE_TYPE(call, "Binary"); \
    }

REFUSE_BINARY(GetBinary, size_t, fmi3Binary)
REFUSE_BINARY(SetBinary, const size_t, const fmi3Binary)

#define REFUSE_CLOCK(call, First) \
    fmi3Status fmi3##call( \
        fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, First first[]) \
    { \
        (void)first; \
        REFUSE_TYPE(call, "Clock"); \
    }
#define REFUSE_CLOCK_2(call, First, Second) \
    fmi3Status fmi3##call(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                          First first[], Second second[]) \
    { \
        (void)first; \
        (void)second; \
        REFUSE_TYPE(call, "Clock"); \
    }

REFUSE_CLOCK(GetClock, fmi3Clock)
REFUSE_CLOCK(SetClock, const fmi3Clock)
REFUSE_CLOCK(GetShiftDecimal, fmi3Float64)
REFUSE_CLOCK(SetShiftDecimal, const fmi3Float64)
REFUSE_CLOCK(SetIntervalDecimal, const fmi3Float64)
REFUSE_CLOCK_2(GetIntervalDecimal, fmi3Float64, fmi3IntervalQualifier)
REFUSE_CLOCK_2(GetShiftFraction, fmi3UInt64, fmi3UInt64)
REFUSE_CLOCK_2(SetShiftFraction, const fmi3UInt64, const fmi3UInt64)
REFUSE_CLOCK_2(SetIntervalFraction, const fmi3UInt64, const fmi3UInt64)

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                   fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
{
    (void)counters;
    (void)resolutions;
    (void)qualifiers;
    REFUSE_TYPE(GetIntervalFraction, "Clock");
}

#define REFUSE(call, parameters, reason) \
    fmi3Status fmi3##call parameters \
    { \
        REQUIRE_INSTANCE(c); \
        return FMU_REFUSE(&instance->log, "fmi3" #call " must not be called: %s.", reason); \
    }

REFUSE(EnterConfigurationMode, (fmi3Instance c), "there are no structural parameters")
REFUSE(ExitConfigurationMode, (fmi3Instance c), "there are no structural parameters")
REFUSE(EnterStepMode, (fmi3Instance c), "co-simulation has no event mode, and is in step mode once initialized")

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clockReference, fmi3Float64 activationTime)
{
    (void)clockReference;
    (void)activationTime;
    REQUIRE_INSTANCE(c);
    return FMU_REFUSE(&instance->log, "fmi3ActivateModelPartition must not be called: there are no clocks.");
}

static const char WITHOUT_ELEMENTS[] = "dependencies are those of the model description, the same for all elements";

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference valueReference, size_t *nDependencies)
{
    (void)valueReference;
    (void)nDependencies;
    REQUIRE_INSTANCE(c);
    return FMU_REFUSE(
        &instance->log, "fmi3GetNumberOfVariableDependencies must not be called: %s.", WITHOUT_ELEMENTS);
}

fmi3Status fmi3GetVariableDependencies(
    fmi3Instance c, fmi3ValueReference dependent, size_t elementIndicesOfDependent[], fmi3ValueReference independents[],
    size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[], size_t nDependencies)
{
    (void)dependent;
    (void)elementIndicesOfDependent;
    (void)independents;
    (void)elementIndicesOfIndependents;
    (void)dependencyKinds;
    (void)nDependencies;
    REQUIRE_INSTANCE(c);
    return FMU_REFUSE(&instance->log, "fmi3GetVariableDependencies must not be called: %s.", WITHOUT_ELEMENTS);
}
