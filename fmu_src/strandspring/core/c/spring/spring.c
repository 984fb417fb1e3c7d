#include "spring.h"

#include "numerics.h"
#include "spring_library.h"

#include <float.h>

/* ---- law.py ----------------------------------------------------------------------------------------------------- */

static void antiderivative(const double *coefficients, int count, double *of)
{
    of[0] = 0.0;
    for (int i = 0; i < count; i++)
        of[i + 1] = coefficients[i] / (i + 1);
}

/* ---- restoring.py ----------------------------------------------------------------------------------------------- */

/* FE within the range, and its slope. */
static double elastic_inside(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0)
        return polynomial(p->kE, p->elastic, x);
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_force(&law->spline, i, x - law->spline.knots[i]);
}

static double elastic_slope(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0)
        return polynomial(law->dFE, slope_count(p->elastic), x);
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_slope(&law->spline, i, x - law->spline.knots[i]);
}

static double elastic_force(const SpringLaw *law, double x)
{
    double inside = clip(x, law->x_min, law->x_max);
    double out = x - inside;
    double force = elastic_inside(law, inside);
    return out == 0.0 ? force : force + elastic_slope(law, inside) * out;
}

static double amplifier(const SpringLaw *law, double x)
{
    return polynomial(law->parameters.kA, law->parameters.amplifier, clip(x, law->x_min, law->x_max));
}

void spring_prepare(SpringLaw *law, const SpringParameters *parameters, const SpringTable *table)
{
    law->parameters = *parameters;
    law->table = table;
    const SpringParameters *p = &law->parameters;
    if (p->knots) {
        spring_spline(&law->spline, p->knots, p->FE_knots, p->FE_forces, p->displacement_offset);
    } else {
        derivative(p->kE, p->elastic, law->dFE);
    }
    derivative(p->kA, p->amplifier, law->dFA);
    law->x_min = p->displacement_min - p->displacement_offset;
    law->x_max = p->displacement_max - p->displacement_offset;
    antiderivative(p->kE, p->elastic, law->FE_work);
}

double spring_force(const SpringLaw *law, const SpringMemory *memory)
{
    double x = memory->displacement - law->parameters.displacement_offset;
    return elastic_force(law, x) + law->parameters.kappa_omega * memory->omega * amplifier(law, x);
}

double spring_force_partials(
    const SpringLaw *law, double displacement, double omega, double *by_displacement, double *by_omega)
{
    const SpringParameters *p = &law->parameters;
    double x = displacement - p->displacement_offset, inside = clip(x, law->x_min, law->x_max);
    double dFE = elastic_slope(law, inside), FA = polynomial(p->kA, p->amplifier, inside);
    double dFA = x == inside ? polynomial(law->dFA, slope_count(p->amplifier), inside) : 0.0;
    *by_displacement = dFE + p->kappa_omega * omega * dFA;
    *by_omega = p->kappa_omega * FA;
    return elastic_inside(law, inside) + dFE * (x - inside) + p->kappa_omega * omega * FA;
}

double spring_stiffness(const SpringLaw *law, const SpringMemory *memory)
{
    const SpringParameters *p = &law->parameters;
    double x = memory->displacement - p->displacement_offset, omega = memory->omega;
    double u = memory->direction < 0 ? -omega : omega;
    double slope = 1.0 + (u >= 0.0 ? -1.0 : 2.0 * p->sigma - 1.0) * spring_power(clip(fabs(u), 0.0, 1.0), p->n);
    double inside = clip(x, law->x_min, law->x_max);
    double amplifier_slope = x == inside ? polynomial(law->dFA, slope_count(p->amplifier), inside) : 0.0;
    double hysteretic = omega * amplifier_slope + polynomial(p->kA, p->amplifier, inside) * p->rho * slope;
    return elastic_slope(law, inside) + p->kappa_omega * hysteretic;
}

/* ---- work.py ---------------------------------------------------------------------------------------------------- */

/* Work of FE within the range, from the offset. */
static double elastic_work_inside(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0)
        return polynomial(law->FE_work, p->elastic + 1, x);
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_work(&law->spline, i, x - law->spline.knots[i]);
}

/* From the end of the range to x, of FE along its tangent there. */
static double elastic_work_outside(const SpringLaw *law, double end, double x)
{
    double out = x - end;
    return out == 0.0 ? 0.0 : out * (elastic_inside(law, end) + 0.5 * elastic_slope(law, end) * out);
}

