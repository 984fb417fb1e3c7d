#include "balance_parts.h"

#include <math.h>
#include <string.h>

static const double STILL = 1e-9; /* of the largest motion: what moves less has its tangent stiffness */

size_t balance_size(const BalancedSystem *system)
{
    return system->degrees * fourier_size(&system->basis);
}

static int is_zero(size_t count, const double *values)
{
    for (size_t i = 0; i < count; i++)
        if (values[i] != 0.0)
            return 0;
    return 1;
}

static Balance lay_balance(const BalancedSystem *system, Workspace *workspace)
{
    size_t size = balance_size(system);
    Balance balance = {
        .z = linear_taken(workspace, size),
        .residual = linear_taken(workspace, size),
        .by_frequency = linear_taken(workspace, size),
        .motion = {linear_taken(workspace, system->axes * BALANCED_OF_AXIS),
                   linear_taken(workspace, system->degrees * system->basis.samples)}};
    return balance;
}

static BalanceRoom lay_room(const BalancedSystem *system, Workspace *workspace)
{
    size_t count = fourier_size(&system->basis), samples = system->basis.samples, size = balance_size(system);
    size_t degrees = system->degrees, signals = degrees * samples, spans = 2 * samples;
    return (BalanceRoom){
        .here = lay_balance(system, workspace),
        .there = lay_balance(system, workspace),
        .step = linear_taken(workspace, size),
        .tangent = linear_taken(workspace, size),
        .before = linear_taken(workspace, size),
        .guess = linear_taken(workspace, size),
        .last = linear_taken(workspace, size),
        .matrix = linear_taken(workspace, size * size),
        .order = (size_t *)linear_taken(workspace, size),
        .moved = linear_taken(workspace, system->axes * count),
        .sizes = linear_taken(workspace, system->axes),
        .values = linear_taken(workspace, signals),
        .rates = linear_taken(workspace, signals),
        .products = linear_taken(workspace, degrees * count * count),
        .gradient = linear_taken(workspace, signals),
        .turning = linear_taken(workspace, signals),
        .stiffness = linear_taken(workspace, degrees * signals),
        .damping = linear_taken(workspace, degrees * signals),
        .is_coupled = linear_taken(workspace, degrees * degrees),
        .damped = linear_taken(workspace, signals),
        .column = linear_taken(workspace, size),
        .row = linear_taken(workspace, size),
        .is_bent = !is_zero(system->axes * degrees * degrees, system->bend),
        .product = linear_taken(workspace, count * count),
        .memory = linear_taken(workspace, samples),
        .signal = linear_taken(workspace, samples),
        .period = {.displacement = linear_taken(workspace, samples),
                   .rate = linear_taken(workspace, samples),
                   .omega = linear_taken(workspace, samples),
                   .force = linear_taken(workspace, samples),
                   .stiffness = linear_taken(workspace, samples),
                   .memory = linear_taken(workspace, samples),
                   .turns = linear_taken(workspace, samples),
                   .inherited = linear_taken(workspace, samples * count),
                   .spans = (Span *)linear_taken(workspace, spans * (sizeof(Span) / sizeof(double)))},
        .fourier = linear_taken(workspace, fourier_workspace(&system->basis)),
        .periodic = linear_taken(workspace, spring_periodic_workspace(system->basis.harmonics, samples))};
}

size_t balance_workspace(const BalancedSystem *system)
{
    Workspace counted = {.taken = 0};
    (void)lay_room(system, &counted);
    return counted.taken;
}

BalanceRoom balance_begin(const BalancedSystem *system, const double *z)
{
    BalanceRoom room = lay_room(system, &(Workspace){.memory = system->workspace});
    memcpy(room.here.z, z, balance_size(system) * sizeof *z);
    return room;
}

/* ---- axes ---- */

/* a += factor*b */
static void add_signal(size_t count, double factor, const double *b, double *a)
{
    for (size_t j = 0; j < count; j++)
        a[j] += factor * b[j];
}

/* a += b*c */
static void add_product(size_t count, const double *b, const double *c, double *a)
{
    for (size_t j = 0; j < count; j++)
        a[j] += b[j] * c[j];
}

