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

static const double STILL = 1e-9;           /* of the largest motion: what moves less has its tangent stiffness */
static const double BALANCED = 1e-9;        /* of the largest term */
static const double WITHIN_ROUNDING = 1e-7; /* of the same: accepted where no step reduces the residual */
static const double LARGEST_CHANGE = 0.6;   /* of the motion's norm in one step of the sweep */
static const double LARGEST_SURPRISE = 0.3; /* of the same, between the motion and its prediction */

/* The balance of one motion; arrays as in balance.h. */
typedef struct {
    double *z, *residual, *jacobian, *by_frequency;
    BalancedMotion motion;
    double scale, size; /* size: largest entry of the residual [N] */
} Balance;

/* The parts of the workspace. */
typedef struct {
    Balance here, there;
    double *step, *guess, *last;           /* D*N each */
    double *tangent, *before;              /* D*N each: by ln(Omega), at the last motion and at the one before it */
    double way;                            /* of ln(Omega) between these; 0 if there is none before */
    double *matrix;                        /* D*N rows of D*N, lost in the elimination */
    double *moved, *sizes;                 /* displacement of each axis, M rows of N [m]; how far it moves, M [m] */
    double *product;                       /* N rows of N */
    double *stop, *stop_stiffness;         /* K each */
    SpringPeriod period;
    double *fourier, *periodic;
} BalanceRoom;

static size_t motion_size(const BalancedSystem *system)
{
    return system->degrees * fourier_size(&system->basis);
}

static size_t fourier_room(const FourierBasis *basis)
{
    return 2 * basis->samples + 2 * (3 * basis->harmonics + 1);
}

size_t balance_workspace(const BalancedSystem *system)
{
    size_t count = fourier_size(&system->basis), samples = system->basis.samples, size = motion_size(system);
    size_t balance = 3 * size + size * size + system->axes * BALANCED_OF_AXIS + system->degrees * samples;
    return 2 * balance + 5 * size + size * size + system->axes * (count + 1) + count * (2 * count + 1) + 7 * samples +
           fourier_room(&system->basis) + spring_periodic_workspace(system->basis.harmonics, samples);
}

static Balance lay_balance(const BalancedSystem *system, double **workspace)
{
    size_t size = motion_size(system);
    Balance balance = {
        .z = linear_taken(workspace, size),
        .residual = linear_taken(workspace, size),
        .jacobian = linear_taken(workspace, size * size),
        .by_frequency = linear_taken(workspace, size),
        .motion = {linear_taken(workspace, system->axes * BALANCED_OF_AXIS),
                   linear_taken(workspace, system->degrees * system->basis.samples)}};
    return balance;
}

/* z becomes the motion of `here`. */
static BalanceRoom lay_room(const BalancedSystem *system, const double *z)
{
    size_t count = fourier_size(&system->basis), samples = system->basis.samples, size = motion_size(system);
    double *workspace = system->workspace;
    BalanceRoom room = {
        .here = lay_balance(system, &workspace),
        .there = lay_balance(system, &workspace),
        .step = linear_taken(&workspace, size),
        .tangent = linear_taken(&workspace, size),
        .before = linear_taken(&workspace, size),
        .guess = linear_taken(&workspace, size),
        .last = linear_taken(&workspace, size),
        .matrix = linear_taken(&workspace, size * size),
        .moved = linear_taken(&workspace, system->axes * count),
        .sizes = linear_taken(&workspace, system->axes),
        .product = linear_taken(&workspace, count * count),
        .stop = linear_taken(&workspace, samples),
        .stop_stiffness = linear_taken(&workspace, samples),
        .period = {.displacement = linear_taken(&workspace, samples),
                   .rate = linear_taken(&workspace, samples),
                   .omega = linear_taken(&workspace, samples),
                   .force = linear_taken(&workspace, samples),
                   .turns = linear_taken(&workspace, samples),
                   .coefficients = linear_taken(&workspace, count),
                   .jacobian = linear_taken(&workspace, count * count)},
        .fourier = linear_taken(&workspace, fourier_room(&system->basis))};
    room.periodic = workspace;
    memcpy(room.here.z, z, size * sizeof *z);
    return room;
}

