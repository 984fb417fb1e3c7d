/* The calls of FMI 2.0 about states of the FMU. */
#include "fmi2_arguments.h"
#include "../fmi/fmu_snapshots.h"

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, GetFMUstate);
    return fmu_take_snapshot(instance, "fmi2GetFMUstate", FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate)
{
    FMU_REQUIRE(c, SetFMUstate);
    return fmu_return_to_snapshot(instance, "fmi2SetFMUstate", FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, FreeFMUstate);
    return fmu_free_snapshot(instance, "fmi2FreeFMUstate", FMUstate);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size)
{
    FMU_REQUIRE(c, SerializedFMUstateSize);
    return fmu_size_of_snapshot(instance, "fmi2SerializedFMUstateSize", FMUstate, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size)
{
    FMU_REQUIRE(c, SerializeFMUstate);
    return fmu_write_snapshot(instance, "fmi2SerializeFMUstate", FMUstate, (unsigned char *)serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(
    fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate)
{
    FMU_REQUIRE(c, DeSerializeFMUstate);
    return fmu_read_snapshot(
        instance, "fmi2DeSerializeFMUstate", (const unsigned char *)serializedState, size, FMUstate);
}
