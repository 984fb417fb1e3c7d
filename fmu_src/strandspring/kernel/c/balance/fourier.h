/* Series of harmonics up to H at K equal phases tau from 0 on.
 *
 * A series has N = 2H + 1 coefficients: the mean, H of cosines, H of sines. Limits: H >= 1, K > 2H, K a multiple
 * of 4, K >= 8. */
#ifndef FOURIER_H
#define FOURIER_H

#include "../../../core/c/spring/spring_local.h"

#include <stddef.h>

/* Made once for H and K. rows: 4H + 1 of the first K/4 + 1 samples each, which are 1, cos(k tau) for k = 1 .. 2H, sin(k tau) for
 * k = 1 .. 2H. */
typedef struct {
    size_t harmonics, samples;
    const double *rows;
} FourierBasis;

/* Samples from one to before another. */
typedef struct {
    size_t from, to;
} Span;

/* A turning point of a series. */
typedef struct {
    double phase, value;
    size_t cell; /* the last sample before it */
} Turn;

/* N of a basis. */
SPRING_LOCAL size_t fourier_size(const FourierBasis *basis);

/* Doubles of workspace that those functions need which take one: K + 4 + 3N. */
SPRING_LOCAL size_t fourier_workspace(const FourierBasis *basis);

/* The samples of a series with coefficients c, and of its derivative by the phase, K each. */
SPRING_LOCAL void fourier_samples(
    const FourierBasis *basis, const double *c, double *value, double *rate, double *workspace);

/* The turning points of a series by rising phase, and the N functions of the basis at each; returns their number, which
 * is even. turns has room for K, columns for K rows of N. */
SPRING_LOCAL size_t fourier_turns(
    const FourierBasis *basis, const double *c, const double *rate, Turn *turns, double *columns);

/* The sums of a signal's samples with the cosines and sines of orders up to `last`; the sine of order k at index k. */
SPRING_LOCAL void fourier_sums(
    const FourierBasis *basis, const double *signal, size_t last, double *cosines, double *sines, double *workspace);

/* The coefficients of a signal. */
SPRING_LOCAL void fourier_coefficients(
    const FourierBasis *basis, const double *signal, double *c, double *workspace);

/* The N x N matrix by which the coefficients of a series turn into those of its product with a signal, sample by
 * sample. */
SPRING_LOCAL void fourier_product(const FourierBasis *basis, const double *signal, double *matrix, double *workspace);

#endif