/* Sum of b*c_k over the coordinates k, where b is a row of an axis' second derivatives and c has rows of `count`. */
static void bend(const BalancedSystem *system, const double *b, size_t count, const double *c, double *sum)
{
    for (size_t k = 0; k < system->degrees; k++)
        if (b[k] != 0.0)
            add_signal(count, b[k], c + k * count, sum);
}

/* Row d of the second derivatives of an axis. */
static const double *bend_of(const BalancedSystem *system, size_t axis, size_t d)
{
    return system->bend + (axis * system->degrees + d) * system->degrees;
}

/* Whether an axis has nothing to do with a coordinate. */
static int is_apart(const BalancedSystem *system, size_t axis, size_t d)
{
    return system->along[axis * system->degrees + d] == 0.0 && is_zero(system->degrees, bend_of(system, axis, d));
}

/* Fills the gradient of an axis over the period. */
static void take_gradient(const BalancedSystem *system, size_t axis, BalanceRoom *room)
{
    size_t samples = system->basis.samples;
    for (size_t d = 0; d < system->degrees; d++) {
        double along = system->along[axis * system->degrees + d], *gradient = room->gradient + d * samples;
        for (size_t j = 0; j < samples; j++)
            gradient[j] = along;
        bend(system, bend_of(system, axis, d), samples, room->values, gradient);
    }
}

/* Fills the coordinates over the period and, if asked for, products with them, and the displacements of the axes;
 * returns the size of the largest motion. */
static double move_axes(const BalancedSystem *system, const double *z, int with_products, BalanceRoom *room)
{
    const FourierBasis *basis = &system->basis;
    size_t count = fourier_size(basis), samples = basis->samples;
    double largest = 0.0, *displacement = room->period.displacement;
    for (size_t d = 0; d < system->degrees; d++) {
        double *values = room->values + d * samples;
        fourier_samples(basis, z + d * count, values, room->rates + d * samples, room->fourier);
        if (room->is_bent && with_products)
            fourier_product(basis, values, room->products + d * count * count, room->fourier);
    }
    for (size_t m = 0; m < system->axes; m++) {
        const double *along = system->along + m * system->degrees;
        double *moved = room->moved + m * count;
        /* q.Hq/2, and a.q without the rounding of samples. */
        memset(displacement, 0, samples * sizeof *displacement);
        memset(room->turning, 0, system->degrees * samples * sizeof *room->turning);
        for (size_t d = 0; room->is_bent && d < system->degrees; d++) {
            bend(system, bend_of(system, m, d), samples, room->values, room->turning + d * samples);
            for (size_t j = 0; j < samples; j++)
                displacement[j] += 0.5 * room->turning[d * samples + j] * room->values[d * samples + j];
        }
        fourier_coefficients(basis, displacement, moved, room->fourier);
        for (size_t d = 0; d < system->degrees; d++)
            add_signal(count, along[d], z + d * count, moved);
        room->sizes[m] = linear_norm(count - 1, moved + 1);
        largest = fmax(largest, room->sizes[m]);
    }
    return largest;
}

/* One spring that stands still: its tangent stiffness midway in its hysteresis, about its mean that of its force. */
static void stand_still(const BalancedAxis *axis, const FourierBasis *basis, const double *c, BalanceRoom *room)
{
    SpringPeriod *period = &room->period;
    double force, by_displacement, by_omega;
    spring_force_at(axis->law, 1, c, &(double){0.0}, &force, &by_displacement, &by_omega);
    double stiffness = by_displacement + axis->law->parameters.rho * by_omega;
    fourier_samples(basis, c, period->displacement, period->rate, room->fourier);
    for (size_t j = 0; j < basis->samples; j++) {
        period->omega[j] = 0.0;
        period->force[j] = force + stiffness * (period->displacement[j] - c[0]);
        period->stiffness[j] = stiffness;
        period->memory[j] = by_displacement - stiffness;
    }
    period->turns[0] = c[0];
    period->spans[0] = (Span){0, basis->samples};
    period->spans[1] = (Span){0, 0};
    memset(period->inherited, 0, fourier_size(basis) * sizeof *period->inherited);
    period->inherited[0] = 1.0;
}

