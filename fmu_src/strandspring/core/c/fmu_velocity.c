#include "fmu_velocity.h"

#include <math.h>

/* Of the distance. */
static const double LARGEST_DIFFERENCE = 0.3;
/* Of the range: after which distance the two are compared. */
static const double LEAST_DISTANCE = 0.05;

void fmu_velocity_from(VelocityWatch *watch, double time, double displacement, double velocity)
{
    watch->begun = 1;
    watch->time = time;
    watch->displacement = displacement;
    watch->velocity = velocity;
}

int fmu_velocity_accept(VelocityWatch *watch, double time, double displacement, double velocity, double range)
{
    if (watch->begun) {
        double travel = displacement - watch->displacement;
        double integral = 0.5 * (time - watch->time) * (watch->velocity + velocity);
        watch->distance += fmax(fabs(travel), fabs(integral));
        watch->difference += fabs(travel - integral);
    }
    fmu_velocity_from(watch, time, displacement, velocity);
    if (watch->warned || watch->distance < LEAST_DISTANCE * range ||
        watch->difference <= LARGEST_DIFFERENCE * watch->distance)
        return 0;
    watch->warned = 1;
    return 1;
}
