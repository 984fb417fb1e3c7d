#include "fmu_block.h"

/* Volatile, or compilers would take for constants what is overwritten in the finished binary; so it is copied byte by
 * byte. */
static const volatile SpringBlock fmu_block = {
    .magic = "strandspringfmu",
    .size = sizeof(SpringBlock),
    .version = 5,
#include "spring_values.h"
};

Guid fmu_guid(void)
{
    Guid guid;
    fmu_copy_block(&guid, &fmu_block.guid, sizeof guid);
    return guid;
}

Settings fmu_start_settings(void)
{
    Settings settings;
    fmu_copy_block(&settings, &fmu_block.settings, sizeof settings);
    return settings;
}

const void *fmu_identity(void)
{
    return (const void *)&fmu_block;
}
