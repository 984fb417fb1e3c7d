/* Springs fitted to points of records by variable projection: least squares in rho, sigma, n and the omega_start of each
 * record alone, since FE and FA follow from one linear problem for each of them. */
#ifndef RECORD_FIT_H
#define RECORD_FIT_H

#include "../../core/c/spring/saturation.h"

#include <stddef.h>
#include <stdint.h>

/* Points of records, and what they are fitted with. Variables are ln rho, ln sigma, ln n and omega_start of each
 * record. */
typedef struct {
    size_t records, strokes, points, fixed, moving;
    const int64_t *first_stroke, *first_point, *direction; /* as of spring_on_records */
    const double *length;
    const int64_t *stroke;
    const double *travel;
    const double *columns;     /* of FE and whatever else is linear (`fixed` rows), then of FA (`moving` rows) */
    const double *force;
    const double *low, *high; /* bounds of the variables */
    int with;                 /* what tables hold, as of spring_tabulate */
    SpringTable *table;       /* memory of one */
    const double *root;       /* of the weight of each squared misfit */
    double tolerance;         /* as of least_squares */
    size_t evaluations;
} RecordFit;

/* Doubles of the workspace of a fit. */
size_t record_fit_workspace(const RecordFit *fit);

/* Replaces the variables x, strictly within their bounds, by those of the least weighted squared misfit, and writes
 *
 * coefficients   of the fixed and of the moving columns; 0 where a column depends on those before it
 * omega          rows of points: omega, then its derivatives by each variable
 *
 * Returns whether it is a minimum, as least_squares does. */
int record_fit(const RecordFit *fit, double *x, double *coefficients, double *omega, double *workspace);

#endif
