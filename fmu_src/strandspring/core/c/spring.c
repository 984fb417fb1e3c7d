#include "spring.h"

#include "numerics.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* ---- parameters.py ---------------------------------------------------------------------------------------------- */

/* Returns the number of coefficients of the derivative. */
static int derivative(const double *coefficients, int count, double *of)
{
    of[0] = 0.0;
    for (int i = 1; i < count; i++)
        of[i - 1] = i * coefficients[i];
    return slope_count(count);
}

static void antiderivative(const double *coefficients, int count, double *of)
{
    of[0] = 0.0;
    for (int i = 0; i < count; i++)
        of[i + 1] = coefficients[i] / (i + 1);
}

/* Returns the number of roots, at most the degree: there is one more of them than of the derivative at most. */
static int roots(const double *coefficients, int count, double low, double high, double *found)
{
    if (count < 2)
        return 0;
    double slope[SPRING_COEFFICIENTS], corners[SPRING_COEFFICIENTS + 1];
    int slopes = derivative(coefficients, count, slope);
    corners[0] = low;
    int last = 1 + roots(slope, slopes, low, high, corners + 1);
    corners[last] = high;
    int total = 0;
    for (int i = 0; i < last; i++) {
        double a = corners[i], b = corners[i + 1];
        double at_left = polynomial(coefficients, count, a), at_right = polynomial(coefficients, count, b);
        /* Not the sign of the product, which may underflow. */
        if (at_left == 0.0 || at_right == 0.0 || (at_left > 0.0) == (at_right > 0.0))
            continue;
        for (double middle = 0.5 * (a + b); a < middle && middle < b; middle = 0.5 * (a + b)) {
            double value = polynomial(coefficients, count, middle);
            if (value != 0.0 && (value > 0.0) == (at_left > 0.0))
                a = middle;
            else
                b = middle;
        }
        found[total++] = a;
    }
    return total;
}

static double least_value(const double *coefficients, int count, double low, double high, double *where)
{
    double slope[SPRING_COEFFICIENTS], candidates[SPRING_COEFFICIENTS + 1];
    int slopes = derivative(coefficients, count, slope);
    candidates[0] = low;
    int last = 1 + roots(slope, slopes, low, high, candidates + 1);
    candidates[last] = high;
    *where = low;
    double least = polynomial(coefficients, count, low);
    for (int i = 1; i <= last; i++) {
        double value = polynomial(coefficients, count, candidates[i]);
        if (value < least) {
            least = value;
            *where = candidates[i];
        }
    }
    return least;
}

/* Writes a reason into `text`; its value is 1. */
#define GIVE_REASON(...) (snprintf(text, size, __VA_ARGS__), 1)

static int count_problem(const SpringParameters *p, char *text, size_t size)
{
    int is_table = p->knots != 0 || p->forces != 0;
    if (is_table && p->elastic != 0)
        return GIVE_REASON("`kE` must be empty where `FE_knots` gives FE as a table, got %d values.", p->elastic);
    if (is_table && (p->knots < LEAST_KNOTS || p->knots > SPRING_KNOTS))
        return GIVE_REASON("`FE_knots` must have between %d and %d knots, got %d.", LEAST_KNOTS, SPRING_KNOTS, p->knots);
    if (p->forces != p->knots)
        return GIVE_REASON("`FE_forces` must have one force for each of the %d knots, got %d.", p->knots, p->forces);
    const struct {
        const char *name;
        int count;
    } polynomials[] = {{"kE", p->elastic}, {"kA", p->amplifier}};
    for (int i = is_table ? 1 : 0; i < 2; i++)
        if (polynomials[i].count < 1 || polynomials[i].count > SPRING_COEFFICIENTS)
            return GIVE_REASON("`%s` must have between 1 and %d coefficients, got %d.", polynomials[i].name,
                               SPRING_COEFFICIENTS, polynomials[i].count);
    return 0;
}

