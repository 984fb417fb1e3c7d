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
SPRING_LOCAL int fmu_fits(const SharedSpring *shared, const SpringParameters *parameters);

/* Makes the table, and with it the law, of parameters in memory of the caller's; `with` says what the table holds
 * besides W. */
SPRING_LOCAL void fmu_fill(SharedSpring *shared, const SpringParameters *parameters, int with);

/* NULL is allowed. */
SPRING_LOCAL void fmu_release(const SharedSpring *shared);

#endif
