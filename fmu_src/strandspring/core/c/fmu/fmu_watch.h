/* The event indicator of model exchange: where the displacement turns back.
 *
 * A reversal must become a vertex of the committed path, or the tip of the hysteresis loop between two accepted
 * points is lost; and the force has a kink there, at which a solver must restart or creep. Only the displacement is an
 * input, so its rate at the time t of the solver's trial is taken from the parabola through the trial and the last two
 * accepted points. It errs by the square of the step, and the turning point, where the displacement is flat, by the
 * fourth power; a cubic would err less, but fail at the uneven steps after a restart.
 *
 * With d the heading, +1 or -1, and h the time since the last accepted point, the indicator is
 *
 *     z = d*h*(rate of the parabola at t)/(displacement_max - displacement_min) + slack.
 *
 * It depends on the trial and on accepted points only. It is the slack, and so positive, wherever a step begins, and
 * falls through zero once the displacement has come back from its turning point by the slack, a share of the range so
 * small that the path does not notice. Then the point is accepted, the heading changes and z is positive again.
 *
 * Measured with a mass on a spring under CVODE over 9 reversals, at relative
 * tolerances of 1e-5, 1e-7 and 1e-9: the position errs by 5e-4, 7e-6 and 1.4e-7 of its travel after 429, 856 and 1523
 * evaluations, just as where the solver watches the true velocity. Without the indicator, committing accepted points
 * alone, it errs by 3e-4, 1e-4 and 1e-4 after 266, 761 and 1597.
 */
#ifndef FMU_WATCH_H
#define FMU_WATCH_H

#include "../spring/spring_local.h"

/* Accepted points, and what is known of the motion. */
typedef struct {
    int count;                       /* accepted points below: 1 or 2 */
    double time[2], displacement[2]; /* the latest first */
    int heading;                     /* +1 or -1; 0 while it is unknown */
    double turn;                     /* displacement where the heading changed last [m] */
    double slack;                    /* [-] */
} ReversalWatch;

/* The watch on a path that begins or jumps. */
SPRING_LOCAL ReversalWatch fmu_watch_from(double time, double displacement);

/* Accept a point; `range` is displacement_max - displacement_min [m]. */
SPRING_LOCAL void fmu_watch_accept(ReversalWatch *watch, double time, double displacement, double range);

SPRING_LOCAL double fmu_watch_indicator(const ReversalWatch *watch, double time, double displacement, double range);

/* Whether bytes from outside may be such a watch. */
SPRING_LOCAL int fmu_watch_is_sound(const ReversalWatch *watch);

/* Whether the input velocity is the rate of the displacement, as the form with states needs it.
 *
 * A host that leaves it at 0, or gives another one, gets no hysteresis or a wrong one, and nothing else would tell. So
 * the displacement is compared with the integral of the velocity over the accepted points, by the trapezoidal rule;
 * both differences and distances add up. Its error is a small share of the distance where a solver resolves the motion,
 * and an input that lags behind by a step of a twentieth of a period makes 16 %.
 *
 * This is no part of the state of the FMU: no value depends on it.
 */
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