/* Work of FE between two displacements. */
SPRING_NOINLINE static double elastic_work(const SpringLaw *law, double before, double now)
{
    const SpringParameters *p = &law->parameters;
    before -= p->displacement_offset;
    now -= p->displacement_offset;
    double from = clip(before, law->x_min, law->x_max), to = clip(now, law->x_min, law->x_max);
    double work = elastic_work_inside(law, to) - elastic_work_inside(law, from);
    return work + (elastic_work_outside(law, to, now) - elastic_work_outside(law, from, before));
}

/* What a stroke has still to do from xi to high, and the part of it that comes next, on one branch of W and on one side
 * of each end of the range, where x = x_at_zero + per_z*|xi|. */
typedef struct {
    const SpringLaw *law;
    double xi, high, x_at_zero;
    const SpringBranch *branch;
    double per_z;
} Part;

/* The sum of shares times FA at Gauss's nodes between |xi| = a and b. */
SPRING_NOINLINE static double shared_work(const Part *part, double a, double b, const double shares[GAUSS_POINTS])
{
    double middle = part->x_at_zero + 0.5 * part->per_z * (a + b), reach = 0.5 * part->per_z * (b - a), total = 0.0;
    for (int k = 0; k < GAUSS_POINTS; k++)
        total += shares[k] * amplifier(part->law, middle + reach * GAUSS_NODES[k]);
    return total;
}

/* Integral of |W|*FA over |xi| from a to b, both on one piece or beyond the last: exact for degree 19, and |W| is of
 * degree 11. */
SPRING_NOINLINE static double piece_work(const Part *part, int piece, double a, double b)
{
    double shares[GAUSS_POINTS];
    spring_shares(part->branch, piece, a, b, shares);
    return shared_work(part, a, b, shares);
}

/* The same from a to b on one branch, over as large groups of pieces as fit in between. */
SPRING_NOINLINE static double branch_work(const Part *part, double a, double b)
{
    const SpringBranch *branch = part->branch;
    const double *edges = branch->edges;
    int piece = spring_piece(branch, a), last = spring_piece(branch, b);
    if (piece == last)
        return piece_work(part, piece, a, b);
    double total = piece_work(part, last, edges[last], b);
    if (a > edges[piece]) {
        total += piece_work(part, piece, a, edges[piece + 1]);
        piece++;
    }
    while (piece < last) {
        int level = 0, size = 1;
        for (; piece % (4 * size) == 0 && piece + 4 * size <= last; level++)
            size *= 4;
        total += shared_work(part, edges[piece], edges[piece + size], branch->shares[spring_group(level, piece)]);
        piece += size;
    }
    return total;
}

/* Where the part ends: the integrand has a kink at xi = 0 and where the stroke crosses an end of the range. */
static double end_of_part(const Part *part, double per_x)
{
    const SpringLaw *law = part->law;
    double at_min = per_x * (law->x_min - part->x_at_zero), at_max = per_x * (law->x_max - part->x_at_zero);
    double end = part->xi < 0.0 && 0.0 < part->high ? 0.0 : part->high;
    if (part->xi < at_min && at_min < end)
        end = at_min;
    return part->xi < at_max && at_max < end ? at_max : end;
}

/* Integral of omega*FA dx times rho over the next part of a stroke in this direction. */
SPRING_NOINLINE static double part_work(Part *part, int direction)
{
    const SpringLaw *law = part->law;
    double per_x = direction * law->parameters.rho, begin = part->xi, end = end_of_part(part, per_x);
    int falls = begin < 0.0;
    part->xi = end;
    part->branch = falls ? &law->table->falling : &law->table->rising;
    part->per_z = falls ? -1.0 / per_x : 1.0 / per_x;
    return falls ? -branch_work(part, -end, -begin) : branch_work(part, begin, end);
}

/* Integral of kappa_omega*omega*FA dx over the stroke, from where the energy has been integrated. */
SPRING_NOINLINE static double hysteretic_work(const SpringLaw *law, const SpringMemory *memory)
{
    const SpringParameters *p = &law->parameters;
    double total = 0.0;
    Part part = {
        .law = law,
        .xi = memory->start_xi + p->rho * fabs(memory->energy_at - memory->start),
        .high = memory->start_xi + p->rho * fabs(memory->displacement - memory->start),
        .x_at_zero = memory->start - p->displacement_offset - memory->direction * memory->start_xi / p->rho,
    };
    while (part.xi < part.high)
        total += part_work(&part, memory->direction);
    return p->kappa_omega / p->rho * total;
}

