#include "fmu_watch.h"

#include <math.h>

static const double LEAST_SLACK = 1e-9, LARGEST_SLACK = 1e-2;
/* A point given anew for the same time is a correction if it moves by less than this share of the range. */
static const double JUMP = 1e-6;
/* A turn less than so many slacks after the last one may be the trembling of a solver with loose tolerances. */
static const double TREMBLING = 1000.0;

ReversalWatch fmu_watch_from(double time, double displacement)
{
    return (ReversalWatch){
        .count = 1, .time = {time}, .displacement = {displacement}, .turn = displacement, .slack = LEAST_SLACK};
}

/* The time since the last accepted point times the rate of displacement at `time`, later than that point. */
static double advance_at_rate(const ReversalWatch *watch, double time, double displacement)
{
    double h = time - watch->time[0], moved = displacement - watch->displacement[0];
    if (watch->count < 2)
        return moved;
    double before = watch->time[0] - watch->time[1], moved_before = watch->displacement[0] - watch->displacement[1];
    return moved + (moved - moved_before * (h / before)) * (h / (h + before));
}

static int sign(double value)
{
    return (value > 0.0) - (value < 0.0);
}

void fmu_watch_accept(ReversalWatch *watch, double time, double displacement, double range)
{
    if (time < watch->time[0]) {
        *watch = fmu_watch_from(time, displacement);
        return;
    }
    if (time == watch->time[0]) {
        if (fabs(displacement - watch->displacement[0]) > JUMP * range)
            *watch = fmu_watch_from(time, displacement);
        else
            watch->displacement[0] = displacement;
        return;
    }
    int heading = sign(advance_at_rate(watch, time, displacement));
    if (heading * watch->heading < 0) {
        /* A slack that outgrows the trembling bounds the events, each a restart of the solver, that it causes. */
        int trembling = fabs(displacement - watch->turn) < TREMBLING * watch->slack * range;
        watch->slack = trembling ? fmin(4.0 * watch->slack, LARGEST_SLACK) : LEAST_SLACK;
        watch->turn = displacement;
    } else {
        watch->slack = fmax(0.5 * watch->slack, LEAST_SLACK);
    }
    if (heading != 0)
        watch->heading = heading;
    watch->count = 2;
    watch->time[1] = watch->time[0];
    watch->displacement[1] = watch->displacement[0];
    watch->time[0] = time;
    watch->displacement[0] = displacement;
}

double fmu_watch_indicator(const ReversalWatch *watch, double time, double displacement, double range)
{
    if (watch->heading == 0 || !(time > watch->time[0]))
        return watch->slack;
    double indicator = watch->heading * advance_at_rate(watch, time, displacement) / range + watch->slack;
    return isfinite(indicator) ? indicator : watch->slack;
}

int fmu_watch_is_sound(const ReversalWatch *watch)
{
    int parabola = watch->count == 2 && watch->time[0] > watch->time[1];
    int heading = watch->heading == 0 || (parabola && (watch->heading == 1 || watch->heading == -1));
    for (int i = 0; i < 2; i++)
        if (!isfinite(watch->time[i]) || !isfinite(watch->displacement[i]))
            return 0;
    return (watch->count == 1 || parabola) && heading && isfinite(watch->turn) && watch->slack >= LEAST_SLACK &&
           watch->slack <= LARGEST_SLACK;
}

/* ---- the input velocity ---- */

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
