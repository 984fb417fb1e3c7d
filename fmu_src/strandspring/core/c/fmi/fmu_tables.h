/* What instances share.
 *
 * Instances of this FMU whose n and sigma are the same use one table: the first makes it, the last frees it. With it
 * comes the law of the first, for all instances with the same parameters: thousands of them then step out of the
 * processor's cache. All functions may be called from any number of threads at once.
 */
#ifndef FMU_TABLES_H
#define FMU_TABLES_H

#include "../spring/spring.h"

typedef struct {
    SpringTable table;
    SpringLaw law;
} SharedSpring;

/* The table for these parameters, to be released later; NULL if there is not enough memory. Its memory is the C
 * library's: the host of the instance that needed it first may be gone when the last one releases it. */
SPRING_LOCAL const SharedSpring *fmu_acquire(const SpringParameters *parameters);

/* Whether a table is that of these parameters. */
static inline int fmu_fits(const SpringTable *table, const SpringParameters *parameters)
{
    return table->n == parameters->n && table->curvature == 2.0 * parameters->sigma - 1.0;
}

/* Makes the table of parameters in memory of the caller's. */
static inline void fmu_tabulate(SpringTable *table, const SpringParameters *parameters)
{
    spring_tabulate(table, parameters->n, parameters->sigma, SPRING_WITH_DERIVATIVES | SPRING_WITH_ENERGIES);
}

/* Memory of the C library for a table of an instance's own, as yet of no parameters; NULL if there is not enough. What
 * is not written to takes no room in most systems, so it is not cleared. */
SPRING_LOCAL SharedSpring *fmu_unused_table(void);

/* NULL is allowed. */
SPRING_LOCAL void fmu_release(const SharedSpring *shared);

#endif