/* ---- axes ---- */

/* Fills the displacements of the axes; returns the size of the largest motion. */
static double move_axes(const BalancedSystem *system, const double *z, BalanceRoom *room)
{
    size_t count = fourier_size(&system->basis);
    double largest = 0.0;
    memset(room->moved, 0, system->axes * count * sizeof *room->moved);
    for (size_t m = 0; m < system->axes; m++) {
        const double *along = system->along + m * system->degrees;
        double *moved = room->moved + m * count;
        for (size_t d = 0; d < system->degrees; d++)
            for (size_t i = 0; i < count; i++)
                moved[i] += along[d] * z[d * count + i];
        room->sizes[m] = linear_norm(count - 1, moved + 1);
        largest = fmax(largest, room->sizes[m]);
    }
    return largest;
}

/* One spring that stands still: its tangent stiffness midway in its hysteresis. */
static void stand_still(const BalancedAxis *axis, const FourierBasis *basis, const double *c, SpringPeriod *period)
{
    size_t count = fourier_size(basis);
    double force, by_displacement, by_omega;
    spring_force_at(axis->law, 1, c, &(double){0.0}, &force, &by_displacement, &by_omega);
    double stiffness = by_displacement + axis->law->parameters.rho * by_omega;
    memset(period->jacobian, 0, count * count * sizeof *period->jacobian);
    for (size_t i = 0; i < count; i++) {
        period->coefficients[i] = i ? stiffness * c[i] : force;
        period->jacobian[i * count + i] = i ? stiffness : by_displacement;
    }
    fourier_samples(basis, c, period->displacement, period->rate);
    for (size_t j = 0; j < basis->samples; j++) {
        period->omega[j] = 0.0;
        period->force[j] = force + stiffness * (period->displacement[j] - c[0]);
    }
    period->turns[0] = c[0];
}

/* Adds the stops of an axis to its force and the derivatives of that. */
static void add_stops(const BalancedAxis *axis, const FourierBasis *basis, BalanceRoom *room)
{
    SpringPeriod *period = &room->period;
    size_t count = fourier_size(basis);
    for (size_t j = 0; j < basis->samples; j++) {
        double x = period->displacement[j], beyond = fmax(x - axis->stop_high, 0.0) + fmin(x - axis->stop_low, 0.0);
        room->stop[j] = axis->stop_stiffness * axis->series * beyond;
        room->stop_stiffness[j] = beyond != 0.0 ? axis->stop_stiffness : 0.0;
        period->force[j] += room->stop[j];
    }
    /* The turns are no longer needed. */
    fourier_coefficients(basis, room->stop, period->turns, room->fourier);
    for (size_t i = 0; i < count; i++)
        period->coefficients[i] += period->turns[i];
    fourier_product(basis, room->stop_stiffness, room->product, room->fourier);
    for (size_t i = 0; i < count * count; i++)
        period->jacobian[i] += room->product[i];
}

/* The force of an axis over a period in room->period, its derivatives by the displacement of the axis, and figures. */
static void axis_force(BalancedAxis *axis, const FourierBasis *basis, double *c, int is_still, BalanceRoom *room,
                       double *figures)
{
    SpringPeriod *period = &room->period;
    size_t count = fourier_size(basis), strokes = 1;
    for (size_t i = 0; i < count; i++)
        c[i] /= axis->series;
    c[0] += axis->position;
    if (!is_still)
        strokes = spring_periodic(axis->law, basis, c, &axis->start, room->periodic, period);
    if (is_still || strokes == 0)
        stand_still(axis, basis, c, period);
    figures[0] = figures[1] = period->turns[0];
    for (size_t k = 1; k < strokes; k++) {
        figures[0] = fmin(figures[0], period->turns[k]);
        figures[1] = fmax(figures[1], period->turns[k]);
    }
    figures[2] = period->omega[0];
    for (size_t j = 0; j < basis->samples; j++)
        period->force[j] *= axis->parallel;
    for (size_t i = 0; i < count; i++)
        period->coefficients[i] *= axis->parallel;
    for (size_t i = 0; i < count * count; i++)
        period->jacobian[i] *= axis->parallel / axis->series;
    if (figures[0] < axis->stop_low || figures[1] > axis->stop_high)
        add_stops(axis, basis, room);
    figures[3] = period->coefficients[1];
    figures[4] = period->coefficients[1 + basis->harmonics];
}

