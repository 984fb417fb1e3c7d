#include "path.h"

#include "../../core/c/spring/numerics.h"

#include <math.h>
#include <string.h>

enum { BLOCK = 512 };

/* W at xi = side*z, most often on the piece where the last one was. */
static double saturation_near(const SpringBranch *branch, double side, double z, int *piece)
{
    if (!(branch->edges[*piece] <= z && z < branch->edges[*piece + 1]))
        *piece = spring_piece(branch, z);
    double value = spring_on_piece(branch, *piece, z);
    if (*piece == branch->pieces)
        *piece = 0;
    return side * value;
}

enum { LANES = 8 };

/* The polynomial at each sample, so many at once, which compilers vectorise. */
static void polynomials(const double *coefficients, int coefficient_count, size_t count, const double *x, double *value)
{
    size_t i = 0;
    for (; i + LANES <= count; i += LANES) {
        double at[LANES], total[LANES];
        for (int k = 0; k < LANES; k++) {
            at[k] = x[i + k];
            total[k] = coefficients[coefficient_count - 1];
        }
        for (int power = coefficient_count - 2; power >= 0; power--)
            for (int k = 0; k < LANES; k++)
                total[k] = total[k] * at[k] + coefficients[power];
        for (int k = 0; k < LANES; k++)
            value[i + k] = total[k];
    }
    for (; i < count; i++)
        value[i] = polynomial(coefficients, coefficient_count, x[i]);
}

/* The number of the next displacements that neither turn back nor leave a piece of W, with theta at each. */
static size_t run_along(const SpringLaw *law, const SpringMemory *at, const SpringPiece *piece, double side, double low,
                        double high, size_t count, const double *displacement, double *theta)
{
    double rho = law->parameters.rho, way = at->direction, last = at->displacement;
    size_t i = 0;
    for (; i < count; i++) {
        double z = side * (at->start_xi + rho * fabs(displacement[i] - at->start));
        if (!(way * (displacement[i] - last) >= 0.0 && low <= z && z < high))
            break;
        last = displacement[i];
        theta[i] = (z - piece->middle) * piece->per_half;
    }
    return i;
}

/* omega and direction at the samples of a block. */
static void follow(const SpringLaw *law, SpringMemory *stroke, size_t count, const double *displacement, double *omega,
                   int *direction)
{
    double theta[BLOCK];
    for (size_t i = 0; i < count;) {
        spring_commit(law, stroke, NULL, displacement[i]);
        omega[i] = stroke->omega;
        if (direction != NULL)
            direction[i] = stroke->direction;
        i++;
        /* While samples follow each other closely, most are on the same piece of W as the one before. */
        if (i == count || (displacement[i] - stroke->displacement) * stroke->direction <= 0.0)
            continue;
        double xi = stroke->start_xi + law->parameters.rho * fabs(stroke->displacement - stroke->start);
        const SpringBranch *branch = xi >= 0.0 ? &law->table->rising : &law->table->falling;
        int index = spring_piece(branch, fabs(xi));
        if (index == branch->pieces)
            continue;
        double side = xi >= 0.0 ? 1.0 : -1.0, sign = side * stroke->direction;
        size_t run = run_along(law, stroke, &branch->piece[index], side, branch->edges[index], branch->edges[index + 1],
                               count - i, displacement + i, theta);
        if (run == 0)
            continue;
        for (size_t k = 0; k < run; k++) {
            double value = spring_polynomial(branch->piece[index].coefficients, theta[k]);
            omega[i + k] = sign * (value < 1.0 ? value : 1.0);
        }
        if (direction != NULL)
            for (size_t k = i; k < i + run; k++)
                direction[k] = stroke->direction;
        i += run;
        stroke->displacement = displacement[i - 1];
        stroke->omega = omega[i - 1];
    }
}

typedef struct {
    double inside[BLOCK], out[BLOCK];               /* x within the range, and how far it is outside */
    double FE[BLOCK], FA[BLOCK], dFE[BLOCK], dFA[BLOCK];
} Polynomials;

/* FE of a table and its slope at samples within the range, most often on the piece where the last one was. */
static void spline_forces(const SpringLaw *law, size_t count, const double *inside, int slopes, double *FE, double *dFE)
{
    const SpringSpline *spline = &law->spline;
    int last = law->parameters.knots - 2, piece = 0;
    for (size_t i = 0; i < count; i++) {
        double x = inside[i];
        while (piece > 0 && x < spline->knots[piece])
            piece--;
        while (piece < last && x >= spline->knots[piece + 1])
            piece++;
        double t = x - spline->knots[piece];
        FE[i] = spline_force(spline, piece, t);
        if (slopes)
            dFE[i] = spline_slope(spline, piece, t);
    }
}