static int range_problem(const SpringParameters *p, char *text, size_t size)
{
    const struct {
        const char *name;
        double value;
    } places[] = {{"displacement_offset", p->displacement_offset},
                  {"displacement_min", p->displacement_min},
                  {"displacement_max", p->displacement_max}};
    for (int i = 0; i < 3; i++)
        if (!(fabs(places[i].value) <= LARGEST_DISPLACEMENT))
            return GIVE_REASON("`%s` must be within +-%g m, got %s.", places[i].name, LARGEST_DISPLACEMENT,
                               spring_number(places[i].value).text);
    SpringNumber low = spring_number(p->displacement_min), high = spring_number(p->displacement_max);
    if (!(p->displacement_min < p->displacement_max))
        return GIVE_REASON("`displacement_min` must be below `displacement_max` [m], got %s and %s.", low.text, high.text);
    double width = p->displacement_max - p->displacement_min;
    if (!(LEAST_WIDTH <= width && width <= LARGEST_WIDTH))
        return GIVE_REASON("`displacement_min` must be below `displacement_max` by %g m to %g m, got %s and %s.",
                           LEAST_WIDTH, LARGEST_WIDTH, low.text, high.text);
    if (!(p->displacement_min <= p->displacement_offset && p->displacement_offset <= p->displacement_max))
        return GIVE_REASON("`displacement_offset` must lie between `displacement_min` and `displacement_max` [m], got %s.",
                           spring_number(p->displacement_offset).text);
    return 0;
}

/* Of parameters over a range that is one. */
static int size_problem(const SpringParameters *p, char *text, size_t size)
{
    const struct {
        const char *name, *unit;
        int count;
        const double *values;
        double largest;
    } polynomials[] = {{"kE", " N", p->elastic, p->kE, LARGEST_FORCE}, {"kA", "", p->amplifier, p->kA, LARGEST_AMPLIFIER}};
    double x_min = p->displacement_min - p->displacement_offset, x_max = p->displacement_max - p->displacement_offset;
    double reach = -x_min > x_max ? -x_min : x_max, width = p->displacement_max - p->displacement_min;
    double low = LEAST_SATURATION / width, high = LARGEST_SATURATION / width;
    if (!(LEAST_FORCE <= p->kappa_omega && p->kappa_omega <= LARGEST_FORCE))
        return GIVE_REASON("`kappa_omega` must be within [%g, %g] N, got %s.", LEAST_FORCE, LARGEST_FORCE,
                           spring_number(p->kappa_omega).text);
    if (!(low <= p->rho && p->rho <= high))
        return GIVE_REASON("`rho` must be within [%.6g, %.6g] 1/m, %g to %g over the identified range, got %s.", low, high,
                           LEAST_SATURATION, LARGEST_SATURATION, spring_number(p->rho).text);
    for (int i = 0; i < 2; i++) {
        double power = 1.0;
        for (int k = 0; k < polynomials[i].count; k++, power *= reach)
            if (!(fabs(polynomials[i].values[k]) <= polynomials[i].largest / power))
                return GIVE_REASON("`%s_%d` must be within +-%.6g, %g%s over the identified range, got %s.",
                                   polynomials[i].name, k, polynomials[i].largest / power, polynomials[i].largest,
                                   polynomials[i].unit, spring_number(polynomials[i].values[k]).text);
    }
    for (int k = 0; k < p->forces; k++)
        if (!(fabs(p->FE_forces[k]) <= LARGEST_FORCE))
            return GIVE_REASON("`FE_forces_%d` must be within +-%g N, got %s.", k, LARGEST_FORCE,
                               spring_number(p->FE_forces[k]).text);
    return 0;
}