/* The force of an axis over a period in room->period, its derivatives by the displacement of the axis, and figures;
 * without the damper. Returns the number of strokes. */
static size_t axis_force(BalancedAxis *axis, const FourierBasis *basis, double *c, int is_still, BalanceRoom *room,
                         double *figures)
{
    SpringPeriod *period = &room->period;
    size_t count = fourier_size(basis), strokes = 0;
    for (size_t i = 0; i < count; i++)
        c[i] /= axis->series;
    c[0] += axis->position;
    if (!is_still)
        strokes = spring_periodic(axis->law, basis, c, &axis->start, room->periodic, period);
    if (strokes == 0) {
        stand_still(axis, basis, c, room);
        strokes = 1;
    }
    figures[0] = figures[1] = period->turns[0];
    for (size_t k = 1; k < strokes; k++) {
        figures[0] = fmin(figures[0], period->turns[k]);
        figures[1] = fmax(figures[1], period->turns[k]);
    }
    figures[2] = period->omega[0];
    for (size_t j = 0; j < basis->samples; j++) {
        double x = period->displacement[j], beyond = fmax(x - axis->stop_high, 0.0) + fmin(x - axis->stop_low, 0.0);
        period->force[j] = axis->parallel * period->force[j] + axis->stop_stiffness * axis->series * beyond;
        period->stiffness[j] = axis->parallel / axis->series * period->stiffness[j];
        period->stiffness[j] += beyond != 0.0 ? axis->stop_stiffness : 0.0;
        period->memory[j] *= axis->parallel / axis->series;
    }
    return strokes;
}

/* Adds the damper of an axis to its force and, if asked for, to the derivatives of the forces on the coordinates. */
static void add_damper(const BalancedSystem *system, size_t m, double frequency, int with_jacobian, BalanceRoom *room)
{
    const BalancedAxis *axis = system->axis + m;
    size_t samples = system->basis.samples, degrees = system->degrees;
    double *rate = room->period.rate;
    for (size_t j = 0; j < samples; j++) {
        rate[j] *= axis->damping * axis->series;
        room->period.force[j] += frequency * rate[j];
    }
    memset(room->turning, 0, degrees * samples * sizeof *room->turning);
    for (size_t d = 0; d < degrees; d++) {
        bend(system, bend_of(system, m, d), samples, room->rates, room->turning + d * samples);
        add_product(samples, room->gradient + d * samples, rate, room->damped + d * samples);
    }
    for (size_t d = 0; with_jacobian && d < degrees; d++)
        for (size_t e = 0; e < degrees && !is_apart(system, m, d); e++) {
            if (is_apart(system, m, e))
                continue;
            const double *here = room->gradient + d * samples, *gradient = room->gradient + e * samples;
            const double *turning = room->turning + e * samples;
            double *stiffness = room->stiffness + (d * degrees + e) * samples;
            double *damping = room->damping + (d * degrees + e) * samples, factor = axis->damping * frequency;
            for (size_t j = 0; j < samples; j++) {
                damping[j] += factor * here[j] * gradient[j];
                stiffness[j] += factor * here[j] * turning[j];
            }
        }
}

/* The dynamic stiffness of the branches of one spring. */
static SpringDynamic dynamic_of(const BalancedAxis *axis, double frequency)
{
    SpringDynamic sum = {0};
    for (size_t j = 0; j < axis->branches; j++) {
        SpringDynamic one = spring_maxwell_dynamic(axis->time_constant[j], frequency);
        double stiffness = axis->branch_stiffness[j];
        sum.storage += stiffness * one.storage;
        sum.loss += stiffness * one.loss;
        sum.storage_slope += stiffness * one.storage_slope;
        sum.loss_slope += stiffness * one.loss_slope;
    }
    return sum;
}

/* The force of the branches at one order, from the coefficients of the displacement there. */
static void add_order(double storage, double loss, double cosine, double sine, double *of_cosine, double *of_sine)
{
    *of_cosine = storage * cosine + loss * sine;
    *of_sine = storage * sine - loss * cosine;
}

/* Adds the branches of an axis to its force, and to the derivatives of the forces on the coordinates: by the coordinates
 * as if its direction stayed the same, unless `jacobian` is NULL, and by Omega. */
