#include "balance.h"

#include "../linear.h"
#include "periodic.h"

#include <math.h>
#include <string.h>

enum {
    NEWTON_STEPS = 40,
    HALVINGS = 8,    /* of a step of Newton's method */
    SWEEP_PARTS = 32 /* of the way to the next wanted frequency, at the finest */
};

static const double BALANCED = 1e-8;        /* of the largest term */
static const double WITHIN_ROUNDING = 1e-7; /* of the same: accepted where no step reduces the residual */
static const double LARGEST_CHANGE = 0.6;   /* of the motion's norm in one step of the sweep */
static const double LARGEST_SURPRISE = 0.3; /* of the same, between the motion and its prediction */

/* The balance of one motion; arrays as in balance.h. */
typedef struct {
    double *z, *residual, *jacobian, *by_frequency;
    SpringPeriod period;
    size_t strokes;
    double scale, size; /* size: largest entry of the residual [N] */
} Balance;

/* The parts of the workspace. */
typedef struct {
    Balance here, there;
    double *scaled, *step, *tangent, *guess, *last; /* N each */
    double *matrix;                                 /* N*N, lost in the elimination */
    double *periodic;
} BalanceRoom;

static size_t balance_size(size_t harmonics, size_t samples)
{
    size_t count = 2 * harmonics + 1;
    return 4 * count + count * count + 5 * samples;
}

size_t balance_workspace(size_t harmonics, size_t samples)
{
    size_t count = 2 * harmonics + 1;
    return 2 * balance_size(harmonics, samples) + 5 * count + count * count +
           spring_periodic_workspace(harmonics, samples);
}

static double *lay_balance(size_t count, size_t samples, double *workspace, Balance *balance)
{
    double **of_coefficients[] = {
        &balance->z, &balance->residual, &balance->by_frequency, &balance->period.coefficients};
    for (size_t i = 0; i < sizeof of_coefficients / sizeof *of_coefficients; i++, workspace += count)
        *of_coefficients[i] = workspace;
    double **of_samples[] = {&balance->period.displacement, &balance->period.rate, &balance->period.omega,
                             &balance->period.force, &balance->period.turns};
    for (size_t i = 0; i < sizeof of_samples / sizeof *of_samples; i++, workspace += samples)
        *of_samples[i] = workspace;
    balance->jacobian = balance->period.jacobian = workspace;
    return workspace + count * count;
}

/* z becomes the motion of `here`. */
static BalanceRoom lay_room(const BalancedMass *mass, const double *z)
{
    size_t count = fourier_size(&mass->basis);
    BalanceRoom room;
    double *workspace = lay_balance(count, mass->basis.samples, mass->workspace, &room.here);
    workspace = lay_balance(count, mass->basis.samples, workspace, &room.there);
    double **of_coefficients[] = {&room.scaled, &room.step, &room.tangent, &room.guess, &room.last};
    for (size_t i = 0; i < sizeof of_coefficients / sizeof *of_coefficients; i++, workspace += count)
        *of_coefficients[i] = workspace;
    room.matrix = workspace;
    room.periodic = workspace + count * count;
    memcpy(room.here.z, z, count * sizeof *z);
    return room;
}

/* ---- one balance ---- */