/* Adds the force of an axis to that on the coordinates. */
static void add_axis(const BalancedSystem *system, const double *along, const SpringPeriod *period, Balance *balance)
{
    size_t count = fourier_size(&system->basis), samples = system->basis.samples, size = motion_size(system);
    for (size_t d = 0; d < system->degrees; d++) {
        if (along[d] == 0.0)
            continue;
        for (size_t j = 0; j < samples; j++)
            balance->motion.force[d * samples + j] += along[d] * period->force[j];
        for (size_t i = 0; i < count; i++)
            balance->residual[d * count + i] += along[d] * period->coefficients[i];
        for (size_t e = 0; e < system->degrees; e++) {
            double share = along[d] * along[e];
            for (size_t i = 0; share != 0.0 && i < count; i++) {
                double *row = balance->jacobian + (d * count + i) * size + e * count;
                for (size_t j = 0; j < count; j++)
                    row[j] += share * period->jacobian[i * count + j];
            }
        }
    }
}

/* ---- one balance ---- */

/* The coefficient of a series' derivative by the phase: that of a cosine is of a sine, and the other way round. */
static double speed_of(size_t harmonics, const double *c, size_t i)
{
    return i == 0 ? 0.0 : i > harmonics ? -(double)(i - harmonics) * c[i - harmonics] : (double)i * c[i + harmonics];
}

/* Adds the linear forces on a coordinate, those of the axes being there; returns the largest term that moves. */
static double add_linear(const BalancedSystem *system, double frequency, size_t coordinate, Balance *balance)
{
    size_t harmonics = system->basis.harmonics, count = fourier_size(&system->basis), size = motion_size(system);
    const double *damping = system->damping + coordinate * system->degrees;
    const double *stiffness = system->stiffness + coordinate * system->degrees;
    double most = 0.0;
    for (size_t i = 0, row = coordinate * count; i < count; i++, row++) {
        double order = (double)(i > harmonics ? i - harmonics : i);
        double spring = balance->residual[row], per_frequency = 0.0;
        double *jacobian = balance->jacobian + row * size;
        for (size_t d = 0; d < system->degrees; d++) {
            const double *z = balance->z + d * count;
            spring += stiffness[d] * z[i];
            per_frequency += damping[d] * speed_of(harmonics, z, i);
            jacobian[d * count + i] += stiffness[d];
            if (i > harmonics)
                jacobian[d * count + i - harmonics] -= damping[d] * frequency * order;
            else if (i > 0)
                jacobian[d * count + i + harmonics] += damping[d] * frequency * order;
        }
        double inertia_per_length = -system->mass * (order * frequency) * (order * frequency);
        double inertia = inertia_per_length * balance->z[row], damped = per_frequency * frequency;
        jacobian[row] += inertia_per_length;
        balance->residual[row] = spring + inertia + damped;
        balance->by_frequency[row] = 2.0 * inertia / frequency + per_frequency;
        if (i > 0)
            most = fmax(most, fmax(fabs(spring), fmax(fabs(inertia), fabs(damped))));
    }
    return most;
}

