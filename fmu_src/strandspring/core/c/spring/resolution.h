/* Reversals below the resolution of a sensor, which friction does not follow.
 *
 * Friction follows a displacement at most the resolution from the given one. While the motion goes on they are equal.
 * Behind a turning point that of friction stands until the given one is a resolution away, and then catches up, at one
 * velocity for constant velocity, until both meet at twice the resolution: no jump, and nothing moves within it.
 */
#ifndef RESOLUTION_H
#define RESOLUTION_H

#include <math.h>

typedef struct {
    double displacement, followed; /* as given last, and where friction is then [m] */
    double furthest;               /* of the given displacement in the direction of motion [m] */
    double turn, at_turn;          /* of the last reversal: the displacement, and where friction was [m] */
    int direction;                 /* of motion: 0 before the first */
    int has_met;                   /* whether friction has caught up since the last reversal */
} SpringResolver;

/* At the start of a path, or where friction has caught up in this direction. */
static inline SpringResolver spring_resolver_start(double displacement, int direction)
{
    return (SpringResolver){displacement, displacement, displacement, displacement, displacement, direction, 1};
}

/* Takes the displacement straight to another one [m] with a resolution > 0 [m]; returns where friction is then. */
static inline double spring_resolve(SpringResolver *at, double displacement, double resolution)
{
    double way = displacement - at->furthest;
    at->displacement = displacement;
    if (at->direction == 0)
        at->direction = (way > 0.0) - (way < 0.0);
    if (way * at->direction >= 0.0) {
        at->furthest = displacement;
    } else if (fabs(way) >= resolution) {
        at->turn = at->furthest;
        at->at_turn = at->followed;
        at->direction = -at->direction;
        at->furthest = displacement;
        at->has_met = 0;
    }
    double share = fabs(at->furthest - at->turn) / resolution - 1.0, end = at->turn + 2.0 * resolution * at->direction;
    at->has_met |= share >= 1.0;
    at->followed = at->has_met ? at->furthest : at->at_turn + fmax(share, 0.0) * (end - at->at_turn);
    return at->followed;
}

#endif