/* Fills the balance of the motion balance->z; returns 0 if it does not move. */
static int balance_motion(BalancedMass *mass, double frequency, const BalanceRoom *room, Balance *balance)
{
    size_t harmonics = mass->basis.harmonics, count = fourier_size(&mass->basis);
    double ratio = mass->parallel / mass->series, most = 0.0;
    for (size_t i = 0; i < count; i++)
        room->scaled[i] = balance->z[i] / mass->series;
    balance->strokes =
        spring_periodic(mass->law, &mass->basis, room->scaled, &mass->start, room->periodic, &balance->period);
    if (balance->strokes == 0)
        return 0;
    for (size_t i = 0; i < count * count; i++)
        balance->jacobian[i] *= ratio;
    balance->residual[0] = mass->parallel * balance->period.coefficients[0] - mass->static_load;
    balance->by_frequency[0] = 0.0;
    for (size_t i = 1; i < count; i++) {
        double order = (double)(i > harmonics ? i - harmonics : i);
        /* The derivative of a cosine is a sine's coefficient, and the other way round. */
        double speed = i > harmonics ? -order * balance->z[i - harmonics] : order * balance->z[i + harmonics];
        double per_frequency = mass->damping * speed;
        double stiffness = -mass->mass * (order * frequency) * (order * frequency);
        double spring = mass->parallel * balance->period.coefficients[i], inertia = stiffness * balance->z[i];
        double damping = per_frequency * frequency;
        balance->residual[i] = spring + inertia + damping;
        balance->by_frequency[i] = 2.0 * inertia / frequency + per_frequency;
        balance->jacobian[i * count + i] += stiffness;
        if (i > harmonics)
            balance->jacobian[i * count + i - harmonics] -= mass->damping * frequency * order;
        else
            balance->jacobian[i * count + i + harmonics] += mass->damping * frequency * order;
        most = fmax(most, fmax(fabs(spring), fmax(fabs(inertia), fabs(damping))));
    }
    double forcing = mass->forcing + mass->forcing_by_square * frequency * frequency;
    balance->residual[1] -= forcing;
    balance->by_frequency[1] -= 2.0 * mass->forcing_by_square * frequency;
    /* The static part, which may be far larger, is balanced as finely. */
    balance->scale = fmax(most, fabs(forcing));
    balance->size = linear_largest(count, balance->residual);
    return 1;
}

/* The force on the mass is not taken from the second derivative of the motion, whose few harmonics would smear the
 * kinks of the springs' force. */
static BalancedMotion sum_up(const BalancedMass *mass, double frequency, const Balance *balance)
{
    const SpringPeriod *period = &balance->period;
    BalancedMotion motion = {.low = period->turns[0], .high = period->turns[0], .omega = period->omega[0]};
    for (size_t k = 1; k < balance->strokes; k++) {
        motion.low = fmin(motion.low, period->turns[k]);
        motion.high = fmax(motion.high, period->turns[k]);
    }
    const double *cosine = mass->basis.rows + mass->basis.samples;
    double damping = mass->damping * frequency * mass->series;
    for (size_t j = 0; j < mass->basis.samples; j++) {
        double push = mass->static_load + mass->force_on_mass * cosine[j] - mass->parallel * period->force[j] -
                      damping * period->rate[j];
        motion.push = fabs(push) > motion.push ? fabs(push) : motion.push;
    }
    return motion;
}

int balance_at(
    BalancedMass *mass, const double *z, double frequency, double *residual, double *jacobian, double *by_frequency,
    double *scale, BalancedMotion *motion)
{
    size_t count = fourier_size(&mass->basis);
    BalanceRoom room = lay_room(mass, z);
    if (!balance_motion(mass, frequency, &room, &room.here))
        return 0;
    memcpy(residual, room.here.residual, count * sizeof *residual);
    memcpy(jacobian, room.here.jacobian, count * count * sizeof *jacobian);
    memcpy(by_frequency, room.here.by_frequency, count * sizeof *by_frequency);
    *scale = room.here.scale;
    *motion = sum_up(mass, frequency, &room.here);
    return 1;
}

/* ---- Newton's method ---- */

/* A motion along room->step from here with a smaller residual, in room->there; 0 if there is none. */
static int descend(BalancedMass *mass, double frequency, BalanceRoom *room)
{
    size_t count = fourier_size(&mass->basis);
    double share = 1.0;
    for (int halving = 0; halving < HALVINGS; halving++, share *= 0.5) {
        for (size_t i = 0; i < count; i++)
            room->there.z[i] = room->here.z[i] + share * room->step[i];
        if (balance_motion(mass, frequency, room, &room->there) && room->there.size < room->here.size)
            return 1;
    }
    return 0;
}

