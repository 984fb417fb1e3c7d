/* Calls that the FMU of a spring and that of a system answer alike in both versions of FMI, whose names come from the
 * header of the version (fmi2_states.h or fmi3_states.h). */
#include "fmu_snapshots.h"

const char *FMI(GetVersion)(void)
{
    return FMI(Version);
}

void FMI(FreeInstance)(FmiInstance c)
{
    fmu_free(c);
}

static FmuStatus enter(Instance *instance, int modes)
{
    instance->state.mode = fmu_of_kind(instance->state.mode, modes);
    return FMU_OK;
}

static FmuStatus reset(Instance *instance)
{
    fmu_begin(instance, fmu_of_kind(instance->state.mode, INSTANTIATED));
    return FMU_OK;
}

/* Sets all of these variables, or none. */
static inline FmuStatus change_all(
    Instance *instance, const unsigned references[], size_t count, const double values[])
{
    for (size_t i = 0; i < count; i++)
        if (fmu_require_change(instance, references[i], values[i]) != FMU_OK)
            return FMU_ERROR;
    fmu_open_changes(instance);
    for (size_t i = 0; i < count; i++)
        fmu_change(instance, references[i], values[i]);
    return fmu_apply_changes(instance);
}

FMU_CALL(ExitInitializationMode, (FmiInstance c), fmu_end_initialization(instance))
/* Some hosts, PathSim among them, at their end terminate whatever they have, also what never began or has ended. */
FMU_CALL(
    Terminate, (FmiInstance c), instance->state.mode & INITIALIZED ? enter(instance, TERMINATED) : FMU_OK)
FMU_CALL(Reset, (FmiInstance c), reset(instance))