/* Returns whether any sample lies outside the range. */
static int prepare_block(const SpringLaw *law, size_t count, const double *displacement, int slopes, Polynomials *at)
{
    const SpringParameters *p = &law->parameters;
    int any = 0;
    for (size_t i = 0; i < count; i++) {
        double x = displacement[i] - p->displacement_offset;
        at->inside[i] = clip(x, law->x_min, law->x_max);
        at->out[i] = x - at->inside[i];
        any |= at->out[i] != 0.0;
    }
    if (p->knots)
        spline_forces(law, count, at->inside, slopes || any, at->FE, at->dFE);
    else
        polynomials(p->kE, p->elastic, count, at->inside, at->FE);
    polynomials(p->kA, p->amplifier, count, at->inside, at->FA);
    if ((slopes || any) && !p->knots)
        polynomials(law->dFE, slope_count(p->elastic), count, at->inside, at->dFE);
    if (slopes)
        polynomials(law->dFA, slope_count(p->amplifier), count, at->inside, at->dFA);
    return any;
}

/* Paper eq. (10); FE is continued along its tangent, FA stays what it is at the end of the range. */
static void forces(const SpringLaw *law, size_t count, const double *omega, const Polynomials *at, int any,
                   double *force)
{
    double kappa = law->parameters.kappa_omega;
    if (any)
        for (size_t i = 0; i < count; i++)
            force[i] = at->FE[i] + at->dFE[i] * at->out[i] + kappa * omega[i] * at->FA[i];
    else
        for (size_t i = 0; i < count; i++)
            force[i] = at->FE[i] + kappa * omega[i] * at->FA[i];
}

static void stiffnesses(const SpringLaw *law, size_t count, const double *omega, const int *direction,
                        const Polynomials *at, double *stiffness)
{
    const SpringParameters *p = &law->parameters;
    for (size_t i = 0; i < count; i++) {
        double u = direction[i] < 0 ? -omega[i] : omega[i];
        double slope = 1.0 + (u >= 0.0 ? -1.0 : law->table->curvature) * spring_power(fabs(u), p->n);
        double of_amplifier = at->out[i] == 0.0 ? at->dFA[i] : 0.0;
        stiffness[i] = at->dFE[i] + p->kappa_omega * (omega[i] * of_amplifier + at->FA[i] * p->rho * slope);
    }
}

static void energies(const SpringLaw *law, SpringMemory *memory, size_t count, const double *displacement,
                     double *energy)
{
    for (size_t i = 0; i < count; i++) {
        spring_commit(law, memory, NULL, displacement[i]);
        spring_integrate(law, memory);
        energy[i] = memory->energy;
    }
}

void spring_path(const SpringLaw *law, size_t count, const double *displacement, double omega_start, double *omega,
                 double *force, double *stiffness, double *energy)
{
    if (count == 0)
        return;
    SpringMemory stroke = spring_start(displacement[0], omega_start), memory = stroke;
    double block_omega[BLOCK];
    int block_direction[BLOCK];
    Polynomials at;
    for (size_t first = 0; first < count; first += BLOCK) {
        size_t size = count - first < BLOCK ? count - first : BLOCK;
        const double *here = displacement + first;
        if (omega != NULL || force != NULL || stiffness != NULL) {
            double *found = omega != NULL ? omega + first : block_omega;
            follow(law, &stroke, size, here, found, stiffness != NULL ? block_direction : NULL);
            if (force != NULL || stiffness != NULL) {
                int any = prepare_block(law, size, here, stiffness != NULL, &at);
                if (stiffness != NULL)
                    stiffnesses(law, size, found, block_direction, &at, stiffness + first);
                if (force != NULL)
                    forces(law, size, found, &at, any, force + first);
            }
        }
        if (energy != NULL)
            energies(law, &memory, size, here, energy + first);
    }
}

void spring_force_at(const SpringLaw *law, size_t count, const double *displacement, const double *omega, double *force,
                     double *by_displacement, double *by_omega)
{
    double kappa = law->parameters.kappa_omega;
    Polynomials at;
    for (size_t first = 0; first < count; first += BLOCK) {
        size_t size = count - first < BLOCK ? count - first : BLOCK;
        int any = prepare_block(law, size, displacement + first, 1, &at);
        forces(law, size, omega + first, &at, any, force + first);
        for (size_t i = 0; i < size; i++) {
            by_displacement[first + i] = at.dFE[i] + (at.out[i] == 0.0 ? kappa * omega[first + i] * at.dFA[i] : 0.0);
            by_omega[first + i] = kappa * at.FA[i];
        }
    }
}