/* The steady motion in room->here, from the motion room->here.z. Returns whether it has been found. */
static int newton(BalancedMass *mass, double frequency, BalanceRoom *room)
{
    size_t count = fourier_size(&mass->basis);
    if (!balance_motion(mass, frequency, room, &room->here))
        return 0;
    for (int step = 0; step < NEWTON_STEPS; step++) {
        if (room->here.size <= BALANCED * room->here.scale)
            return 1;
        memcpy(room->matrix, room->here.jacobian, count * count * sizeof *room->matrix);
        for (size_t i = 0; i < count; i++)
            room->step[i] = -room->here.residual[i];
        if (!linear_solve(count, room->matrix, room->step))
            return 0;
        if (!descend(mass, frequency, room))
            return room->here.size <= WITHIN_ROUNDING * room->here.scale;
        Balance kept = room->here;
        room->here = room->there;
        room->there = kept;
    }
    return 0;
}

int balance_solve(BalancedMass *mass, double frequency, double *z, BalancedMotion *motion)
{
    size_t count = fourier_size(&mass->basis);
    BalanceRoom room = lay_room(mass, z);
    if (!newton(mass, frequency, &room))
        return 0;
    memcpy(z, room.here.z, count * sizeof *z);
    *motion = sum_up(mass, frequency, &room.here);
    return 1;
}

/* ---- the sweep ---- */

/* Derivatives of the steady motion by ln(Omega), from the balance in room->here; 0 if they are infinite. */
static int find_tangent(const BalancedMass *mass, double frequency, BalanceRoom *room)
{
    size_t count = fourier_size(&mass->basis);
    memcpy(room->matrix, room->here.jacobian, count * count * sizeof *room->matrix);
    for (size_t i = 0; i < count; i++)
        room->tangent[i] = -frequency * room->here.by_frequency[i];
    return linear_solve(count, room->matrix, room->tangent);
}

/* The steady motion a step of ln(Omega) from room->last, in room->here, if it is near and where it was expected. */
static int step_ahead(BalancedMass *mass, double frequency, double step, BalanceRoom *room)
{
    size_t count = fourier_size(&mass->basis);
    double size = linear_norm(count - 1, room->last + 1);
    for (size_t i = 0; i < count; i++)
        room->guess[i] = room->last[i] + room->tangent[i] * step;
    if (!(linear_distance(count, room->guess, room->last) <= LARGEST_CHANGE * size))
        return 0;
    memcpy(room->here.z, room->guess, count * sizeof *room->guess);
    return newton(mass, frequency, room) &&
           linear_distance(count, room->here.z, room->last) <= LARGEST_CHANGE * size &&
           linear_distance(count, room->here.z, room->guess) <= LARGEST_SURPRISE * size;
}

/* From the steady motion in room->here at ln(Omega) = log to that at `target`, which replaces it if 1 is returned. */
static int reach(BalancedMass *mass, double log, double target, BalanceRoom *room)
{
    size_t count = fourier_size(&mass->basis);
    double finest = (target - log) / SWEEP_PARTS, step = target - log;
    int fresh = 1;
    while (log < target) {
        if (fresh) {
            memcpy(room->last, room->here.z, count * sizeof *room->last);
            if (!find_tangent(mass, exp(log), room))
                return 0;
        }
        double next = log + 1.5 * step > target ? target : log + step;
        fresh = step_ahead(mass, exp(next), next - log, room);
        if (fresh)
            log = next;
        else if ((step *= 0.5) < finest)
            return 0;
    }
    return 1;
}

size_t balance_sweep(
    BalancedMass *mass, double log, const double *z, size_t count, const double *logs, double low, double high,
    double *found, BalancedMotion *motions)
{
    size_t size = fourier_size(&mass->basis), reached = 0;
    BalanceRoom room = lay_room(mass, z);
    if (!balance_motion(mass, exp(log), &room, &room.here))
        return 0;
    while (reached < count && reach(mass, log, logs[reached], &room)) {
        log = logs[reached];
        memcpy(found + reached * size, room.here.z, size * sizeof *found);
        motions[reached] = sum_up(mass, exp(log), &room.here);
        reached++;
        if (motions[reached - 1].low < low || motions[reached - 1].high > high)
            break;
    }
    return reached;
}
