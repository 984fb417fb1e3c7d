/* Bounded nonlinear least squares in a few variables: the trust-region reflective algorithm.
 *
 * Branch, Coleman and Li, SIAM J. Sci. Comput. 21, 1999, in the form of SciPy's least_squares(method="trf",
 * x_scale="jac"), whose steps these are: Gauss-Newton steps within an ellipsoid, in variables that are scaled by the
 * distance to the bound towards which the gradient points; a step that meets a bound is shortened, reflected, or
 * replaced by one along the gradient, whichever promises most. The Jacobian J = QR enters as R alone, so that a step
 * costs the same for any number of residuals. Variables without effect take no part in a step, so that steps are not
 * damped for their sake, as SciPy's are. */
#ifndef LEAST_SQUARES_H
#define LEAST_SQUARES_H

#include <stddef.h>

/* A problem, its bounds, and what is done at a point x. */
typedef struct {
    size_t variables, residuals;
    const double *low, *high;
    double tolerance;   /* relative change of the cost at which the iteration ends */
    size_t evaluations; /* at most so many */
    void *problem;
    double (*cost)(void *problem, const double *x);    /* half the sum of squares at a trial; infinite without one */
    void (*keep)(void *problem);                       /* the last trial is the best point now */
    void (*triangle)(void *problem, double *triangle); /* R of [J, residuals] of the best point, column by column */
} LeastSquares;

/* Doubles of the workspace for so many variables. */
size_t least_squares_workspace(size_t variables);

/* Replaces x, strictly within the bounds, by the best point found. Returns whether it is a minimum; it is none where the
 * evaluations were used up. */
int least_squares(const LeastSquares *given, double *x, double *workspace);

#endif
