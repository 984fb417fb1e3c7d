/* The block of the binary that holds one spring.
 *
 * A binary is compiled once for all springs. Making an FMU of it means to find this block by its first 24 bytes and to
 * overwrite the rest; fmu/native/block.py does so, and writes the same values into spring_values.h for those who
 * compile the sources.
 */
#ifndef FMU_BLOCK_H
#define FMU_BLOCK_H

#include "fmu_bytes.h"
#include "fmu_variables.h"

/* Little-endian on every platform, without padding. */
typedef struct {
    char magic[16];
    uint32_t size, version;
    char guid[sizeof(Guid)];
    Settings settings;
} SpringBlock;

/* The start values of all parameters, copied from the block. */
SPRING_LOCAL Settings fmu_start_settings(void);

#endif
