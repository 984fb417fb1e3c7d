/* Whether the input velocity is the rate of the displacement, as the form with states needs it.
 *
 * A host that leaves it at 0, or gives another one, gets no hysteresis or a wrong one, and nothing else would tell. So
 * the displacement is compared with the integral of the velocity over the accepted points, by the trapezoidal rule;
 * both differences and distances add up. Its error is a small share of the distance where a solver resolves the motion,
 * and an input that lags behind by a step of a twentieth of a period makes 16 %.
 *
 * This is no part of the state of the FMU: no value depends on it.
 */
#ifndef FMU_VELOCITY_H
#define FMU_VELOCITY_H

#include "spring_local.h"

typedef struct {
    int begun, warned;
    double time, displacement, velocity; /* the last accepted point */
    double distance, difference;         /* sums since the beginning [m] */
} VelocityWatch;

/* Go on from a point, which may be a jump. */
SPRING_LOCAL void fmu_velocity_from(VelocityWatch *watch, double time, double displacement, double velocity);

/* Accept a point; `range` is displacement_max - displacement_min [m]. Returns 1 where the host must be warned, once. */
SPRING_LOCAL int fmu_velocity_accept(
    VelocityWatch *watch, double time, double displacement, double velocity, double range);

#endif
