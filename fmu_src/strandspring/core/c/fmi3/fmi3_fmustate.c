/* The calls of FMI 3.0 about states of the FMU. */
#include "fmi3_arguments.h"
#include "../fmi/fmu_snapshots.h"

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *FMUState)
{
    FMU_REQUIRE(c, GetFMUState);
    return fmu_take_snapshot(instance, "fmi3GetFMUState", FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState FMUState)
{
    FMU_REQUIRE(c, SetFMUState);
    return fmu_return_to_snapshot(instance, "fmi3SetFMUState", FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *FMUState)
{
    FMU_REQUIRE(c, FreeFMUState);
    return fmu_free_snapshot(instance, "fmi3FreeFMUState", FMUState);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState FMUState, size_t *size)
{
    FMU_REQUIRE(c, SerializedFMUStateSize);
    return fmu_size_of_snapshot(instance, "fmi3SerializedFMUStateSize", FMUState, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    FMU_REQUIRE(c, SerializeFMUState);
    return fmu_write_snapshot(instance, "fmi3SerializeFMUState", FMUState, serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(
    fmi3Instance c, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState)
{
    FMU_REQUIRE(c, DeserializeFMUState);
    return fmu_read_snapshot(instance, "fmi3DeserializeFMUState", serializedState, size, FMUState);
}
