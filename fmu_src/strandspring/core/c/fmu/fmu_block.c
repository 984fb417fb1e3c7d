/* The block of the binary that holds one spring.
 *
 * A binary is compiled once for all springs. Making an FMU of it means to find this block by its first 24 bytes and to
 * overwrite the rest; fmu/native/block.py does so, and writes the same values into spring_values.h for those who
 * compile the sources.
 */
#include "../fmi/fmu_bytes.h"
#include "fmu_variables.h"

/* Little-endian on every platform, without padding. */
typedef struct {
    char magic[16];
    uint32_t size, version;
    char guid[sizeof(Guid)];
    Settings settings;
    int64_t count;
    SpringVariable variables[MOST_VARIABLES];
} SpringBlock;

/* Volatile, or compilers would take for constants what is overwritten in the finished binary; so it is copied byte by
 * byte. */
static const volatile SpringBlock fmu_block = {
    .magic = "strandspringfmu",
    .size = sizeof(SpringBlock),
    .version = 10,
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

unsigned fmu_variables(void)
{
    return (unsigned)fmu_block.count;
}

SpringVariable fmu_variable(unsigned reference)
{
    SpringVariable variable;
    fmu_copy_block(&variable, &fmu_block.variables[reference], sizeof variable);
    return variable;
}

SpringKind fmu_kind(unsigned reference)
{
    return (SpringKind)fmu_block.variables[reference].kind;
}

VariableCausality fmu_causality(unsigned reference)
{
    return (VariableCausality)fmu_block.variables[reference].causality;
}

const void *fmu_identity(void)
{
    return (const void *)&fmu_block;
}
