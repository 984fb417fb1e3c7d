/* Many springs along paths, or one along many, with derivatives by the parameters. */
#ifndef MANY_PATHS_H
#define MANY_PATHS_H

#include "../../core/c/spring/spring.h"

#include <stddef.h>
#include <stdint.h>

/* Force [N], tangent stiffness [N/m] and absorbed energy [J] as spring_path computes them, and their derivatives.
 *
 * springs, omega_start   of each path
 * displacement           of each path, `apart` doubles after that of the path before: 0 if all share one
 * fields                 of SpringGradient, counted in doubles from its beginning: those that are parameters, or
 *                        omega_start
 * table                  workspace, filled anew where n or sigma differ from those of the path before
 * coarse                 whether it may be coarse
 * force, stiffness, energy            a row of samples for each path; NULL if it is not wanted
 * force_by, stiffness_by, energy_by   a row of samples for each field of each path, likewise */
void spring_many_paths(size_t paths, const SpringParameters *springs, const double *omega_start, size_t samples,
                       const double *displacement, size_t apart, size_t fields, const int64_t *field,
                       SpringTable *table, int coarse, double *force, double *stiffness, double *energy,
                       double *force_by, double *stiffness_by, double *energy_by);

#endif
