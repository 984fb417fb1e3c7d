/* The Python-backed FMU as the fuzzer takes it: without model exchange, which its binary does not have, and with
 * serialized states of one size: blanks follow what the binary (bridge.c) writes, which JSON allows. */
#include "../fuzz.h"

#include <string.h>

enum { ROOM = 4096 };

/* The binary's, which fuzzing.py renames. */
fmi2SerializedFMUstateSizeTYPE python_SerializedFMUstateSize;
fmi2SerializeFMUstateTYPE python_SerializeFMUstate;

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    fmi2Status status = python_SerializedFMUstateSize(c, state, size);
    if (status == fmi2OK) {
        CHECK(*size < ROOM, "a state has %zu bytes", *size);
        *size = ROOM;
    }
    return status;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    size_t needed = 0;
    if (size != ROOM || bytes == NULL)
        return python_SerializeFMUstate(c, state, bytes, 1);
    fmi2Status status = python_SerializedFMUstateSize(c, state, &needed);
    if (status != fmi2OK)
        return status;
    memset(bytes, ' ', size);
    return python_SerializeFMUstate(c, state, bytes, needed);
}

#define MISSING(call, ...) \
    fmi2Status fmi2##call(__VA_ARGS__) \
    { \
        return fmi2Error; \
    }
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
MISSING(EnterEventMode, fmi2Component c)
MISSING(NewDiscreteStates, fmi2Component c, fmi2EventInfo *information)
MISSING(EnterContinuousTimeMode, fmi2Component c)
MISSING(CompletedIntegratorStep, fmi2Component c, fmi2Boolean no_set, fmi2Boolean *event, fmi2Boolean *end)
MISSING(SetTime, fmi2Component c, fmi2Real time)
MISSING(SetContinuousStates, fmi2Component c, const fmi2Real x[], size_t count)
MISSING(GetDerivatives, fmi2Component c, fmi2Real derivatives[], size_t count)
MISSING(GetEventIndicators, fmi2Component c, fmi2Real indicators[], size_t count)
MISSING(GetContinuousStates, fmi2Component c, fmi2Real x[], size_t count)
MISSING(GetNominalsOfContinuousStates, fmi2Component c, fmi2Real x[], size_t count)