static void add_branches(const BalancedSystem *system, size_t m, double frequency, BalanceRoom *room, double *jacobian)
{
    const BalancedAxis *axis = system->axis + m;
    const FourierBasis *basis = &system->basis;
    size_t harmonics = basis->harmonics, count = fourier_size(basis), samples = basis->samples;
    size_t size = balance_size(system), degrees = system->degrees;
    const double *c = room->moved + m * count, *along = system->along + m * degrees;
    double *force = room->column, *slope = room->row, *values = room->turning, *unused = room->period.memory;
    force[0] = slope[0] = 0.0;
    for (size_t k = 1; k <= harmonics; k++) {
        double order = (double)k, scale = axis->parallel / axis->series;
        SpringDynamic at = dynamic_of(axis, order * frequency);
        add_order(axis->parallel * at.storage, axis->parallel * at.loss, c[k], c[harmonics + k], &force[k],
                  &force[harmonics + k]);
        add_order(order * axis->parallel * at.storage_slope, order * axis->parallel * at.loss_slope, c[k],
                  c[harmonics + k], &slope[k], &slope[harmonics + k]);
        for (size_t d = 0; jacobian != NULL && d < degrees; d++)
            for (size_t e = 0; e < degrees; e++) {
                double storage = scale * along[d] * along[e] * at.storage, loss = scale * along[d] * along[e] * at.loss;
                double *row = jacobian + (d * count + k) * size + e * count, *other = row + harmonics * size;
                row[k] += storage;
                row[harmonics + k] += loss;
                other[k] -= loss;
                other[harmonics + k] += storage;
            }
    }
    fourier_samples(basis, force, values, unused, room->fourier);
    add_signal(samples, 1.0, values, room->period.force);
    fourier_samples(basis, slope, values, unused, room->fourier);
    for (size_t d = 0; d < degrees; d++)
        add_product(samples, room->gradient + d * samples, values, room->damped + d * samples);
}

/* Adds the force of an axis to that on the coordinates, and its derivatives, if asked for, but those of the strokes. */
static void add_axis(const BalancedSystem *system, size_t m, int with_jacobian, BalanceRoom *room, Balance *balance)
{
    size_t samples = system->basis.samples, degrees = system->degrees;
    const SpringPeriod *period = &room->period;
    for (size_t d = 0; d < degrees; d++) {
        if (is_apart(system, m, d))
            continue;
        const double *here = room->gradient + d * samples, *bent = bend_of(system, m, d);
        add_product(samples, here, period->force, balance->motion.force + d * samples);
        for (size_t j = 0; j < samples; j++)
            room->signal[j] = here[j] * period->stiffness[j];
        for (size_t e = 0; with_jacobian && e < degrees; e++) {
            if (is_apart(system, m, e))
                continue;
            double *stiffness = room->stiffness + (d * degrees + e) * samples;
            add_product(samples, room->signal, room->gradient + e * samples, stiffness);
            if (bent[e] != 0.0)
                add_signal(samples, bent[e], period->force, stiffness);
            room->is_coupled[d * degrees + e] = 1.0;
        }
    }
}

/* Fills column and row of a stroke, whose product is what the forces owe to its beginning. */
static void take_stroke(const BalancedSystem *system, size_t m, size_t stroke, BalanceRoom *room)
{
    const FourierBasis *basis = &system->basis;
    size_t count = fourier_size(basis), degrees = system->degrees, samples = basis->samples;
    double *column = room->column, *row = room->row;
    memset(column, 0, degrees * count * sizeof *column);
    memset(row, 0, degrees * count * sizeof *row);
    const double *inherited = room->period.inherited + stroke * count;
    double *projected = room->signal, *turned = room->fourier, *turned_row = turned + count;
    memset(room->memory, 0, samples * sizeof *room->memory);
    for (const Span *span = room->period.spans + 2 * stroke; span < room->period.spans + 2 * stroke + 2; span++)
        memcpy(room->memory + span->from, room->period.memory + span->from, (span->to - span->from) * sizeof(double));
    fourier_coefficients(basis, room->memory, projected, room->fourier);
    for (size_t d = 0; d < degrees; d++) {
        double along = system->along[m * degrees + d];
        add_signal(count, along, projected, column + d * count);
        add_signal(count, along, inherited, row + d * count);
    }
    for (size_t k = 0; k < degrees; k++) {
        const double *bent = bend_of(system, m, k), *product = room->products + k * count * count;
        if (is_zero(degrees, bent))
            continue;
        memset(turned_row, 0, count * sizeof *turned_row);
        for (size_t i = 0; i < count; i++) {
            turned[i] = linear_dot(count, product + i * count, projected);
            add_signal(count, inherited[i], product + i * count, turned_row);
        }
        for (size_t d = 0; d < degrees; d++)
            if (bent[d] != 0.0) {
                add_signal(count, bent[d], turned, column + d * count);
                add_signal(count, bent[d], turned_row, row + d * count);
            }
    }
}