/* Fills the balance of the motion balance->z; returns 0 if it does not move. */
static int balance_motion(BalancedSystem *system, double frequency, BalanceRoom *room, Balance *balance)
{
    size_t count = fourier_size(&system->basis), size = motion_size(system), degrees = system->degrees;
    double largest = move_axes(system, balance->z, room), squared = frequency * frequency;
    if (!(largest > 0.0))
        return 0;
    memset(balance->residual, 0, size * sizeof *balance->residual);
    memset(balance->jacobian, 0, size * size * sizeof *balance->jacobian);
    memset(balance->motion.force, 0, degrees * system->basis.samples * sizeof *balance->motion.force);
    for (size_t m = 0; m < system->axes; m++) {
        axis_force(&system->axis[m], &system->basis, room->moved + m * count, room->sizes[m] <= STILL * largest, room,
                   balance->motion.of_axes + m * BALANCED_OF_AXIS);
        add_axis(system, system->along + m * degrees, &room->period, balance);
    }
    balance->scale = 0.0;
    for (size_t d = 0; d < degrees; d++) {
        const double *forcing = system->forcing + d;
        double by_square = forcing[degrees] * squared, by_inverse = forcing[2 * degrees] / squared;
        double amplitude = forcing[0] + by_square + by_inverse;
        balance->scale = fmax(balance->scale, add_linear(system, frequency, d, balance));
        balance->residual[d * count] -= system->load[d];
        balance->residual[d * count + 1] -= amplitude;
        balance->by_frequency[d * count + 1] -= 2.0 * (by_square - by_inverse) / frequency;
        /* The static part, which may be far larger, is balanced as finely. */
        balance->scale = fmax(balance->scale, fabs(amplitude));
    }
    balance->size = linear_largest(size, balance->residual);
    return 1;
}

/* Hands out what the motion in room->here is besides its coefficients, as the motion of a number. */
static void hand_out(const BalancedSystem *system, const BalanceRoom *room, const BalancedMotion *motion, size_t number)
{
    size_t of_axes = system->axes * BALANCED_OF_AXIS, samples = system->degrees * system->basis.samples;
    memcpy(motion->of_axes + number * of_axes, room->here.motion.of_axes, of_axes * sizeof *motion->of_axes);
    memcpy(motion->force + number * samples, room->here.motion.force, samples * sizeof *motion->force);
}

int balance_at(
    BalancedSystem *system, const double *z, double frequency, double *residual, double *jacobian,
    double *by_frequency, double *scale, const BalancedMotion *motion)
{
    size_t size = motion_size(system);
    BalanceRoom room = lay_room(system, z);
    if (!balance_motion(system, frequency, &room, &room.here))
        return 0;
    memcpy(residual, room.here.residual, size * sizeof *residual);
    memcpy(jacobian, room.here.jacobian, size * size * sizeof *jacobian);
    memcpy(by_frequency, room.here.by_frequency, size * sizeof *by_frequency);
    *scale = room.here.scale;
    hand_out(system, &room, motion, 0);
    return 1;
}

/* ---- Newton's method ---- */

/* A motion along room->step from here with a smaller residual, in room->there; 0 if there is none. */
static int descend(BalancedSystem *system, double frequency, BalanceRoom *room)
{
    size_t size = motion_size(system);
    double share = 1.0;
    for (int halving = 0; halving < HALVINGS; halving++, share *= 0.5) {
        for (size_t i = 0; i < size; i++)
            room->there.z[i] = room->here.z[i] + share * room->step[i];
        if (balance_motion(system, frequency, room, &room->there) && room->there.size < room->here.size)
            return 1;
    }
    return 0;
}

/* Solves jacobian*x = -factor*right of the balance in room->here; 0 if there is no solution. */
static int solve_here(const BalancedSystem *system, BalanceRoom *room, double factor, const double *right, double *x)
{
    size_t size = motion_size(system);
    memcpy(room->matrix, room->here.jacobian, size * size * sizeof *room->matrix);
    for (size_t i = 0; i < size; i++)
        x[i] = -factor * right[i];
    return linear_solve(size, room->matrix, x);
}

