/* The elastic force FE as a table: the cubic spline through forces at rising knots, as spline.py derives it.
 *
 * The caller owns all memory. The functions that a step takes are inline. */
#ifndef SPLINE_H
#define SPLINE_H

#include "numerics.h"
#include "spring_limits.h"
#include "spring_local.h"

enum { SPLINE_POWERS = 4 };

/* Between neighbouring knots FE is a polynomial of x - knots[i], with coefficients cubic[i]; work[i] is its work from
 * the offset (x = 0) to the knot. */
typedef struct {
    double knots[SPRING_KNOTS];
    double cubic[SPRING_KNOTS - 1][SPLINE_POWERS];
    double work[SPRING_KNOTS - 1];
} SpringSpline;

/* The spline through `count` forces at knots, 7 to SPRING_KNOTS; each knot is a displacement, x = knot - offset. */
SPRING_LOCAL void spring_spline(
    SpringSpline *spline, int count, const double *knots, const double *forces, double offset);

/* Writes the derivatives of by_force*FE(x) + by_slope*FE'(x) with respect to the forces at the knots and to the places
 * of the knots. */
SPRING_LOCAL void spring_spline_gradient(
    const SpringSpline *spline, int count, double x, double by_force, double by_slope, double *by_forces,
    double *by_knots);

/* The piece that holds x; the one beside the range outside it. */
static inline int spline_piece(const SpringSpline *spline, int count, double x)
{
    return last_below(spline->knots, 0, count - 2, x);
}

/* On piece i, at t = x - knots[i]: FE, its slope, the slope's slope, and the work from the offset. */
static inline double spline_force(const SpringSpline *spline, int i, double t)
{
    const double *c = spline->cubic[i];
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]));
}

static inline double spline_slope(const SpringSpline *spline, int i, double t)
{
    const double *c = spline->cubic[i];
    return c[1] + t * (2.0 * c[2] + t * (3.0 * c[3]));
}

static inline double spline_bend(const SpringSpline *spline, int i, double t)
{
    return 2.0 * spline->cubic[i][2] + 6.0 * spline->cubic[i][3] * t;
}

static inline double spline_work(const SpringSpline *spline, int i, double t)
{
    const double *c = spline->cubic[i];
    return spline->work[i] + t * (c[0] + t * (c[1] / 2.0 + t * (c[2] / 3.0 + t * (c[3] / 4.0))));
}

#endif
