#include "fmi2_block.h"

/* Volatile, or compilers would take for constants what is overwritten in the finished binary; so it is copied byte by
 * byte. */
static const volatile SpringBlock fmu_block = {
    .magic = "strandspringfmu",
    .size = sizeof(SpringBlock),
    .version = 4,
#include "spring_values.h"
};

static void copy(void *to, const volatile void *from, size_t size)
{
    for (size_t i = 0; i < size; i++)
        ((unsigned char *)to)[i] = ((const volatile unsigned char *)from)[i];
}

Guid fmu_guid(void)
{
    Guid guid;
    copy(&guid, &fmu_block.guid, sizeof guid);
    return guid;
}

Settings fmu_start_settings(void)
{
    Settings settings;
    copy(&settings, &fmu_block.settings, sizeof settings);
    return settings;
}

const void *fmu_identity(void)
{
    return (const void *)&fmu_block;
}
