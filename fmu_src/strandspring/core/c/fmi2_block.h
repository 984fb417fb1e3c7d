/* The block of the binary that holds one spring.
 *
 * A binary is compiled once for all springs. Making an FMU of it means to find this block by its first 24 bytes and to
 * overwrite the rest; fmu/native/block.py does so, and writes the same values into spring_values.h for those who
 * compile the sources.
 */
#ifndef FMI2_BLOCK_H
#define FMI2_BLOCK_H

#include "fmi2_variables.h"

#include <stdint.h>

enum { FMU_GUID_SIZE = 38 };

typedef struct {
    char text[FMU_GUID_SIZE + 2]; /* terminated, and a multiple of 8 bytes */
} Guid;

/* Little-endian on every platform, without padding. */
typedef struct {
    char magic[16];
    uint32_t size, version;
    char guid[sizeof(Guid)];
    Settings settings;
} SpringBlock;

/* Copies of what the block holds: the GUID, and the start values of all parameters. */
SPRING_LOCAL Guid fmu_guid(void);
SPRING_LOCAL Settings fmu_start_settings(void);

/* An address that identifies the FMU within its process. */
SPRING_LOCAL const void *fmu_identity(void);

#endif