/* Adds to the Jacobian what the forces owe to the beginnings of the strokes of an axis. */
static void add_strokes(const BalancedSystem *system, size_t m, size_t strokes, BalanceRoom *room, double *jacobian)
{
    size_t count = fourier_size(&system->basis), size = balance_size(system), degrees = system->degrees;
    for (size_t stroke = 0; stroke < strokes; stroke++) {
        take_stroke(system, m, stroke, room);
        for (size_t d = 0; d < degrees; d++)
            for (size_t e = 0; e < degrees && !is_apart(system, m, d); e++) {
                if (is_apart(system, m, e))
                    continue;
                for (size_t i = d * count; i < (d + 1) * count; i++)
                    add_signal(count, room->column[i], room->row + e * count, jacobian + i * size + e * count);
            }
    }
}

/* ---- one balance ---- */

/* Adds a product, by another coordinate or by its derivative, to the block of a coordinate's force. */
static void add_block(const BalancedSystem *system, const double *product, int by_rate, size_t d, size_t e,
                      double *jacobian)
{
    size_t harmonics = system->basis.harmonics, count = fourier_size(&system->basis), size = balance_size(system);
    for (size_t i = 0; i < count; i++, product += count) {
        double *row = jacobian + (d * count + i) * size + e * count;
        if (!by_rate)
            add_signal(count, 1.0, product, row);
        for (size_t k = 1; by_rate && k <= harmonics; k++) {
            row[harmonics + k] += (double)k * product[k];
            row[k] -= (double)k * product[harmonics + k];
        }
    }
}

/* Adds the derivatives of the forces by the coordinates, which are symmetric without dampers, and by their rates. */
static void add_couplings(const BalancedSystem *system, int has_dampers, BalanceRoom *room, double *jacobian)
{
    size_t degrees = system->degrees, samples = system->basis.samples;
    for (size_t d = 0; d < degrees; d++)
        for (size_t e = has_dampers ? 0 : d; e < degrees; e++) {
            size_t pair = d * degrees + e;
            if (room->is_coupled[pair] == 0.0)
                continue;
            fourier_product(&system->basis, room->stiffness + pair * samples, room->product, room->fourier);
            add_block(system, room->product, 0, d, e, jacobian);
            if (!has_dampers && d != e)
                add_block(system, room->product, 0, e, d, jacobian);
            if (!has_dampers)
                continue;
            fourier_product(&system->basis, room->damping + pair * samples, room->product, room->fourier);
            add_block(system, room->product, 1, d, e, jacobian);
        }
}

/* Adds inertia to the forces on a coordinate, those of the axes being there; returns the largest term that moves. */
static double add_inertia(const BalancedSystem *system, double frequency, size_t coordinate, double *jacobian,
                          Balance *balance)
{
    size_t harmonics = system->basis.harmonics, count = fourier_size(&system->basis), size = balance_size(system);
    double most = 0.0;
    for (size_t i = 1, row = coordinate * count + 1; i < count; i++, row++) {
        double order = (double)(i > harmonics ? i - harmonics : i);
        double per_length = -system->mass * (order * frequency) * (order * frequency);
        double inertia = per_length * balance->z[row];
        most = fmax(most, fmax(fabs(balance->residual[row]), fabs(inertia)));
        if (jacobian != NULL)
            jacobian[row * size + row] += per_length;
        balance->residual[row] += inertia;
        balance->by_frequency[row] += 2.0 * inertia / frequency;
    }
    return most;
}