/* Of a range that is one. */
static int knot_problem(const SpringParameters *p, char *text, size_t size)
{
    const struct {
        const char *name;
        int place;
        double value;
    } ends[] = {{"displacement_min", 0, p->displacement_min}, {"displacement_max", p->knots - 1, p->displacement_max}};
    double least = LEAST_SPACING * (p->displacement_max - p->displacement_min);
    for (int i = 0; i < 2; i++)
        if (p->FE_knots[ends[i].place] != ends[i].value)
            return GIVE_REASON("`FE_knots_%d` must be `%s`, %s m, got %s.", ends[i].place, ends[i].name,
                               spring_number(ends[i].value).text, spring_number(p->FE_knots[ends[i].place]).text);
    for (int i = 1; i < p->knots; i++)
        if (!(p->FE_knots[i] - p->FE_knots[i - 1] >= least))
            return GIVE_REASON("`FE_knots_%d` must lie above `FE_knots_%d` by %.6g m or more, %g of the range, "
                               "got %s after %s.",
                               i, i - 1, least, LEAST_SPACING, spring_number(p->FE_knots[i]).text,
                               spring_number(p->FE_knots[i - 1]).text);
    return 0;
}

int spring_problem(const SpringParameters *parameters, char *text, size_t size)
{
    const SpringParameters *p = parameters;
    const struct {
        const char *name;
        double value;
    } named[] = {
        {"kappa_omega", p->kappa_omega},
        {"rho", p->rho},
        {"sigma", p->sigma},
        {"n", p->n},
        {"displacement_offset", p->displacement_offset},
        {"displacement_min", p->displacement_min},
        {"displacement_max", p->displacement_max},
    };
    const struct {
        const char *name;
        int count;
        const double *values;
    } columns[] = {{"kE", p->elastic, p->kE},
                   {"FE_knots", p->knots, p->FE_knots},
                   {"FE_forces", p->forces, p->FE_forces},
                   {"kA", p->amplifier, p->kA}};

    snprintf(text, size, "%s", "");
    if (count_problem(p, text, size))
        return 1;
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++)
        for (int k = 0; k < columns[i].count; k++)
            if (!isfinite(columns[i].values[k]))
                return GIVE_REASON("`%s_%d` must be finite, got %s.", columns[i].name, k,
                                   spring_number(columns[i].values[k]).text);
    for (size_t i = 0; i < sizeof named / sizeof *named; i++)
        if (!isfinite(named[i].value))
            return GIVE_REASON("`%s` must be finite, got %s.", named[i].name, spring_number(named[i].value).text);
    if (p->kA[0] != 1.0)
        return GIVE_REASON("`kA_0` must be 1 (kappa_omega carries the scale), got %s.",
                           spring_number(p->kA[0]).text);
    if (!(p->kappa_omega > 0.0))
        return GIVE_REASON("`kappa_omega` must be > 0 [N], got %s.", spring_number(p->kappa_omega).text);
    if (!(p->rho > 0.0))
        return GIVE_REASON("`rho` must be > 0 [1/m], got %s.", spring_number(p->rho).text);
    if (!(SIGMA_LOW <= p->sigma && p->sigma <= SIGMA_HIGH))
        return GIVE_REASON("`sigma` must be within [%g, %g], got %s.", SIGMA_LOW, SIGMA_HIGH,
                           spring_number(p->sigma).text);
    if (!(N_LOW <= p->n && p->n <= N_HIGH))
        return GIVE_REASON("`n` must be within [%g, %g], got %s.", N_LOW, N_HIGH, spring_number(p->n).text);
    if (range_problem(p, text, size) || (p->knots && knot_problem(p, text, size)) || size_problem(p, text, size))
        return 1;
    double where;
    double least = least_value(p->kA, p->amplifier, p->displacement_min - p->displacement_offset,
                               p->displacement_max - p->displacement_offset, &where);
    if (!(least > LEAST_AMPLIFIER))
        return GIVE_REASON("the amplifier FA (coefficients `kA`) must be > 0 over the identified range, "
                           "got %.6g at displacement %.6g m.",
                           least, where + p->displacement_offset);
    return 0;
}

/* ---- law.py ----------------------------------------------------------------------------------------------------- */

