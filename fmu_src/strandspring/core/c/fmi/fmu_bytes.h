/* The identity of an FMU, its block of values, and the serialized form of its states. */
#ifndef FMU_BYTES_H
#define FMU_BYTES_H

#include "../spring/spring_local.h"

#include <stddef.h>
#include <stdint.h>

enum { FMU_GUID_SIZE = 38 };

typedef struct {
    char text[FMU_GUID_SIZE + 2]; /* terminated, and a multiple of 8 bytes */
} Guid;

/* The FMU's, from its block. */
SPRING_LOCAL Guid fmu_guid(void);

/* An address that identifies the FMU within its process. */
SPRING_LOCAL const void *fmu_identity(void);

/* Copies from a block that is volatile, since compilers would take for constants what is overwritten in the finished
 * binary. */
SPRING_LOCAL void fmu_copy_block(void *to, const volatile void *from, size_t size);

/* A position in the bytes of a state; without either pointer fields are only counted. */
typedef struct {
    const unsigned char *from;
    unsigned char *to;
    size_t position;
} Cursor;

/* Where the fields of a state begin. */
SPRING_LOCAL size_t fmu_fields_at(void);

/* Read or write a field, or count it: a double in IEEE 754, an int as two's complement in 32 bits. */
SPRING_LOCAL void fmu_double_field(Cursor *cursor, double *value);
SPRING_LOCAL void fmu_int_field(Cursor *cursor, int *value);

/* Writes what stands before the fields of a state of so many bytes, once these are there. */
SPRING_LOCAL void fmu_write_head(unsigned char *bytes, size_t size);

/* The reason why bytes are not a state of this FMU, whose states have `expected` bytes, apart from its fields; NULL if
 * there is none. */
SPRING_LOCAL const char *fmu_foreign(const unsigned char *bytes, size_t size, size_t expected);

#endif