int balance_motion(
    BalancedSystem *system, double frequency, BalanceRoom *room, Balance *balance, double *jacobian)
{
    const FourierBasis *basis = &system->basis;
    size_t count = fourier_size(basis), size = balance_size(system), degrees = system->degrees;
    size_t samples = basis->samples, signals = degrees * samples;
    int has_dampers = 0, with_jacobian = jacobian != NULL;
    double largest = move_axes(system, balance->z, with_jacobian, room), squared = frequency * frequency;
    if (!(largest > 0.0))
        return 0;
    memset(balance->motion.force, 0, signals * sizeof *balance->motion.force);
    memset(room->damped, 0, signals * sizeof *room->damped);
    if (with_jacobian) {
        memset(jacobian, 0, size * size * sizeof *jacobian);
        memset(room->stiffness, 0, degrees * signals * sizeof *room->stiffness);
        memset(room->damping, 0, degrees * signals * sizeof *room->damping);
        memset(room->is_coupled, 0, degrees * degrees * sizeof *room->is_coupled);
    }
    for (size_t m = 0; m < system->axes; m++) {
        double *figures = balance->motion.of_axes + m * BALANCED_OF_AXIS, cosines[2], sines[2];
        size_t strokes = axis_force(&system->axis[m], basis, room->moved + m * count,
                                    room->sizes[m] <= STILL * largest, room, figures);
        take_gradient(system, m, room);
        if (with_jacobian)
            add_strokes(system, m, strokes, room, jacobian);
        if (system->axis[m].branches > 0)
            add_branches(system, m, frequency, room, jacobian);
        if (system->axis[m].damping != 0.0) {
            has_dampers = 1;
            add_damper(system, m, frequency, with_jacobian, room);
        }
        add_axis(system, m, with_jacobian, room, balance);
        fourier_sums(basis, room->period.force, 1, cosines, sines, room->fourier);
        figures[3] = 2.0 / (double)samples * cosines[1];
        figures[4] = 2.0 / (double)samples * sines[1];
    }
    if (with_jacobian)
        add_couplings(system, has_dampers, room, jacobian);
    balance->scale = 0.0;
    for (size_t d = 0; d < degrees; d++) {
        const double *forcing = system->forcing + d;
        double by_square = forcing[degrees] * squared, amplitude = forcing[0] + by_square;
        fourier_coefficients(basis, balance->motion.force + d * samples, balance->residual + d * count, room->fourier);
        fourier_coefficients(basis, room->damped + d * samples, balance->by_frequency + d * count, room->fourier);
        balance->scale = fmax(balance->scale, add_inertia(system, frequency, d, jacobian, balance));
        balance->residual[d * count] -= system->load[d];
        balance->residual[d * count + 1] -= amplitude;
        balance->by_frequency[d * count + 1] -= 2.0 * by_square / frequency;
        /* The static part, which may be far larger, is balanced as finely. */
        balance->scale = fmax(balance->scale, fabs(amplitude));
    }
    balance->size = linear_largest(size, balance->residual);
    return 1;
}

void balance_hand_out(
    const BalancedSystem *system, const BalanceRoom *room, const BalancedMotion *motion, size_t number)
{
    size_t of_axes = system->axes * BALANCED_OF_AXIS, samples = system->degrees * system->basis.samples;
    memcpy(motion->of_axes + number * of_axes, room->here.motion.of_axes, of_axes * sizeof *motion->of_axes);
    memcpy(motion->force + number * samples, room->here.motion.force, samples * sizeof *motion->force);
}

int balance_at(
    BalancedSystem *system, const double *z, double frequency, double *residual, double *jacobian,
    double *by_frequency, double *scale, const BalancedMotion *motion)
{
    size_t size = balance_size(system);
    BalanceRoom room = balance_begin(system, z);
    if (!balance_motion(system, frequency, &room, &room.here, jacobian))
        return 0;
    memcpy(residual, room.here.residual, size * sizeof *residual);
    memcpy(by_frequency, room.here.by_frequency, size * sizeof *by_frequency);
    *scale = room.here.scale;
    balance_hand_out(system, &room, motion, 0);
    return 1;
}
