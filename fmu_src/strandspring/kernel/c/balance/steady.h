/* The steady state of the spring over a period of strokes that repeats. */
#ifndef STEADY_H
#define STEADY_H

#include "../../../core/c/spring/saturation.h"

#include <stddef.h>

/* Slope of omega after a period over omega before it; it is 1 for motion too small for a loop. */
static const double STEEPEST = 1.0 - 1e-9;

/* xi at the beginning of each stroke of a period once it repeats. `way` is rho times the length of each stroke,
 * `strokes` an even number of them; the first begins where the displacement is highest or lowest, where omega depends
 * least on what was before. *omega is where the search for omega at the beginning of the first stroke starts, and then
 * what was found; a period of two strokes needs none. */
void spring_steady(const SpringTable *table, size_t strokes, const double *way, int direction, double *omega,
                   double *xi);

#endif
