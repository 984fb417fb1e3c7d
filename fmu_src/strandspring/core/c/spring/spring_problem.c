#include "spring_problem.h"

#include "numerics.h"
#include "spring_number.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Roots between low and high, rising; returns their number, at most the degree. Those of each derivative lie between
 * those of the next, from the linear one on. */
static int roots(const double *coefficients, int count, double low, double high, double *found)
{
    enum { MOST_HALVINGS = 1200 }; /* from 1e6 m down to the least double, however the host rounds */
    int total = 0;
    for (int order = count - 2; order >= 0; order--) {
        double of[SPRING_COEFFICIENTS], corners[SPRING_COEFFICIENTS + 1];
        int size = count, last = total + 1;
        memcpy(of, coefficients, (size_t)count * sizeof *of);
        for (int k = 0; k < order; k++)
            size = derivative(of, size, of);
        corners[0] = low;
        memcpy(corners + 1, found, (size_t)total * sizeof *found);
        corners[last] = high;
        total = 0;
        for (int i = 0; i < last; i++) {
            double a = corners[i], b = corners[i + 1];
            double at_left = polynomial(of, size, a), at_right = polynomial(of, size, b);
            /* Not the sign of the product, which may underflow. */
            if (at_left == 0.0 || at_right == 0.0 || (at_left > 0.0) == (at_right > 0.0))
                continue;
            for (int k = 0; k < MOST_HALVINGS; k++) {
                double middle = 0.5 * (a + b), value = polynomial(of, size, middle);
                if (!(a < middle && middle < b))
                    break;
                if (value != 0.0 && (value > 0.0) == (at_left > 0.0))
                    a = middle;
                else
                    b = middle;
            }
            found[total++] = a;
        }
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
        return GIVE_REASON("`displacement_min` must be below `displacement_max` [m], got %s and %s.", low.text,
                           high.text);
    double width = p->displacement_max - p->displacement_min;
    if (!(LEAST_WIDTH <= width && width <= LARGEST_WIDTH))
        return GIVE_REASON("`displacement_min` must be below `displacement_max` by %g m to %g m, got %s and %s.",
                           LEAST_WIDTH, LARGEST_WIDTH, low.text, high.text);
    if (!(p->displacement_min <= p->displacement_offset && p->displacement_offset <= p->displacement_max))
        return GIVE_REASON("`displacement_offset` must lie between `displacement_min` and `displacement_max` [m], got "
                           "%s.",
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
    } polynomials[] = {
        {"kE", " N", p->elastic, p->kE, LARGEST_FORCE}, {"kA", "", p->amplifier, p->kA, LARGEST_AMPLIFIER}};
    double x_min = p->displacement_min - p->displacement_offset, x_max = p->displacement_max - p->displacement_offset;
    double reach = -x_min > x_max ? -x_min : x_max, width = p->displacement_max - p->displacement_min;
    double low = LEAST_SATURATION / width, high = LARGEST_SATURATION / width;
    if (!(LEAST_FORCE <= p->kappa_omega && p->kappa_omega <= LARGEST_FORCE))
        return GIVE_REASON("`kappa_omega` must be within [%g, %g] N, got %s.", LEAST_FORCE, LARGEST_FORCE,
                           spring_number(p->kappa_omega).text);
    if (!(low <= p->rho && p->rho <= high))
        return GIVE_REASON("`rho` must be within [%.6g, %.6g] 1/m, %g to %g over the identified range, got %s.", low,
                           high, LEAST_SATURATION, LARGEST_SATURATION, spring_number(p->rho).text);
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
    snprintf(text, size, "%s", "");
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
