/* Tables of W that instances share.
 *
 * Instances of this FMU whose n and sigma are the same use one table: the first makes it, the last frees it. All functions
 * may be called from any number of threads at once.
 */
#ifndef FMI2_TABLES_H
#define FMI2_TABLES_H

#include "fmi2_api.h"
#include "saturation.h"

/* Of one host; a table is freed by the functions that it was made with. */
typedef struct {
    fmi2CallbackAllocateMemory allocate;
    fmi2CallbackFreeMemory free;
} Allocator;

/* The table of n and sigma, to be released later; NULL if there is not enough memory. */
SPRING_LOCAL const SpringTable *fmu_acquire_table(const Allocator *allocator, double n, double sigma);

/* NULL is allowed. */
SPRING_LOCAL void fmu_release_table(const SpringTable *table);

#endif
