/* The steady force of a spring over one period of a displacement given by its Fourier coefficients (fourier.h), and its
 * derivatives. A series may turn as often as it is sampled.
 *
 * With the displacement's coefficients c the force at a sample of a stroke changes by
 *
 *     dr = stiffness*dz + memory*(inherited.dc),
 *
 * where dz is the change of the displacement there and `inherited` is one row for each stroke. */
#ifndef PERIODIC_H
#define PERIODIC_H

#include "../../../core/c/spring/spring.h"
#include "fourier.h"

#include <stddef.h>

/* Slope of omega after a period over omega before it; it is 1 for motion too small for a loop. */
static const double STEEPEST = 1.0 - 1e-9;

/* xi at the beginning of each stroke of a period once it repeats. `way` is rho times the length of each stroke,
 * `strokes` an even number of them; the first begins where the displacement is highest or lowest, where omega depends
 * least on what was before. *omega is where the search for omega at the beginning of the first stroke starts, and then
 * what was found; a period of two strokes needs none. */
void spring_steady(const SpringTable *table, size_t strokes, const double *way, int direction, double *omega,
                   double *xi);

/* What a period gives; all arrays are the caller's. */
typedef struct {
    double *displacement; /* K [m] */
    double *rate;         /* K, derivative of the displacement by the phase [m] */
    double *omega;        /* K [-] */
    double *force;        /* K [N] */
    double *stiffness;    /* K [N/m] */
    double *memory;       /* K [N/m] */
    double *inherited;    /* room for K rows of N [-] */
    Span *spans;          /* room for 2K: the samples of each stroke, in two spans */
    double *turns;        /* room for K: displacement at the turning points, the highest first [m] */
} SpringPeriod;

/* Doubles of workspace. */
size_t spring_periodic_workspace(size_t harmonics, size_t samples);

/* The steady period under a displacement of the given coefficients. Returns the number of its strokes, which is even; 0
 * if the displacement does not move, and then *period holds nothing.
 *
 * start   omega at the highest displacement where the search for it begins, within [-1, 1]; replaced by what was
 * found */
size_t spring_periodic(
    const SpringLaw *law, const FourierBasis *basis, const double *coefficients, double *start, double *workspace,
    SpringPeriod *period);

#endif