/* ---- stepper.py ------------------------------------------------------------------------------------------------- */

SpringMemory spring_start(double displacement, double omega)
{
    return (SpringMemory){
        .displacement = displacement, .omega = omega, .start = displacement, .energy_at = displacement};
}

SPRING_APART double spring_absorbed_energy(const SpringLaw *law, const SpringMemory *memory)
{
    if (memory->energy_at == memory->displacement || law->table == NULL || !law->table->has_energies)
        return memory->energy;
    double hysteretic = hysteretic_work(law, memory);
    return memory->energy + elastic_work(law, memory->energy_at, memory->displacement) + hysteretic;
}

void spring_integrate(const SpringLaw *law, SpringMemory *memory)
{
    memory->energy = spring_absorbed_energy(law, memory);
    memory->energy_at = memory->displacement;
}

/* A new stroke, which goes in the other direction; the energy is integrated up to here. */
static void reverse(const SpringLaw *law, SpringMemory *memory, int direction)
{
    memory->start_xi = spring_inverse(law->table, direction * memory->omega);
    memory->start = memory->displacement;
    memory->direction = direction;
}

static void continue_stroke(const SpringLaw *law, SpringMemory *memory, double displacement)
{
    double xi = memory->start_xi + law->parameters.rho * fabs(displacement - memory->start);
    memory->displacement = displacement;
    memory->omega = memory->direction * spring_saturation(law->table, xi);
}

/* ---- derivatives ------------------------------------------------------------------------------------------------ */

/* Derivatives of omega where the path ends. */
static SpringSensitivity omega_derivatives(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity)
{
    int direction = memory->direction;
    if (direction == 0)
        return (SpringSensitivity){.by_omega_start = 1.0};
    double length = fabs(memory->displacement - memory->start);
    SpringSlopes at = spring_slopes(law->table, memory->start_xi + law->parameters.rho * length);
    return (SpringSensitivity){
        .by_rho = direction * at.slope * (sensitivity->by_rho + length),
        .by_sigma = direction * (at.slope * sensitivity->by_sigma + at.by_sigma),
        .by_n = direction * (at.slope * sensitivity->by_n + at.by_n),
        .by_omega_start = direction * at.slope * sensitivity->by_omega_start,
    };
}

/* The sensitivity at the beginning of a stroke, from the derivatives of omega there. */
static SpringSensitivity inherited(const SpringLaw *law, const SpringMemory *stroke, const SpringSensitivity *change)
{
    int direction = stroke->direction;
    SpringSlopes at = spring_slopes(law->table, stroke->start_xi);
    double slope = clip(at.slope, 1e-12, HUGE_VAL);
    return (SpringSensitivity){
        .by_rho = direction * change->by_rho / slope,
        .by_sigma = (direction * change->by_sigma - at.by_sigma) / slope,
        .by_n = (direction * change->by_n - at.by_n) / slope,
        .by_omega_start = direction * change->by_omega_start / slope,
    };
}

SpringSensitivity spring_trial_sensitivity(
    const SpringLaw *law, const SpringMemory *before, const SpringSensitivity *sensitivity, const SpringMemory *after)
{
    if (after->direction == before->direction)
        return *sensitivity;
    SpringSensitivity change = omega_derivatives(law, before, sensitivity);
    return inherited(law, after, &change);
}

SpringDeparture spring_leave(
    const SpringLaw *law, const SpringParameters *next, SpringMemory *memory, const SpringSensitivity *sensitivity)
{
    const SpringParameters *old = &law->parameters;
    int is_other = old->rho != next->rho || old->sigma != next->sigma || old->n != next->n;
    SpringDeparture departure = {.begins_anew = memory->direction != 0 && is_other};
    spring_integrate(law, memory);
    if (!departure.begins_anew || sensitivity == NULL)
        return departure;
    departure.change = omega_derivatives(law, memory, sensitivity);
    if (old->rho != next->rho)
        departure.change.by_rho = 0.0;
    if (old->sigma != next->sigma)
        departure.change.by_sigma = 0.0;
    if (old->n != next->n)
        departure.change.by_n = 0.0;
    return departure;
}

void spring_arrive(
    const SpringLaw *law, const SpringDeparture *departure, SpringMemory *memory, SpringSensitivity *sensitivity)
{
    if (!departure->begins_anew)
        return;
    memory->start = memory->displacement;
    memory->start_xi = spring_inverse(law->table, memory->direction * memory->omega);
    if (sensitivity != NULL)
        *sensitivity = inherited(law, memory, &departure->change);
}

