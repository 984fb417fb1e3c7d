/* The calls of FMI 2.0 about states of the FMU. */
#include "fmi2_arguments.h"

#include <stdlib.h>

/* A state that the host holds. Its memory is the C library's: the host of the instance that made it, with its functions for
 * memory, may be gone when another instance frees it. */
typedef struct {
    const void *of; /* the FMU that made it */
    State state;
} Snapshot;

/* A state given by the host must be one of this FMU. */
#define REQUIRE_SNAPSHOT(instance, call, snapshot) \
    do { \
        FMU_REQUIRE_ARRAY(instance, call, snapshot, 1); \
        if ((snapshot)->of != fmu_identity()) \
            return FMU_REFUSE(&(instance)->log, \
                              "The state given to fmi2%s must come from an instance of the same FMU.", #call); \
    } while (0)

static Snapshot *new_snapshot(const Instance *instance)
{
    Snapshot *snapshot = calloc(1, sizeof *snapshot);
    if (snapshot == NULL)
        return FMU_REFUSE_POINTER(&instance->log, "There is not enough memory for a state.");
    snapshot->of = fmu_identity();
    return snapshot;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, GetFMUstate);
    FMU_REQUIRE_ARRAY(instance, GetFMUstate, FMUstate, 1);
    Snapshot *snapshot = *FMUstate;
    if (snapshot != NULL)
        REQUIRE_SNAPSHOT(instance, GetFMUstate, snapshot);
    else if ((snapshot = new_snapshot(instance)) == NULL)
        return fmi2Error;
    snapshot->state = instance->state;
    *FMUstate = snapshot;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    const Snapshot *snapshot = FMUstate;
    FMU_REQUIRE(c, SetFMUstate);
    REQUIRE_SNAPSHOT(instance, SetFMUstate, snapshot);
    int kind = instance->state.mode & MODEL_EXCHANGE ? MODEL_EXCHANGE : CO_SIMULATION;
    if (!(snapshot->state.mode & kind))
        return FMU_REFUSE(&instance->log, "The state must be one of %s, but it is one of %s.",
                          kind == MODEL_EXCHANGE ? "model exchange" : "co-simulation",
                          kind == MODEL_EXCHANGE ? "co-simulation" : "model exchange");
    fmu_restore(instance, &snapshot->state);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, FreeFMUstate);
    if (FMUstate == NULL || *FMUstate == NULL)
        return fmi2OK;
    Snapshot *snapshot = *FMUstate;
    REQUIRE_SNAPSHOT(instance, FreeFMUstate, snapshot);
    snapshot->of = NULL;
    free(snapshot);
    *FMUstate = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    const Snapshot *snapshot = FMUstate;
    FMU_REQUIRE(c, SerializedFMUstateSize);
    REQUIRE_SNAPSHOT(instance, SerializedFMUstateSize, snapshot);
    FMU_REQUIRE_ARRAY(instance, SerializedFMUstateSize, size, 1);
    *size = fmu_state_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    const Snapshot *snapshot = FMUstate;
    FMU_REQUIRE(c, SerializeFMUstate);
    REQUIRE_SNAPSHOT(instance, SerializeFMUstate, snapshot);
    FMU_REQUIRE_ARRAY(instance, SerializeFMUstate, serializedState, 1);
    if (size != fmu_state_size())
        return FMU_REFUSE(&instance->log, "A serialized state must have %.0f bytes, got %.0f.",
                          (double)fmu_state_size(), (double)size);
    fmu_state_write(&snapshot->state, (unsigned char *)serializedState);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(
    fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate)
{
    State state;
    char problem[256];
    FMU_REQUIRE(c, DeSerializeFMUstate);
    FMU_REQUIRE_ARRAY(instance, DeSerializeFMUstate, serializedState, 1);
    FMU_REQUIRE_ARRAY(instance, DeSerializeFMUstate, FMUstate, 1);
    Snapshot *snapshot = *FMUstate;
    if (snapshot != NULL)
        REQUIRE_SNAPSHOT(instance, DeSerializeFMUstate, snapshot);
    if (fmu_state_read(&state, (const unsigned char *)serializedState, size, problem, sizeof problem))
        return FMU_REFUSE(&instance->log, "%s", problem);
    if (snapshot == NULL && (snapshot = new_snapshot(instance)) == NULL)
        return fmi2Error;
    snapshot->state = state;
    *FMUstate = snapshot;
    return fmi2OK;
}
