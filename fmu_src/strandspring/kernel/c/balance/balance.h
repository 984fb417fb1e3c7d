/* Steady vibration of a system on springs by harmonic balance, with alternating frequency and time.
 *
 * The system has D coordinates q of the same mass m and M axes. An axis moves by d = a.q + q.Hq/2 and has P rows of S
 * springs, each of them at x + d/S, a damper and stops. Its force acts along its gradient g = a + Hq. Every coordinate
 * is a series of N = 2H + 1 Fourier coefficients (see fourier.h), which balance order by order,
 *
 *     -m*(k*Omega)^2*q_k + sum of [g*(P*r + c*d' + stop)]_k = L*[k = 0] + F*[k = 1, cosine],
 *
 * with F = F_0 + F_1*Omega^2. A spring's Maxwell branches add to r a dynamic stiffness at each order.
 * Forces are taken in time, where a whole period of a spring follows at once, and brought back by their projection.
 * Newton's method solves the balance with its Jacobian, which is exact where the second derivatives H are 0, and
 * elsewhere but for products of them with harmonics above H and with the forces of branches.
 *
 * Coefficients of motions and forces are D rows of N. */
#ifndef BALANCE_H
#define BALANCE_H

#include "../../../core/c/spring/branches.h"
#include "fourier.h"

#include <stddef.h>

enum {
    BALANCED_FORCINGS = 2, /* F_0 [N], F_1 [N s^2] */
    BALANCED_OF_AXIS = 5   /* figures of an axis in a motion */
};

typedef struct {
    const SpringLaw *law;
    double start;                                  /* as in spring_periodic; 0.5 to begin with */
    double parallel, series;                       /* P, S */
    double position;                               /* x [m] */
    double damping;                                /* c [N s/m] */
    double stop_low, stop_high, stop_stiffness;    /* displacements of a spring [m]; [N/m] of the axis */
    double low, high;                              /* displacements of a spring beyond which a sweep ends [m] */
    size_t branches;                               /* Maxwell branches of each spring */
    double branch_stiffness[SPRING_MAXWELLS], time_constant[SPRING_MAXWELLS]; /* [N/m], [s] */
} BalancedAxis;

/* One system under one level of excitation. Each thread needs its own, because `start` and the workspace change. */
typedef struct {
    size_t degrees, axes; /* D, M */
    FourierBasis basis;
    BalancedAxis *axis;
    double mass;            /* m [kg] */
    const double *along;    /* a, M rows of D */
    const double *bend;     /* H, M times D rows of D [1/m] */
    const double *load;     /* L, D [N] */
    const double *forcing;  /* BALANCED_FORCINGS rows of D */
    double *workspace;      /* of balance_workspace doubles */
} BalancedSystem;

/* What a motion is besides its coefficients; the caller's arrays.
 *
 * of_axes   BALANCED_OF_AXIS each: lowest and highest displacement of a spring [m], its omega at phase 0 [-], and the
 *           first harmonic of the axis' force, cosine and sine [N]
 * force     D rows of K: what the axes' forces are on the coordinates over a period [N]
 *
 * Both with those of dampers and stops. */
typedef struct {
    double *of_axes, *force;
} BalancedMotion;

/* Doubles of workspace. */
size_t balance_workspace(const BalancedSystem *system);

/* The unbalanced force of a motion [N], its derivatives by the coefficients [N/m] and by Omega [N s], and the largest
 * term of the balance, by which tolerances are scaled [N]. Returns 0 if the motion does not move.
 *
 * z, residual, by_frequency   D*N
 * jacobian                    D*N rows of D*N */
int balance_at(
    BalancedSystem *system, const double *z, double frequency, double *residual, double *jacobian,
    double *by_frequency, double *scale, const BalancedMotion *motion);

/* Newton's method at a fixed frequency Omega [rad/s], from the motion z, which is replaced by the steady one if 1 is
 * returned; 0 if there is no convergence. */
int balance_solve(BalancedSystem *system, double frequency, double *z, const BalancedMotion *motion);

/* The steady motions at rising frequencies, each predicted from the tangents of the two before and reached in several
 * steps if need be. Ends where a motion would not be continuous with the one before, or after the first in which a
 * spring goes beyond the limits of its axis.
 *
 * log, z        ln(Omega) and coefficients of the steady motion to start from
 * count, logs   the wanted ln(Omega), rising, all above `log`
 * found         coefficients at each frequency reached, up to `count` times D*N
 * motions       room for as many of what a motion is besides, one after the other
 *
 * Returns the number of frequencies reached. */
size_t balance_sweep(
    BalancedSystem *system, double log, const double *z, size_t count, const double *logs, double *found,
    const BalancedMotion *motions);

#endif