void spring_change(
    const SpringLaw *before, const SpringLaw *after, SpringMemory *memory, SpringSensitivity *sensitivity)
{
    SpringDeparture departure = spring_leave(before, &after->parameters, memory, sensitivity);
    spring_arrive(after, &departure, memory, sensitivity);
}

/* A new stroke, and what it inherits. */
SPRING_NOINLINE static void reverse_sensitivity(
    const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, int direction)
{
    SpringSensitivity change = omega_derivatives(law, memory, sensitivity);
    reverse(law, memory, direction);
    *sensitivity = inherited(law, memory, &change);
}

void spring_commit(const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, double displacement)
{
    double travel = displacement - memory->displacement;
    if (travel == 0.0)
        return;
    int direction = travel > 0.0 ? 1 : -1;
    if (direction != memory->direction) {
        /* Before the sensitivity, so that the frames of both do not add up. */
        spring_integrate(law, memory);
        if (sensitivity != NULL)
            reverse_sensitivity(law, memory, sensitivity, direction);
        else
            reverse(law, memory, direction);
    }
    continue_stroke(law, memory, displacement);
}

SpringMemory spring_trial(const SpringLaw *law, const SpringMemory *memory, double displacement)
{
    SpringMemory after = *memory;
    spring_commit(law, &after, NULL, displacement);
    return after;
}

/* x^i and its derivatives. */
static void powers(double x, double value[SPRING_COEFFICIENTS], double slope[SPRING_COEFFICIENTS])
{
    value[0] = 1.0;
    slope[0] = 0.0;
    for (int i = 1; i < SPRING_COEFFICIENTS; i++) {
        value[i] = value[i - 1] * x;
        slope[i] = i * value[i - 1];
    }
}

/* The slope of FE's slope within the range. */
static double elastic_bend(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0) {
        double ddFE[SPRING_COEFFICIENTS];
        return polynomial(ddFE, derivative(law->dFE, slope_count(p->elastic), ddFE), x);
    }
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_bend(&law->spline, i, x - law->spline.knots[i]);
}

/* An output depends on x = displacement - offset, and on x held between min - offset and max - offset, `inside`. A
 * table of FE stays where its knots are when the offset moves: of_table is its part of the two derivatives. */
static void place(SpringGradient *gradient, int side, double by_x, double by_inside, double of_table)
{
    gradient->by_place = by_x + (side == 0 ? by_inside : 0.0);
    gradient->by_displacement_offset = of_table - (by_x + by_inside);
    gradient->by_displacement_min = side < 0 ? by_inside : 0.0;
    gradient->by_displacement_max = side > 0 ? by_inside : 0.0;
}

SpringOmegaSlope spring_omega_slope(const SpringLaw *law, const SpringMemory *memory)
{
    const double rho = law->parameters.rho, n = law->parameters.n;
    /* Paper eq. (22): the slope is rho*(1 + factor*|u|^n). */
    int direction = memory->direction ? memory->direction : 1;
    double u = direction * memory->omega, size = clip(fabs(u), DBL_EPSILON, 1.0);
    double factor = u >= 0.0 ? -1.0 : 2.0 * law->parameters.sigma - 1.0;
    double power = spring_power(clip(fabs(u), 0.0, 1.0), n);
    double value = 1.0 + factor * power;
    return (SpringOmegaSlope){
        .value = rho * value,
        .by_omega = fabs(u) > 1.0
                        ? 0.0
                        : rho * (u >= 0.0 ? direction : -direction) * factor * n * spring_power(size, n) / size,
        .by_rho = value,
        .by_sigma = u >= 0.0 ? 0.0 : 2.0 * rho * power,
        .by_n = rho * factor * power * spring_logarithm(size),
    };
}

/* A displacement within the range, what it is beyond that, and FE, FA and their derivatives there. */
typedef struct {
    double inside, out;
    int side;
    double FE_1, FE_2, FA, FA_1;
} Amplifiers;

static Amplifiers amplifiers_at(const SpringLaw *law, double displacement)
{
    const SpringParameters *p = &law->parameters;
    double x = displacement - p->displacement_offset, inside = clip(x, law->x_min, law->x_max);
    return (Amplifiers){
        .inside = inside,
        .out = x - inside,
        .side = x < law->x_min ? -1 : x > law->x_max ? 1 : 0,
        .FE_1 = elastic_slope(law, inside),
        .FE_2 = elastic_bend(law, inside),
        .FA = polynomial(p->kA, p->amplifier, inside),
        .FA_1 = polynomial(law->dFA, slope_count(p->amplifier), inside),
    };
}

