/* Hysteretic spring of the modified normalized Bouc-Wen model (Zhao et al. 2013), one step at a time.
 *
 * The Python files beside this folder are the readable specification: parameters.py, spline.py, restoring.py, work.py
 * and stepper.py derive what is computed here, and tests hold the values of both together. The verbs are those of
 * path-dependent materials: a trial leaves the memory as it is, a commit advances it.
 *
 * C11 and its mathematics library. No global that changes, no allocation: the caller owns all memory, and one SpringLaw
 * may be read by any number of threads at once. Doubles must be of IEEE 754. Compile without contraction to fused
 * multiply-add (-ffp-contract=off), or the last bits differ from machine to machine; -ffast-math is refused. Hosts may
 * round to any side.
 */
#ifndef SPRING_H
#define SPRING_H

#include "spring_limits.h"
#include "saturation.h"
#include "spline.h"
#include "spring_local.h"

#include <stddef.h>

/* One spring in SI units; elastic, amplifier, knots and forces count the values used of the arrays. FE is a table if
 * there are knots: elastic is then 0. Without padding. */
typedef struct {
    int elastic, amplifier, knots, forces;
    double kE[SPRING_COEFFICIENTS], kA[SPRING_AMPLIFIERS];
    double FE_knots[SPRING_KNOTS], FE_forces[SPRING_KNOTS];
    double kappa_omega, rho, sigma, n;
    double displacement_offset, displacement_min, displacement_max;
} SpringParameters;

/* What the functions need of one spring; the spline only if FE is a table. Many springs may share a table, which must
 * outlive them. */
typedef struct {
    SpringParameters parameters;
    double dFE[SPRING_COEFFICIENTS], dFA[SPRING_AMPLIFIERS];
    double FE_work[SPRING_COEFFICIENTS + 1];
    SpringSpline spline;
    double x_min, x_max;
    const SpringTable *table;
} SpringLaw;

/* What the spring remembers of its path; see Memory in stepper.py. `energy` is what has been absorbed up to the
 * displacement `energy_at` of the present stroke; the rest is integrated when asked for. Ordered so that what each step
 * writes is not copied in one machine word with what it leaves, which would make the next step wait for it. */
typedef struct {
    double displacement, omega;
    double start, start_xi;
    double energy_at, energy;
    int direction;
} SpringMemory;

/* Derivatives of start_xi, which is all that a stroke inherits, by rho, sigma, n and omega_start. Zero at rest,
 * where the first stroke takes omega_start itself. Kept beside the memory by those who ask for derivatives. */
typedef struct {
    double by_rho, by_sigma, by_n, by_omega_start;
} SpringSensitivity;

/* Derivatives of one output by displacement and by every parameter. */
typedef struct {
    double by_displacement; /* along the path */
    double by_place;        /* by displacement, omega being held */
    double by_kE[SPRING_COEFFICIENTS], by_kA[SPRING_AMPLIFIERS];
    double by_FE_knots[SPRING_KNOTS], by_FE_forces[SPRING_KNOTS];
    double by_kappa_omega, by_rho, by_sigma, by_n;
    double by_displacement_offset, by_displacement_min, by_displacement_max, by_omega_start;
} SpringGradient;

/* d(omega)/d(displacement) in the direction of the last motion, and its derivatives. */
typedef struct {
    double value, by_omega, by_rho, by_sigma, by_n;
} SpringOmegaSlope;

/* Prepares a law; the parameters must be possible, and the table one of their n and sigma. It may be NULL for what
 * needs no path: force and stiffness, and the derivatives at an omega that is given. */
SPRING_LOCAL void spring_prepare(SpringLaw *law, const SpringParameters *parameters, const SpringTable *table);

/* The memory at the start of a path. */
SPRING_LOCAL SpringMemory spring_start(double displacement, double omega);

/* The memory after a straight path to displacement [m], finite; *memory is left as it was. */
SPRING_LOCAL SpringMemory spring_trial(const SpringLaw *law, const SpringMemory *memory, double displacement);

/* Restoring force [N], tangent stiffness in the direction of the last motion [N/m], and energy absorbed since the
 * beginning [J], where the path ends. */
SPRING_LOCAL double spring_force(const SpringLaw *law, const SpringMemory *memory);
SPRING_LOCAL double spring_stiffness(const SpringLaw *law, const SpringMemory *memory);
SPRING_APART double spring_absorbed_energy(const SpringLaw *law, const SpringMemory *memory);

/* Force at a displacement with any omega [N], and its derivatives by displacement [N/m] and by omega [N]. */
SPRING_LOCAL double spring_force_partials(
    const SpringLaw *law, double displacement, double omega, double *by_displacement, double *by_omega);

/* Integrates the energy up to now, so that asking again costs little. */
SPRING_LOCAL void spring_integrate(const SpringLaw *law, SpringMemory *memory);

/* The sensitivity that belongs to `after`, which spring_trial made of `before`. Costs nothing while the direction
 * holds. The table must have derivatives. */
SPRING_LOCAL SpringSensitivity spring_trial_sensitivity(
    const SpringLaw *law, const SpringMemory *before, const SpringSensitivity *sensitivity, const SpringMemory *after);

/* Advances the memory along a straight path to displacement [m] and, unless it is NULL, its sensitivity. This takes a
 * third of the time of a trial while the direction holds, for what a step has just written is not copied, which would
 * have to wait for it. */
SPRING_LOCAL void spring_commit(
    const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, double displacement);

/* Goes on with other parameters at the same displacement and with the same omega, in the time of a step. Unless it is
 * NULL, the sensitivity by a parameter that changed counts from here on, and both tables must have derivatives. */
SPRING_LOCAL void spring_change(
    const SpringLaw *before, const SpringLaw *after, SpringMemory *memory, SpringSensitivity *sensitivity);

/* The same in two calls, between which the memory of the old law and of its table may become that of the new ones. */
typedef struct {
    int begins_anew; /* whether the stroke does */
    SpringSensitivity change; /* derivatives of omega there */
} SpringDeparture;

SPRING_LOCAL SpringDeparture spring_leave(
    const SpringLaw *law, const SpringParameters *next, SpringMemory *memory, const SpringSensitivity *sensitivity);
SPRING_LOCAL void spring_arrive(
    const SpringLaw *law, const SpringDeparture *departure, SpringMemory *memory, SpringSensitivity *sensitivity);

/* Exact derivatives of force and stiffness where the path ends. The force's derivative by displacement is the tangent
 * stiffness; a path that has not moved yet (direction 0) answers for the loading direction. For n < 1 the stiffness has
 * a cusp at omega = 0, where its derivative is that of the nearest omega a double resolves beside 1, 2e-16, so that it
 * stays finite. Without a sensitivity (NULL) omega is given, whatever the path to it, and by_omega_start is the
 * derivative by omega. */
SPRING_LOCAL void spring_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity,
    SpringGradient *of_force, SpringGradient *of_stiffness);

/* That of the force alone, but for by_displacement, which is 0; in half the time. */
SPRING_LOCAL void spring_force_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity, SpringGradient *of_force);

/* Where solvers overshoot |omega| = 1 the slope is that at 1. */
SPRING_LOCAL SpringOmegaSlope spring_omega_slope(const SpringLaw *law, const SpringMemory *memory);

#endif
