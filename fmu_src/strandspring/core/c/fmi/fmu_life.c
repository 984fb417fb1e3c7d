#include "fmu_life.h"

#include "fmu_bytes.h"

#include <stdlib.h>
#include <string.h>

void *fmu_new_instance(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory, size_t size)
{
    Guid own = fmu_guid();
    if (name == NULL || name[0] == '\0')
        return FMU_REFUSE_POINTER(log, "The name of an instance must not be empty.");
    if (guid == NULL || strcmp(guid, own.text) != 0)
        return FMU_REFUSE_POINTER(log, "The %s must be %s, got %s.", guid_name, own.text,
                                  guid == NULL ? "none" : fmu_printable(guid).text);
    const size_t name_size = strlen(name) + 1, whole = size + name_size;
    char *made = memory->allocate == NULL ? calloc(1, whole) : memory->allocate(1, whole);
    if (made == NULL)
        return FMU_REFUSE_POINTER(log, "There is not enough memory for an instance.");
    memset(made, 0, size);
    memcpy(made + size, name, name_size);
    log->instance_name = made + size;
    return made;
}

void fmu_free_instance(void *instance, const Memory *memory)
{
    (memory->free == NULL ? free : memory->free)(instance);
}
