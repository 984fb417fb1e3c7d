/* Steady motions: Newton's method at one frequency, and sweeps. */
#include "balance_parts.h"

#include <math.h>
#include <string.h>

enum {
    NEWTON_STEPS = 40,
    HALVINGS = 8,    /* of a step of Newton's method */
    SWEEP_PARTS = 32 /* of the way to the next wanted frequency, at the finest */
};

static const double BALANCED = 1e-10;       /* of the largest term */
static const double FAST = 0.1;             /* by which a step with an earlier Jacobian must reduce the residual */
static const double WITHIN_ROUNDING = 1e-7; /* of the same: accepted where no step reduces the residual */
static const double LARGEST_CHANGE = 0.6;   /* of the motion's norm in one step of the sweep */
static const double LARGEST_SURPRISE = 0.3; /* of the same, between the motion and its prediction */

/* ---- Newton's method ---- */

/* Fills the balance in room->here, and room->matrix with its Jacobian. */
static int linearize(BalancedSystem *system, double frequency, BalanceRoom *room)
{
    room->is_factored = 0;
    return balance_motion(system, frequency, room, &room->here, room->matrix);
}

/* Solves Jacobian*x = -factor*right by that in room->matrix; 0 if there is no solution. */
static int solve_along(const BalancedSystem *system, BalanceRoom *room, double factor, const double *right, double *x)
{
    size_t size = balance_size(system);
    if (!room->is_factored && !linear_factor(size, room->matrix, room->order))
        return 0;
    room->is_factored = 1;
    for (size_t i = 0; i < size; i++)
        x[i] = -factor * right[i];
    linear_substitute(size, room->matrix, room->order, x);
    return 1;
}

/* A motion along room->step from here with a smaller residual takes its place; 0 if there is none. */
static int descend(BalancedSystem *system, double frequency, BalanceRoom *room)
{
    size_t size = balance_size(system);
    double share = 1.0;
    for (int halving = 0; halving < HALVINGS; halving++, share *= 0.5) {
        for (size_t i = 0; i < size; i++)
            room->there.z[i] = room->here.z[i] + share * room->step[i];
        if (balance_motion(system, frequency, room, &room->there, NULL) && room->there.size < room->here.size) {
            Balance kept = room->here;
            room->here = room->there;
            room->there = kept;
            return 1;
        }
    }
    return 0;
}

/* The steady motion in room->here, from the motion room->here.z. Returns whether it has been found. The Jacobian is that
 * of an earlier motion as long as it serves. */
static int newton(BalancedSystem *system, double frequency, BalanceRoom *room)
{
    int is_fresh = 1;
    if (!linearize(system, frequency, room))
        return 0;
    for (int step = 0; step < NEWTON_STEPS && room->here.size > BALANCED * room->here.scale; step++) {
        double before = room->here.size;
        if (!solve_along(system, room, 1.0, room->here.residual, room->step))
            return 0;
        int is_better = descend(system, frequency, room);
        if (!is_better && is_fresh)
            return before <= WITHIN_ROUNDING * room->here.scale;
        is_fresh = !(is_better && room->here.size <= FAST * before);
        if (is_fresh && room->here.size > BALANCED * room->here.scale && !linearize(system, frequency, room))
            return 0;
    }
    return room->here.size <= BALANCED * room->here.scale;
}

int balance_solve(BalancedSystem *system, double frequency, double *z, const BalancedMotion *motion)
{
    BalanceRoom room = balance_begin(system, z);
    if (!newton(system, frequency, &room))
        return 0;
    memcpy(z, room.here.z, balance_size(system) * sizeof *z);
    balance_hand_out(system, &room, motion, 0);
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
    size_t size = balance_size(system);
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
    /* Only rounding can make steps so small that more are needed. */
    for (int part = 0; log < target && part < 2 * SWEEP_PARTS; part++) {
        if (fresh) {
            memcpy(room->last, room->here.z, balance_size(system) * sizeof *room->last);
            double *kept = room->before;
            room->before = room->tangent;
            room->tangent = kept;
            if (!solve_along(system, room, exp(log), room->here.by_frequency, room->tangent))
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
    return !(log < target);
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
    size_t size = balance_size(system), reached = 0;
    BalanceRoom room = balance_begin(system, z);
    if (!linearize(system, exp(log), &room))
        return 0;
    /* That of the motion before, of which there is none. */
    memset(room.tangent, 0, size * sizeof *room.tangent);
    while (reached < count && reach(system, log, logs[reached], &room)) {
        log = logs[reached];
        memcpy(found + reached * size, room.here.z, size * sizeof *found);
        balance_hand_out(system, &room, motions, reached++);
        if (is_beyond(system, room.here.motion.of_axes))
            break;
    }
    return reached;
}