/* The steady motion in room->here, from the motion room->here.z. Returns whether it has been found. */
static int newton(BalancedSystem *system, double frequency, BalanceRoom *room)
{
    if (!balance_motion(system, frequency, room, &room->here))
        return 0;
    for (int step = 0; step < NEWTON_STEPS; step++) {
        if (room->here.size <= BALANCED * room->here.scale)
            return 1;
        if (!solve_here(system, room, 1.0, room->here.residual, room->step))
            return 0;
        if (!descend(system, frequency, room))
            return room->here.size <= WITHIN_ROUNDING * room->here.scale;
        Balance kept = room->here;
        room->here = room->there;
        room->there = kept;
    }
    return 0;
}

int balance_solve(BalancedSystem *system, double frequency, double *z, const BalancedMotion *motion)
{
    BalanceRoom room = lay_room(system, z);
    if (!newton(system, frequency, &room))
        return 0;
    memcpy(z, room.here.z, motion_size(system) * sizeof *z);
    hand_out(system, &room, motion, 0);
    return 1;
}

/* ---- the sweep ---- */

/* The norm of a motion about its mean. */
static double norm_of(const BalancedSystem *system, const double *z)
{
    size_t count = fourier_size(&system->basis);
    double total = 0.0;
    for (size_t d = 0; d < system->degrees; d++)
        total = hypot(total, linear_norm(count - 1, z + d * count + 1));
    return total;
}

/* The steady motion a step of ln(Omega) from room->last, in room->here, if it is near and where it was expected. */
static int step_ahead(BalancedSystem *system, double frequency, double step, BalanceRoom *room)
{
    size_t size = motion_size(system);
    double norm = norm_of(system, room->last), bend = room->way > 0.0 ? 0.5 * step * step / room->way : 0.0;
    for (size_t i = 0; i < size; i++)
        room->guess[i] = room->last[i] + room->tangent[i] * step + (room->tangent[i] - room->before[i]) * bend;
    if (!(linear_distance(size, room->guess, room->last) <= LARGEST_CHANGE * norm))
        return 0;
    memcpy(room->here.z, room->guess, size * sizeof *room->guess);
    return newton(system, frequency, room) &&
           linear_distance(size, room->here.z, room->last) <= LARGEST_CHANGE * norm &&
           linear_distance(size, room->here.z, room->guess) <= LARGEST_SURPRISE * norm;
}

/* From the steady motion in room->here at ln(Omega) = log to that at `target`, which replaces it if 1 is returned. */
static int reach(BalancedSystem *system, double log, double target, BalanceRoom *room)
{
    double finest = (target - log) / SWEEP_PARTS, step = target - log;
    int fresh = 1;
    while (log < target) {
        if (fresh) {
            memcpy(room->last, room->here.z, motion_size(system) * sizeof *room->last);
            double *kept = room->before;
            room->before = room->tangent;
            room->tangent = kept;
            if (!solve_here(system, room, exp(log), room->here.by_frequency, room->tangent))
                return 0;
        }
        double next = log + 1.5 * step > target ? target : log + step;
        fresh = step_ahead(system, exp(next), next - log, room);
        if (fresh) {
            room->way = next - log;
            log = next;
        } else if ((step *= 0.5) < finest)
            return 0;
    }
    return 1;
}

static int is_beyond(const BalancedSystem *system, const double *of_axes)
{
    for (size_t m = 0; m < system->axes; m++, of_axes += BALANCED_OF_AXIS)
        if (of_axes[0] < system->axis[m].low || of_axes[1] > system->axis[m].high)
            return 1;
    return 0;
}

size_t balance_sweep(
    BalancedSystem *system, double log, const double *z, size_t count, const double *logs, double *found,
    const BalancedMotion *motions)
{
    size_t size = motion_size(system), reached = 0;
    BalanceRoom room = lay_room(system, z);
    if (!balance_motion(system, exp(log), &room, &room.here))
        return 0;
    /* That of the motion before, of which there is none. */
    memset(room.tangent, 0, size * sizeof *room.tangent);
    while (reached < count && reach(system, log, logs[reached], &room)) {
        log = logs[reached];
        memcpy(found + reached * size, room.here.z, size * sizeof *found);
        hand_out(system, &room, motions, reached++);
        if (is_beyond(system, room.here.motion.of_axes))
            break;
    }
    return reached;
}
