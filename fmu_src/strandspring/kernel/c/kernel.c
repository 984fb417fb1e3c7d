/* The compiled kernel of the package as one unit: what travels inside FMUs, what only the package needs, and here what
 * the package calls to make tables and laws. The caller owns all memory; arrays are contiguous. */
#define SPRING_LOCAL static inline

#include "../../core/c/spring/saturation_table.c"
#include "../../core/c/spring/saturation.c"
#include "../../core/c/spring/spline.c"
#include "../../core/c/spring/spring.c"
#include "../../core/c/spring/branches.c"
#include "path.c"
#include "branches.c"
#include "many_paths.c"
#include "balance/steady.c"
#include "balance/fourier.c"
#include "balance/periodic.c"
#include "linear.c"
#include "balance/balance.c"
#include "balance/balance_sweep.c"
#include "generalised.c"
#include "shock.c"
#include "motion/motion.c"
#include "motion/motion_mounts.c"
#include "motion/motion_rest.c"
#include "motion/motion_run.c"

void kernel_tabulate(SpringTable *table, double n, double sigma, int with)
{
    spring_tabulate(table, n, sigma, with);
}

void kernel_prepare(SpringLaw *law, const SpringParameters *parameters, const SpringTable *table)
{
    spring_prepare(law, parameters, table);
}

/* The inverse of W, elementwise. */
void kernel_inverse(const SpringTable *table, size_t count, const double *u, double *xi)
{
    for (size_t i = 0; i < count; i++)
        xi[i] = spring_inverse(table, u[i]);
}
