/* The generalised Bouc-Wen model of Song and Der Kiureghian (2006), a rival of the spring's own law. */
#ifndef GENERALISED_H
#define GENERALISED_H

#include <stddef.h>

/* z at each of `count` displacements, z = 0 at the first, of
 *
 *     dz/dx = rho*(1 - |z|^n * psi),   psi = b1*s*y + b2*c*s + b3*c*y + b4*s + b5*y + b6*c,
 *
 * s = sgn(dx), y = sgn(z), c = sgn(x). Between two displacements x goes straight; Runge-Kutta steps of order 4 are
 * short against the length over which z saturates and end where x changes sign. */
void generalised_path(size_t count, const double *displacement, double rho, double n, const double *beta, double *z);

#endif
