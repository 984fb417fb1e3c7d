/* Shock response spectra: largest responses of oscillators with one degree of freedom to a base acceleration. */
#ifndef SHOCK_H
#define SHOCK_H

#include <stddef.h>

/* Largest and smallest absolute acceleration x + z'' = -(w^2*z + 2*zeta*w*z') of an oscillator z'' + 2*zeta*w*z' + w^2*z
 * = -x(t) during the samples and after them, out[4*k] .. out[4*k + 3] = primary maximum, primary minimum, residual
 * maximum, residual minimum of the oscillator with w*h = theta[k] > 0; none of the primary is below 0 or above it
 * respectively, as all start at rest. x is straight between its `count` >= 1 samples and 0 after the last;
 * 0 <= zeta < 1. */
void shock_spectrum(
    size_t count, const double *x, double zeta, size_t frequencies, const double *theta, double *out);

#endif
