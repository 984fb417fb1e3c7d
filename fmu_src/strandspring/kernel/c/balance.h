/* Steady vibration of a mass on equal springs by harmonic balance, with alternating frequency and time.
 *
 * S springs in series share the displacement z of the mount, P such rows stand side by side. The N = 2H + 1 Fourier
 * coefficients of z (see fourier.h) balance, harmonic by harmonic,
 *
 *     -m*(k*Omega)^2*z_k + c*k*Omega*z'_k + P*[r(z/S)]_k = L*[k = 0] + F*[k = 1, cosine],
 *
 * with F = forcing + forcing_by_square*Omega^2. The springs' force is taken in time, where a whole period follows at
 * once, and brought back by its projection. Newton's method solves the balance with its exact Jacobian. */
#ifndef BALANCE_H
#define BALANCE_H

#include "../../core/c/spring/spring.h"
#include "fourier.h"

#include <stddef.h>

/* One system under one level of excitation. Each thread needs its own, because `start` and the workspace change. */
typedef struct {
    const SpringLaw *law;
    FourierBasis basis;
    double *workspace;                 /* of balance_workspace doubles */
    double start;                      /* as in spring_periodic; 0.5 to begin with */
    double parallel, series;           /* P, S */
    double mass, damping, static_load; /* [kg], [N s/m], L [N] */
    double forcing, forcing_by_square; /* [N], [N s^2] */
    double force_on_mass;              /* the part of F that acts on the mass itself [N]; the rest is inertia */
} BalancedMass;

/* Summary of a steady motion. */
typedef struct {
    double low, high; /* displacement of one spring [m] */
    double omega;     /* of a spring at phase 0 [-] */
    double push;      /* largest absolute force on the mass over the period, inertia excluded [N] */
} BalancedMotion;

size_t balance_workspace(size_t harmonics, size_t samples);

/* The unbalanced force of a motion [N], its derivatives by the coefficients [N/m] and by Omega [N s], and the largest
 * term of the balance, by which tolerances are scaled [N]. Returns 0 if the motion does not move.
 *
 * z, residual, by_frequency   N
 * jacobian                    N rows of N */
int balance_at(
    BalancedMass *mass, const double *z, double frequency, double *residual, double *jacobian, double *by_frequency,
    double *scale, BalancedMotion *motion);

/* Newton's method at a fixed frequency Omega [rad/s], from the motion z, which is replaced by the steady one if 1 is
 * returned; 0 if there is no convergence. */
int balance_solve(BalancedMass *mass, double frequency, double *z, BalancedMotion *motion);

/* The steady motions at rising frequencies, each predicted along the tangent of the one before and reached in several
 * steps if need be. Ends where a motion would not be continuous with the one before, or beyond the limits.
 *
 * log, z        ln(Omega) and coefficients of the steady motion to start from
 * count, logs   the wanted ln(Omega), rising, all above `log`
 * low, high     limits of a spring's displacement; the first motion beyond them is the last [m]
 * found         coefficients at each frequency reached, up to `count` rows of N
 * motions       one for each of them
 *
 * Returns the number of frequencies reached. */
size_t balance_sweep(
    BalancedMass *mass, double log, const double *z, size_t count, const double *logs, double low, double high,
    double *found, BalancedMotion *motions);

#endif
