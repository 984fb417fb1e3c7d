/* Maxwell branches: dr/dt = stiffness*dx/dt - r/time_constant, exact over steps in which x moves at constant velocity.
 *
 * Over such a step of duration h that moves x by d, with q = h/time_constant,
 *
 *     r after = rest*r + mean*stiffness*d,   rest = e^-q,  mean = (1 - e^-q)/q,
 *
 * and the force does the work d*(mean*r + ramp*stiffness*d), ramp = (q - 1 + e^-q)/q^2. A jump is a step with h = 0.
 */
#ifndef BRANCHES_H
#define BRANCHES_H

#include "spring_local.h"

/* c [N/m] and tau [s]. */
typedef struct {
    double stiffness, time_constant;
} SpringMaxwell;

/* What remains of a force over a step, and averages over it: of what remains so far, and of that from there on. */
typedef struct {
    double rest, mean, ramp;
} SpringDecay;

/* For q >= 0. */
SPRING_LOCAL SpringDecay spring_decay(double q);

/* The force [N] after a step that moves x by travel [m] within duration [s]. */
static inline double spring_maxwell_after(
    const SpringMaxwell *branch, const SpringDecay *decay, double force, double travel)
{
    return decay->rest * force + decay->mean * branch->stiffness * travel;
}

/* Integral of the force over x through that step [J]. */
static inline double spring_maxwell_work(
    const SpringMaxwell *branch, const SpringDecay *decay, double force, double travel)
{
    return travel * (decay->mean * force + decay->ramp * branch->stiffness * travel);
}

/* Energy in the branch's spring [J]; the rest of the work has been dissipated. */
static inline double spring_maxwell_stored(const SpringMaxwell *branch, double force)
{
    return branch->stiffness > 0.0 ? 0.5 * force * force / branch->stiffness : 0.0;
}

#endif
