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

/* A call with the variables given and the arguments that follow them. */
#define REFUSE_TYPE(call, type, ...) \
    fmi3Status fmi3##call( \
        fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences, __VA_ARGS__) \
    { \
        REQUIRE_INSTANCE(c); \
        return fmi3_refuse_type(instance, "fmi3" #call, valueReferences, nValueReferences, type); \
    }

#define EXCHANGE_NONE(type) \
    REFUSE_TYPE(Get##type, #type, fmi3##type values[], size_t nValues) \
    REFUSE_TYPE(Set##type, #type, const fmi3##type values[], size_t nValues)

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

REFUSE_TYPE(GetBinary, "Binary", size_t valueSizes[], fmi3Binary values[], size_t nValues)
REFUSE_TYPE(SetBinary, "Binary", const size_t valueSizes[], const fmi3Binary values[], size_t nValues)

REFUSE_TYPE(GetClock, "Clock", fmi3Clock values[])
REFUSE_TYPE(SetClock, "Clock", const fmi3Clock values[])
REFUSE_TYPE(GetShiftDecimal, "Clock", fmi3Float64 shifts[])
REFUSE_TYPE(SetShiftDecimal, "Clock", const fmi3Float64 shifts[])
REFUSE_TYPE(GetIntervalDecimal, "Clock", fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
REFUSE_TYPE(SetIntervalDecimal, "Clock", const fmi3Float64 intervals[])
REFUSE_TYPE(GetShiftFraction, "Clock", fmi3UInt64 counters[], fmi3UInt64 resolutions[])
REFUSE_TYPE(SetShiftFraction, "Clock", const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
REFUSE_TYPE(
    GetIntervalFraction, "Clock", fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
REFUSE_TYPE(SetIntervalFraction, "Clock", const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])

#define REFUSE(call, parameters, reason) \
    fmi3Status fmi3##call parameters \
    { \
        REQUIRE_INSTANCE(c); \
        return FMU_REFUSE(&instance->log, "fmi3" #call " must not be called: %s.", reason); \
    }

static const char WITHOUT_ELEMENTS[] = "dependencies are those of the model description, the same for all elements";

REFUSE(EnterConfigurationMode, (fmi3Instance c), "there are no structural parameters")
REFUSE(ExitConfigurationMode, (fmi3Instance c), "there are no structural parameters")
REFUSE(EnterStepMode, (fmi3Instance c), "co-simulation has no event mode, and is in step mode once initialized")
REFUSE(ActivateModelPartition, (fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time), "there are no clocks")
REFUSE(GetNumberOfVariableDependencies, (fmi3Instance c, fmi3ValueReference variable, size_t *nDependencies),
       WITHOUT_ELEMENTS)
REFUSE(GetVariableDependencies,
       (fmi3Instance c, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
        fmi3ValueReference independents[], size_t elementIndicesOfIndependents[], fmi3DependencyKind dependencyKinds[],
        size_t nDependencies),
       WITHOUT_ELEMENTS)
