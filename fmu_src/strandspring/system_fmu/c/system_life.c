#include "system_life.h"

Instance *system_instantiate(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory)
{
    Instance *instance = fmu_new_instance(log, name, guid, guid_name, memory, system_instance_size());
    if (instance == NULL)
        return NULL;
    instance->log = *log;
    instance->memory = *memory;
    if (!system_make(instance)) {
        (void)FMU_REFUSE(log, "There is not enough memory for the tables of the springs.");
        system_release(instance);
        fmu_free_instance(instance, memory);
        return NULL;
    }
    fmu_begin(instance, CS_INSTANTIATED);
    return instance;
}

void system_free(Instance *instance)
{
    if (instance == NULL)
        return;
    system_release(instance);
    Memory memory = instance->memory;
    fmu_free_instance(instance, &memory);
}