static SpringSensitivity change_of_omega(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity)
{
    return sensitivity == NULL ? (SpringSensitivity){.by_omega_start = 1.0} : omega_derivatives(law, memory, sensitivity);
}

static void force_gradient(const SpringLaw *law, const SpringMemory *memory, const Amplifiers *at,
                           const SpringSensitivity *change, SpringGradient *of_force)
{
    const SpringParameters *p = &law->parameters;
    const double kappa = p->kappa_omega, omega = memory->omega;
    double value[SPRING_COEFFICIENTS], first[SPRING_COEFFICIENTS];
    memset(of_force, 0, sizeof *of_force);
    powers(at->inside, value, first);
    for (int i = 0; i < p->elastic; i++)
        of_force->by_kE[i] = value[i] + first[i] * at->out;
    if (p->knots)
        spring_spline_gradient(
            &law->spline, p->knots, at->inside, 1.0, at->out, of_force->by_FE_forces, of_force->by_FE_knots);
    for (int i = 0; i < p->amplifier; i++)
        of_force->by_kA[i] = kappa * omega * value[i];
    of_force->by_kappa_omega = omega * at->FA;
    of_force->by_rho = kappa * at->FA * change->by_rho;
    of_force->by_sigma = kappa * at->FA * change->by_sigma;
    of_force->by_n = kappa * at->FA * change->by_n;
    of_force->by_omega_start = kappa * at->FA * change->by_omega_start;
    place(of_force, at->side, at->FE_1, at->FE_2 * at->out + kappa * omega * at->FA_1,
          p->knots ? at->FE_1 + at->FE_2 * at->out : 0.0);
}

void spring_force_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity, SpringGradient *of_force)
{
    Amplifiers at = amplifiers_at(law, memory->displacement);
    SpringSensitivity change = change_of_omega(law, memory, sensitivity);
    force_gradient(law, memory, &at, &change, of_force);
}

void spring_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity,
    SpringGradient *of_force, SpringGradient *of_stiffness)
{
    const SpringParameters *p = &law->parameters;
    const double kappa = p->kappa_omega, omega = memory->omega;
    Amplifiers at = amplifiers_at(law, memory->displacement);
    double within = at.side == 0 ? 1.0 : 0.0, FA = at.FA, FA_1 = at.FA_1, FE_2 = at.FE_2;
    SpringOmegaSlope slope = spring_omega_slope(law, memory);
    SpringSensitivity change = change_of_omega(law, memory, sensitivity);
    force_gradient(law, memory, &at, &change, of_force);
    of_force->by_displacement = spring_stiffness(law, memory);

    double ddFA[SPRING_COEFFICIENTS], value[SPRING_COEFFICIENTS], first[SPRING_COEFFICIENTS];
    int hysteretics = derivative(law->dFA, slope_count(p->amplifier), ddFA);
    double FA_2 = polynomial(ddFA, hysteretics, at.inside);
    memset(of_stiffness, 0, sizeof *of_stiffness);
    powers(at.inside, value, first);
    for (int i = 0; i < p->elastic; i++)
        of_stiffness->by_kE[i] = first[i];
    if (p->knots)
        spring_spline_gradient(
            &law->spline, p->knots, at.inside, 0.0, 1.0, of_stiffness->by_FE_forces, of_stiffness->by_FE_knots);
    for (int i = 0; i < p->amplifier; i++)
        of_stiffness->by_kA[i] = kappa * (omega * first[i] * within + value[i] * slope.value);

    double by_omega = kappa * (FA_1 * within + FA * slope.by_omega), by_slope = kappa * FA;
    double by_inside = FE_2 + kappa * (omega * FA_2 * within + FA_1 * slope.value);
    of_stiffness->by_displacement = by_inside * within + by_omega * slope.value;
    of_stiffness->by_kappa_omega = omega * FA_1 * within + FA * slope.value;
    of_stiffness->by_rho = by_omega * change.by_rho + by_slope * slope.by_rho;
    of_stiffness->by_sigma = by_omega * change.by_sigma + by_slope * slope.by_sigma;
    of_stiffness->by_n = by_omega * change.by_n + by_slope * slope.by_n;
    of_stiffness->by_omega_start = by_omega * change.by_omega_start;
    place(of_stiffness, at.side, 0.0, by_inside, p->knots ? FE_2 : 0.0);
}