void spring_prepare(SpringLaw *law, const SpringParameters *parameters, const SpringTable *table)
{
    law->parameters = *parameters;
    law->table = table;
    const SpringParameters *p = &law->parameters;
    if (p->knots) {
        spring_spline(&law->spline, p->knots, p->FE_knots, p->FE_forces, p->displacement_offset);
    } else {
        derivative(p->kE, p->elastic, law->dFE);
        antiderivative(p->kE, p->elastic, law->FE_work);
    }
    derivative(p->kA, p->amplifier, law->dFA);
    antiderivative(p->kA, p->amplifier, law->FA_work);
    law->x_min = p->displacement_min - p->displacement_offset;
    law->x_max = p->displacement_max - p->displacement_offset;
    /* A polynomial of degree M may change by all of itself over 1/M^2 of half its range (Markov); per unit of xi. */
    int degree = p->amplifier - 1;
    law->roughness = 2.0 * degree * degree / p->rho / (law->x_max - law->x_min);
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

double spring_force(const SpringLaw *law, const SpringMemory *memory)
{
    double x = memory->displacement - law->parameters.displacement_offset;
    return elastic_force(law, x) + law->parameters.kappa_omega * memory->omega * amplifier(law, x);
}

double spring_stiffness(const SpringLaw *law, const SpringMemory *memory)
{
    const SpringParameters *p = &law->parameters;
    double x = memory->displacement - p->displacement_offset, omega = memory->omega;
    double u = memory->direction < 0 ? -omega : omega;
    double slope = 1.0 + (u >= 0.0 ? -1.0 : 2.0 * p->sigma - 1.0) * pow(clip(fabs(u), 0.0, 1.0), p->n);
    double inside = clip(x, law->x_min, law->x_max);
    double amplifier_slope = x == inside ? polynomial(law->dFA, slope_count(p->amplifier), inside) : 0.0;
    double hysteretic = omega * amplifier_slope + polynomial(p->kA, p->amplifier, inside) * p->rho * slope;
    return elastic_slope(law, inside) + p->kappa_omega * hysteretic;
}

/* ---- work.py ---------------------------------------------------------------------------------------------------- */

enum { FEW_POINTS = 3 };

static const double GAUSS_3[FEW_POINTS][2] = {
    {-0.77459666924148338, 5.0 / 9.0}, {0.0, 8.0 / 9.0}, {0.77459666924148338, 5.0 / 9.0}};
/* Up to this share of a piece, and of what FA may change in, 3 points are enough. */
static const double NARROW = 0.05;
/* Up to this, the powers of FA about the middle of a piece do not cancel. */
static const double SMOOTH = 16.0;
/* Of 1, 2, ... */
static const double RECIPROCALS[SPRING_POWERS + SPRING_COEFFICIENTS] = {
    1.0 / 1, 1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7, 1.0 / 8, 1.0 / 9,
    1.0 / 10, 1.0 / 11, 1.0 / 12, 1.0 / 13, 1.0 / 14, 1.0 / 15, 1.0 / 16, 1.0 / 17, 1.0 / 18,
    1.0 / 19, 1.0 / 20, 1.0 / 21, 1.0 / 22, 1.0 / 23, 1.0 / 24, 1.0 / 25, 1.0 / 26, 1.0 / 27,
    1.0 / 28, 1.0 / 29, 1.0 / 30, 1.0 / 31, 1.0 / 32, 1.0 / 33,
};
/* Where terms of the sum of moments may be so many times the work that full saturation does, it is not used. */
static const double WORST_CANCELLATION = 300.0;

/* Work of FE within the range, from the offset. */
static double elastic_work_inside(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    if (p->knots == 0)
        return polynomial(law->FE_work, p->elastic + 1, x);
    int i = spline_piece(&law->spline, p->knots, x);
    return spline_work(&law->spline, i, x - law->spline.knots[i]);
}

/* Outside as if the slope of FE stayed what it is at the end. */
static double elastic_work(const SpringLaw *law, double x)
{
    double inside = clip(x, law->x_min, law->x_max);
    double out = x - inside;
    double work = elastic_work_inside(law, inside);
    if (out == 0.0)
        return work;
    return work + out * (elastic_inside(law, inside) + 0.5 * elastic_slope(law, inside) * out);
}

/* Integral of FA from the offset to x. */
static double amplifier_work(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    double inside = clip(x, law->x_min, law->x_max);
    return polynomial(law->FA_work, p->amplifier + 1, inside) + (x - inside) * polynomial(p->kA, p->amplifier, inside);
}

/* A part of a stroke on one branch, x = x_at_zero + per_z*|xi|. The integrand is |W|*FA, or (1 - |W|)*FA. */
typedef struct {
    const SpringLaw *law;
    const SpringBranch *branch;
    double x_at_zero, per_z;
    int complement;
} Part;

/* Coefficients of FA by powers of t, x = origin + scale*t, as it is at x = `within`; returns their number. */
static int expand_amplifier(const SpringLaw *law, double origin, double scale, double within, double *f)
{
    int count = law->parameters.amplifier;
    if (within < law->x_min || within > law->x_max) {
        f[0] = amplifier(law, within);
        return 1;
    }
    double power = 1.0;
    memcpy(f, law->parameters.kA, (size_t)count * sizeof *f);
    for (int m = 0; m < count; m++, power *= scale) {
        for (int k = count - 2; k >= m; k--)
            f[k] += origin * f[k + 1];
        f[m] *= power;
    }
    return count;
}

/* Integral over |xi| from a to b on a piece over which FA changes little: that of a product of polynomials of theta. */
static double smooth_work(const Part *part, const SpringPiece *piece, double a, double b)
{
    double f[SPRING_COEFFICIENTS], product[SPRING_POWERS + SPRING_COEFFICIENTS] = {0.0};
    double half = 1.0 / piece->per_half, from = (a - piece->middle) * piece->per_half, to = (b - piece->middle) * piece->per_half;
    double sign = part->complement ? -1.0 : 1.0, at_from = 0.0, at_to = 0.0;
    double origin = part->x_at_zero + part->per_z * piece->middle, within = part->x_at_zero + 0.5 * part->per_z * (a + b);
    int count = expand_amplifier(part->law, origin, part->per_z * half, within, f);
    for (int k = 0; k < count; k++) {
        for (int i = 0; i < SPRING_POWERS; i++)
            product[i + k] += sign * piece->coefficients[i] * f[k];
        if (part->complement)
            product[k] += f[k];
    }
    for (int i = SPRING_POWERS + count - 2; i >= 0; i--) {
        double integrated = product[i] * RECIPROCALS[i];
        at_from = (at_from + integrated) * from;
        at_to = (at_to + integrated) * to;
    }
    return half * (at_to - at_from);
}

/* Integral over |xi| from a to b, both on one piece. */
static double piece_work(const Part *part, int index, double a, double b)
{
    const SpringLaw *law = part->law;
    const SpringBranch *branch = part->branch;
    if (index == branch->pieces)
        return part->complement ? 0.0 : (b - a) * amplifier(law, part->x_at_zero + 0.5 * part->per_z * (a + b));
    double rough = (b - a) * law->roughness, width = branch->edges[index + 1] - branch->edges[index];
    int few = rough < NARROW && b - a < NARROW * width;
    if (!few && width * law->roughness < SMOOTH)
        return smooth_work(part, &branch->piece[index], a, b);
    int most = law->parameters.amplifier / 2;
    int panels = few || rough < 16.0 ? 1 : rough < 8.0 * most ? (int)(rough / 8.0) : most;
    int points = few ? FEW_POINTS : GAUSS_POINTS;
    const double(*rule)[2] = few ? GAUSS_3 : GAUSS_8;
    double half = 0.5 * (b - a) / panels, total = 0.0;
    for (int panel = 0; panel < panels; panel++)
        for (int i = 0; i < points; i++) {
            double z = a + half * (2 * panel + 1 + rule[i][0]);
            double value = spring_on_piece(branch, index, z);
            total += rule[i][1] * (part->complement ? 1.0 - value : value) *
                     amplifier(law, part->x_at_zero + part->per_z * z);
        }
    return half * total;
}

/* The same over whole pieces from the moments, FA being expanded by powers of |xi|. Returns 0, which no work is, where the
 * terms would cancel: when xi = 0 lies many times the range away, or FA is of a high degree. */
static double moments_work(const Part *part, int from, int to)
{
    const SpringLaw *law = part->law;
    const SpringBranch *branch = part->branch;
    const double(*moments)[SPRING_MOMENTS] = part->complement ? branch->missing : branch->moments;
    const double *low = moments[from], *high = moments[to];
    double reach = fabs(part->x_at_zero) + fabs(part->per_z) * branch->edges[to];
    double within = part->x_at_zero + 0.5 * part->per_z * (branch->edges[from] + branch->edges[to]);
    double f[SPRING_COEFFICIENTS], largest = 0.0, total = 0.0;
    int count = expand_amplifier(law, part->x_at_zero, part->per_z, within, f);
    for (int m = 0; m < count; m++)
        total += f[m] * (high[m] - low[m]);
    if (count == 1)
        return total;
    for (int k = count - 1; k >= 0; k--)
        largest = largest * reach + fabs(law->parameters.kA[k]);
    double saturated = (branch->edges[to] - branch->edges[from]) * amplifier(law, within);
    return largest * high[0] < WORST_CANCELLATION * saturated ? total : 0.0;
}

static double pieces_work(const Part *part, int from, int to)
{
    double total = moments_work(part, from, to);
    if (total != 0.0)
        return total;
    /* Piece by piece only where FA changes over a piece. */
    int smooth = to;
    while (smooth > from && part->branch->edges[smooth] * part->law->roughness > 1.0)
        smooth--;
    if (from < smooth && smooth < to)
        total = moments_work(part, from, smooth);
    for (int i = total == 0.0 ? from : smooth; i < to; i++)
        total += piece_work(part, i, part->branch->edges[i], part->branch->edges[i + 1]);
    return total;
}

/* Integral over |xi| from a to b, which crosses no end of the range. */
static double branch_work(const Part *part, double a, double b)
{
    const SpringBranch *branch = part->branch;
    int from = spring_piece(branch, a), to = spring_piece(branch, b);
    if (from == to)
        return piece_work(part, from, a, b);
    double total = piece_work(part, to, branch->edges[to], b);
    if (a > branch->edges[from]) {
        total += piece_work(part, from, a, branch->edges[from + 1]);
        from++;
    }
    return from == to ? total : total + pieces_work(part, from, to);
}

static double rising_work(const SpringLaw *law, int direction, double x_at_zero, double low, double high)
{
    const SpringParameters *p = &law->parameters;
    const SpringBranch *branch = &law->table->rising;
    Part part = {.law = law, .branch = branch, .x_at_zero = x_at_zero, .per_z = direction / p->rho};
    int last = spring_piece(branch, high);
    if (last < branch->complemented || (last < branch->pieces && spring_piece(branch, low) == last))
        return p->kappa_omega / p->rho * branch_work(&part, low, high);
    /* What full saturation would do less what is missing from it, which is much shorter. Not before W is 1/2, or little
     * would be left. */
    double a = x_at_zero + part.per_z * low, b = x_at_zero + part.per_z * high;
    double saturated = direction * (amplifier_work(law, b) - amplifier_work(law, a));
    part.complement = 1;
    return p->kappa_omega * (saturated - branch_work(&part, low, high) / p->rho);
}

static double falling_work(const SpringLaw *law, int direction, double x_at_zero, double low, double high)
{
    const SpringParameters *p = &law->parameters;
    Part part = {.law = law, .branch = &law->table->falling, .x_at_zero = x_at_zero, .per_z = -direction / p->rho};
    return -p->kappa_omega / p->rho * branch_work(&part, fabs(high), fabs(low));
}

/* Integral of kappa_omega*omega*FA dx while xi grows from low to high on one stroke. */
static double hysteretic_work(const SpringLaw *law, int direction, double x_at_zero, double low, double high)
{
    double total = 0.0;
    /* Where the stroke crosses the ends of the range, and xi = 0, the integrand changes. */
    for (int k = 0; k < 3; k++) {
        double end = high;
        if (k < 2) {
            double x = (k == 0) == (direction > 0) ? law->x_min : law->x_max;
            end = direction * law->parameters.rho * (x - x_at_zero);
            if (!(low < end && end < high))
                continue;
        }
        if (low < 0.0)
            total += falling_work(law, direction, x_at_zero, low, end < 0.0 ? end : 0.0);
        if (end > 0.0)
            total += rising_work(law, direction, x_at_zero, low > 0.0 ? low : 0.0, end);
        low = end;
    }
    return total;
}

/* ---- stepper.py ------------------------------------------------------------------------------------------------- */

SpringMemory spring_start(double displacement, double omega)
{
    return (SpringMemory){
        .displacement = displacement, .omega = omega, .start = displacement, .energy_at = displacement};
}

/* A new stroke, which goes in the other direction. */
static void reverse(const SpringLaw *law, SpringMemory *memory, int direction)
{
    spring_integrate(law, memory);
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

SpringMemory spring_trial(const SpringLaw *law, const SpringMemory *memory, double displacement)
{
    SpringMemory after = *memory;
    double travel = displacement - memory->displacement;
    if (travel == 0.0)
        return after;
    int direction = travel > 0.0 ? 1 : -1;
    if (direction != memory->direction)
        reverse(law, &after, direction);
    continue_stroke(law, &after, displacement);
    return after;
}

double spring_absorbed_energy(const SpringLaw *law, const SpringMemory *memory)
{
    const SpringParameters *p = &law->parameters;
    double before = memory->energy_at - p->displacement_offset, now = memory->displacement - p->displacement_offset;
    if (before == now)
        return memory->energy;
    double elastic = elastic_work(law, now) - elastic_work(law, before);
    double start = memory->start - p->displacement_offset;
    double x_at_zero = start - memory->direction * memory->start_xi / p->rho;
    double low = memory->start_xi + p->rho * fabs(before - start), high = memory->start_xi + p->rho * fabs(now - start);
    return memory->energy + elastic + hysteretic_work(law, memory->direction, x_at_zero, low, high);
}

void spring_integrate(const SpringLaw *law, SpringMemory *memory)
{
    memory->energy = spring_absorbed_energy(law, memory);
    memory->energy_at = memory->displacement;
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
    double slope = clip(at.slope, 1e-12, INFINITY);
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

void spring_change(
    const SpringLaw *before, const SpringLaw *after, SpringMemory *memory, SpringSensitivity *sensitivity)
{
    const SpringParameters *old = &before->parameters, *new = &after->parameters;
    spring_integrate(before, memory);
    if (memory->direction == 0 || (old->rho == new->rho && old->sigma == new->sigma && old->n == new->n))
        return;
    SpringSensitivity change = omega_derivatives(before, memory, sensitivity);
    if (old->rho != new->rho)
        change.by_rho = 0.0;
    if (old->sigma != new->sigma)
        change.by_sigma = 0.0;
    if (old->n != new->n)
        change.by_n = 0.0;
    memory->start = memory->displacement;
    memory->start_xi = spring_inverse(after->table, memory->direction * memory->omega);
    *sensitivity = inherited(after, memory, &change);
}

void spring_commit(const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, double displacement)
{
    double travel = displacement - memory->displacement;
    if (travel == 0.0)
        return;
    if (memory->direction == (travel > 0.0 ? 1 : -1)) {
        continue_stroke(law, memory, displacement);
        return;
    }
    SpringMemory after = spring_trial(law, memory, displacement);
    if (sensitivity != NULL)
        *sensitivity = spring_trial_sensitivity(law, memory, sensitivity, &after);
    *memory = after;
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

/* An output depends on x = displacement - offset, and on x held between min - offset and max - offset, `inside`. A table of
 * FE stays where its knots are when the offset moves: of_table is its part of the two derivatives. */
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
    double power = pow(clip(fabs(u), 0.0, 1.0), n);
    double value = 1.0 + factor * power;
    return (SpringOmegaSlope){
        .value = rho * value,
        .by_omega = fabs(u) > 1.0 ? 0.0 : rho * (u >= 0.0 ? direction : -direction) * factor * n * pow(size, n - 1.0),
        .by_rho = value,
        .by_sigma = u >= 0.0 ? 0.0 : 2.0 * rho * power,
        .by_n = rho * factor * power * log(size),
    };
}

void spring_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity,
    SpringGradient *of_force, SpringGradient *of_stiffness)
{
    const SpringParameters *p = &law->parameters;
    const double kappa = p->kappa_omega, omega = memory->omega;
    double x = memory->displacement - p->displacement_offset;
    double inside = clip(x, law->x_min, law->x_max), out = x - inside;
    int side = x < law->x_min ? -1 : x > law->x_max ? 1 : 0;
    double within = side == 0 ? 1.0 : 0.0;
    SpringOmegaSlope slope = spring_omega_slope(law, memory);
    SpringSensitivity change = {.by_omega_start = 1.0};
    if (sensitivity != NULL)
        change = omega_derivatives(law, memory, sensitivity);

    double ddFA[SPRING_COEFFICIENTS];
    int hysteretic = slope_count(p->amplifier), hysteretics = derivative(law->dFA, hysteretic, ddFA);
    double FE_1 = elastic_slope(law, inside), FE_2 = elastic_bend(law, inside);
    double FA = polynomial(p->kA, p->amplifier, inside);
    double FA_1 = polynomial(law->dFA, hysteretic, inside), FA_2 = polynomial(ddFA, hysteretics, inside);

    double value[SPRING_COEFFICIENTS], first[SPRING_COEFFICIENTS];
    memset(of_force, 0, sizeof *of_force);
    memset(of_stiffness, 0, sizeof *of_stiffness);
    powers(inside, value, first);
    for (int i = 0; i < p->elastic; i++) {
        of_force->by_kE[i] = value[i] + first[i] * out;
        of_stiffness->by_kE[i] = first[i];
    }
    if (p->knots) {
        spring_spline_gradient(
            &law->spline, p->knots, inside, 1.0, out, of_force->by_FE_forces, of_force->by_FE_knots);
        spring_spline_gradient(
            &law->spline, p->knots, inside, 0.0, 1.0, of_stiffness->by_FE_forces, of_stiffness->by_FE_knots);
    }
    for (int i = 0; i < p->amplifier; i++) {
        of_force->by_kA[i] = kappa * omega * value[i];
        of_stiffness->by_kA[i] = kappa * (omega * first[i] * within + value[i] * slope.value);
    }

    of_force->by_displacement = spring_stiffness(law, memory);
    of_force->by_kappa_omega = omega * FA;
    of_force->by_rho = kappa * FA * change.by_rho;
    of_force->by_sigma = kappa * FA * change.by_sigma;
    of_force->by_n = kappa * FA * change.by_n;
    of_force->by_omega_start = kappa * FA * change.by_omega_start;
    place(of_force, side, FE_1, FE_2 * out + kappa * omega * FA_1, p->knots ? FE_1 + FE_2 * out : 0.0);

    double by_omega = kappa * (FA_1 * within + FA * slope.by_omega), by_slope = kappa * FA;
    double by_inside = FE_2 + kappa * (omega * FA_2 * within + FA_1 * slope.value);
    of_stiffness->by_displacement = by_inside * within + by_omega * slope.value;
    of_stiffness->by_kappa_omega = omega * FA_1 * within + FA * slope.value;
    of_stiffness->by_rho = by_omega * change.by_rho + by_slope * slope.by_rho;
    of_stiffness->by_sigma = by_omega * change.by_sigma + by_slope * slope.by_sigma;
    of_stiffness->by_n = by_omega * change.by_n + by_slope * slope.by_n;
    of_stiffness->by_omega_start = by_omega * change.by_omega_start;
    place(of_stiffness, side, 0.0, by_inside, p->knots ? FE_2 : 0.0);
}
