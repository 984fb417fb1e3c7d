/* What a spring may have beside the paper's: a second mechanism, which is a spring without FE, and Maxwell branches
 * (core/branches.py). The verbs are those of spring.h.
 *
 * A branch of stiffness c and time constant tau has the elongation s [m] of its spring as memory, ds/dt = dx/dt - s/tau,
 * and the force c*s. Over a step of duration h in which x moves by d at constant velocity, with q = h/tau,
 *
 *     s after = rest*s + mean*d,   rest = e^-q,   mean = (1 - e^-q)/q,
 *
 * and the force does the work c*d*(mean*s + ramp*d), ramp = (q - 1 + e^-q)/q^2. A jump is a step with h = 0.
 */
#ifndef BRANCHES_H
#define BRANCHES_H

#include "spring.h"

enum { SPRING_MAXWELLS = 3 };

/* mechanisms: 0 or 1 besides the first; amplifier and branches count the values used. Without padding. */
typedef struct {
    int mechanisms, amplifier, branches, unused;
    double kA[SPRING_AMPLIFIERS];
    double kappa_omega, rho, sigma, n;
    double stiffness[SPRING_MAXWELLS], time_constant[SPRING_MAXWELLS];
} SpringAdded;

/* What these remember of the path: elongations and their derivatives by the logarithms of the time constants, and the
 * work of the branches. */
typedef struct {
    SpringMemory second;
    SpringSensitivity sensitivity; /* of the second mechanism */
    double elongation[SPRING_MAXWELLS], by_log[SPRING_MAXWELLS];
    double work;
} SpringAddedMemory;

/* What remains of an elongation over a step, and averages over it: of what remains so far, and of that from there on. */
typedef struct {
    double rest, mean, ramp;
} SpringDecay;

/* For q >= 0. */
SPRING_LOCAL SpringDecay spring_decay(double q);

/* The elongation after a step that moves x by travel [m]. */
static inline double spring_maxwell_after(const SpringDecay *decay, double elongation, double travel)
{
    return decay->rest * elongation + decay->mean * travel;
}

/* Integral of the elongation over x through that step [m^2]. */
static inline double spring_maxwell_work(const SpringDecay *decay, double elongation, double travel)
{
    return travel * (decay->mean * elongation + decay->ramp * travel);
}

/* The derivative of the elongation after a step by ln(tau), from that before it and the elongation before it. */
static inline double spring_maxwell_by_log(
    const SpringDecay *decay, double q, double by_log, double elongation, double travel)
{
    /* d(rest)/d(ln tau) = q*rest and d(mean)/d(ln tau) = mean - rest, without cancellation where q is small. */
    double of_mean = q < 1.0 ? q * (decay->mean - decay->ramp) : decay->mean - decay->rest;
    /* q overflows where nothing is left. */
    double of_rest = decay->rest > 0.0 ? decay->rest * (by_log + q * elongation) : 0.0;
    return of_rest + of_mean * travel;
}

/* What unit harmonic motion of angular frequency Omega [rad/s] makes of a branch of stiffness 1, the share of a spring and
 * that of a damper, c*i*Omega*tau/(1 + i*Omega*tau); and their derivatives by Omega [s]. */
typedef struct {
    double storage, loss, storage_slope, loss_slope;
} SpringDynamic;

static inline SpringDynamic spring_maxwell_dynamic(double time_constant, double frequency)
{
    double t = time_constant * frequency, share = 1.0 / (1.0 + t * t);
    /* t*t overflows where the branch is a spring. */
    if (!(t < 1e100))
        return (SpringDynamic){1.0, 0.0, 0.0, 0.0};
    return (SpringDynamic){t * t * share, t * share, 2.0 * t * time_constant * share * share,
                           time_constant * (1.0 - t * t) * share * share};
}

/* The second mechanism as a spring without FE over the range of the first. */
SPRING_LOCAL SpringParameters spring_second(const SpringParameters *first, const SpringAdded *added);

/* The memory at the start of a path, without force in the branches. */
SPRING_LOCAL SpringAddedMemory spring_added_start(double displacement, double omega);

/* Advances the memory from one displacement straight to another within a duration [s], over which the branches have
 * these decays; `second` is the law of the second mechanism, if there is one. Derivatives are kept if wanted. */
SPRING_LOCAL void spring_added_commit(
    const SpringAdded *added, const SpringLaw *second, SpringAddedMemory *memory, int with_derivatives,
    double from, double displacement, double duration, const SpringDecay decays[SPRING_MAXWELLS]);

/* Force [N], stiffness against sudden motion [N/m], and energy absorbed since the beginning [J] of all of them. */
SPRING_LOCAL double spring_added_force(
    const SpringAdded *added, const SpringLaw *second, const SpringAddedMemory *memory);
SPRING_LOCAL double spring_added_stiffness(
    const SpringAdded *added, const SpringLaw *second, const SpringAddedMemory *memory);
SPRING_LOCAL double spring_added_energy(
    const SpringAdded *added, const SpringLaw *second, const SpringAddedMemory *memory);

/* The part of the energy that the branches' springs hold [J]. */
SPRING_LOCAL double spring_added_stored(const SpringAdded *added, const SpringAddedMemory *memory);

#endif