/* xi at the beginning of a stroke and its derivatives by rho, sigma, n and omega_start. */
typedef struct {
    double xi, by[4];
} Beginning;

static void begin_strokes(const SpringTable *table, double rho, double omega_start, size_t strokes,
                          const int64_t *direction, const double *length, int derivatives, Beginning *begin)
{
    double u = 0.0, change[4] = {0.0, 0.0, 0.0, 0.0};
    for (size_t k = 0; k < strokes; k++) {
        Beginning *here = &begin[k];
        if (k == 0) {
            u = (double)direction[0] * omega_start;
            change[3] = (double)direction[0];
        }
        here->xi = spring_inverse(table, u);
        double end = here->xi + rho * length[k];
        if (!derivatives) {
            u = -spring_saturation(table, end);
            continue;
        }
        SpringSlopes before = spring_slopes(table, here->xi), after = spring_slopes(table, end);
        double slope = before.slope > 1e-12 ? before.slope : 1e-12;
        const double fixed[4] = {0.0, before.by_sigma, before.by_n, 0.0};
        const double moved[4] = {after.slope * length[k], after.by_sigma, after.by_n, 0.0};
        for (int i = 0; i < 4; i++) {
            here->by[i] = (change[i] - fixed[i]) / slope;
            change[i] = -(after.slope * here->by[i] + moved[i]);
        }
        u = -after.u;
    }
}

/* omega at points of strokes that have begun, and, unless `derivatives` is NULL, its derivatives by rho, sigma and n
 * (rows of `row`) and by omega_start. */
static void at_points(const SpringTable *table, double rho, const Beginning *begin, const int64_t *direction,
                      size_t points, const int64_t *stroke, const double *travel, double *omega, size_t row,
                      double *derivatives, double *by_start)
{
    int piece = 0, falling_piece = 0;
    for (size_t i = 0; i < points; i++) {
        const Beginning *at = &begin[stroke[i]];
        double side = (double)direction[stroke[i]], xi = at->xi + rho * travel[i];
        if (derivatives == NULL) {
            omega[i] = side * (xi >= 0.0 ? saturation_near(&table->rising, 1.0, xi, &piece)
                                         : saturation_near(&table->falling, -1.0, -xi, &falling_piece));
            continue;
        }
        SpringSlopes here = spring_slopes(table, xi);
        omega[i] = side * here.u;
        derivatives[i] = side * here.slope * (at->by[0] + travel[i]);
        derivatives[row + i] = side * (here.slope * at->by[1] + here.by_sigma);
        derivatives[2 * row + i] = side * (here.slope * at->by[2] + here.by_n);
        by_start[i] = side * here.slope * at->by[3];
    }
}

void spring_on_records(const SpringTable *table, size_t rates, const double *rho, const double *omega_start,
                       size_t records, const int64_t *first_stroke, const int64_t *first_point,
                       const int64_t *direction, const double *length, const int64_t *stroke, const double *travel,
                       double *workspace, double *omega, double *derivatives)
{
    Beginning *begin = (Beginning *)workspace;
    size_t points = (size_t)first_point[records];
    if (derivatives != NULL)
        memset(derivatives + 3 * points, 0, records * points * sizeof *derivatives);
    for (size_t rate = 0; rate < rates; rate++)
        for (size_t k = 0; k < records; k++) {
            size_t strokes = (size_t)first_stroke[k], at = (size_t)first_point[k];
            int with = derivatives != NULL && rate == rates - 1;
            begin_strokes(table, rho[rate], omega_start[k], (size_t)first_stroke[k + 1] - strokes, direction + strokes,
                          length + strokes, with, begin + strokes);
            at_points(table, rho[rate], begin, direction, (size_t)first_point[k + 1] - at, stroke + at, travel + at,
                      omega + rate * points + at, points, with ? derivatives + at : NULL,
                      with ? derivatives + (3 + k) * points + at : NULL);
        }
    if (derivatives == NULL)
        return;
    const double natural[3] = {rho[rates - 1], 0.5 * (1.0 + table->curvature), table->n};
    for (size_t k = 0; k < 3; k++)
        for (size_t i = 0; i < points; i++)
            derivatives[k * points + i] *= natural[k];
}
