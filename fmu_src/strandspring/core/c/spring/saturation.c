#include "saturation.h"
#include "spring_library.h"

#include <float.h>
#include <stdint.h>

/* ln 2; multiples of the first part are exact. */
static const double LN_2_HIGH = 6.93147180369123816490e-01, LN_2_LOW = 1.90821492927058770002e-10;
/* W' never quite vanishes, so that one may divide by it. */
static const double LEAST_SLOPE = 1e-15;
/* Of a piece's half width, the most by which Newton's method moves: more is rounding, where W is nearly level. */
static const double LARGEST_CORRECTION = 1e-6;

static double polynomial_slope(const double *c, double t)
{
    double square = t * t, fourth = square * square;
    double low = (c[1] + 2.0 * c[2] * t) + (3.0 * c[3] + 4.0 * c[4] * t) * square;
    double middle = (5.0 * c[5] + 6.0 * c[6] * t) + (7.0 * c[7] + 8.0 * c[8] * t) * square;
    double high = (9.0 * c[9] + 10.0 * c[10] * t) + 11.0 * c[11] * square;
    return low + fourth * (middle + fourth * high);
}

/* ---- pieces ---- */

int spring_piece(const SpringBranch *branch, double z)
{
    return last_below(branch->edges, 0, branch->pieces, z);
}

double spring_on_piece(const SpringBranch *branch, int index, double z)
{
    if (index == branch->pieces)
        return 1.0;
    const SpringPiece *piece = &branch->piece[index];
    double value = spring_polynomial(piece->coefficients, (z - piece->middle) * piece->per_half);
    return value < 1.0 ? value : 1.0;
}

/* ---- W and its inverse ---- */

double spring_saturation(const SpringTable *table, double xi)
{
    const SpringBranch *branch = xi >= 0.0 ? &table->rising : &table->falling;
    double z = fabs(xi);
    double value = spring_on_piece(branch, spring_piece(branch, z), z);
    return xi >= 0.0 ? value : -value;
}

/* |xi| at which the tabulated |W| is `value`. */
static double inverse_on(const SpringBranch *branch, double value)
{
    double complement = value - 1.0;
    if (value < branch->values[1])
        return value / branch->values[1] * branch->edges[1];
    if (value >= branch->values[branch->pieces] || complement >= branch->complements[branch->pieces])
        return branch->edges[branch->pieces];
    int near_one = branch->complemented < branch->pieces && complement >= branch->complements[branch->complemented];
    int index = near_one ? last_below(branch->complements, branch->complemented, branch->pieces - 1, complement)
                         : last_below(branch->values, 0, branch->pieces - 1, value);
    const SpringPiece *inverse = &branch->inverse[index], *piece = &branch->piece[index];
    double argument = index < branch->complemented ? value : complement;
    double theta = spring_polynomial(inverse->coefficients, (argument - inverse->middle) * inverse->per_half);
    double error = spring_polynomial(piece->coefficients, theta) - value;
    double slope = polynomial_slope(piece->coefficients, theta);
    if (fabs(error) < LARGEST_CORRECTION * slope)
        theta -= error / slope;
    return piece->middle + theta / piece->per_half;
}

double spring_inverse(const SpringTable *table, double u)
{
    return u >= 0.0 ? inverse_on(&table->rising, u) : -inverse_on(&table->falling, -u);
}

/* A place on a branch. */
typedef struct {
    const SpringBranch *branch;
    int index;
    double theta, value, slope; /* |W| and W' */
} Place;

static Place place_on_table(const SpringTable *table, double xi)
{
    Place at = {.branch = xi >= 0.0 ? &table->rising : &table->falling, .value = 1.0, .slope = LEAST_SLOPE};
    double z = fabs(xi);
    at.index = spring_piece(at.branch, z);
    int beyond = at.index == at.branch->pieces;
    if (beyond) {
        if (xi >= 0.0)
            return at;
        /* No stroke begins before u = -1, where W' is 2 sigma: xi is there, but for rounding. */
        at.index--;
        z = at.branch->edges[at.index + 1];
    }
    const SpringPiece *piece = &at.branch->piece[at.index];
    at.theta = (z - piece->middle) * piece->per_half;
    double value = spring_polynomial(piece->coefficients, at.theta);
    double slope = polynomial_slope(piece->coefficients, at.theta) * piece->per_half;
    at.value = beyond || value > 1.0 ? 1.0 : value;
    at.slope = slope > LEAST_SLOPE ? slope : LEAST_SLOPE;
    return at;
}

double spring_saturation_slope(const SpringTable *table, double xi, double *slope)
{
    Place at = place_on_table(table, xi);
    *slope = at.slope;
    return xi >= 0.0 ? at.value : -at.value;
}

SpringSlopes spring_slopes(const SpringTable *table, double xi)
{
    Place at = place_on_table(table, xi);
    double side = xi >= 0.0 ? 1.0 : -1.0;
    SpringSlopes slopes = {.u = side * at.value, .slope = at.slope};
    if (at.index < at.branch->pieces) {
#ifdef SPRING_STEPS_ONLY
        slopes.by_n = slopes.by_sigma = side * NAN;
#else
        slopes.by_n = side * spring_polynomial(at.branch->by_n[at.index], at.theta);
        slopes.by_sigma = xi >= 0.0 ? 0.0 : -spring_polynomial(at.branch->by_sigma[at.index], at.theta);
#endif
    } else {
        slopes.slope = 0.0; /* saturated: nothing is passed on to the next stroke */
    }
    return slopes;
}

/* ---- powers ---- */

double spring_logarithm(double u)
{
    /* ln((1 + s)/(1 - s)) = 2 s (1 + s^2/3 + s^4/5 + ...). */
    static const double SERIES[SPRING_POWERS] = {
        2.0,        2.0 / 3.0,  2.0 / 5.0,  2.0 / 7.0,  2.0 / 9.0,  2.0 / 11.0,
        2.0 / 13.0, 2.0 / 15.0, 2.0 / 17.0, 2.0 / 19.0, 2.0 / 21.0, 2.0 / 23.0};
    int exponent = -1023;
    if (u < DBL_MIN) {
        u *= 18014398509481984.0;
        exponent -= 54;
    }
    uint64_t bits;
    memcpy(&bits, &u, sizeof bits);
    exponent += (int)(bits >> 52);
    bits = (bits & 0xfffffffffffff) | (uint64_t)1023 << 52;
    memcpy(&u, &bits, sizeof u);
    if (u > 1.4142135623730951) {
        u *= 0.5;
        exponent++;
    }
    double s = (u - 1.0) / (u + 1.0);
    return exponent * LN_2_HIGH + (exponent * LN_2_LOW + s * spring_polynomial(SERIES, s * s));
}

double spring_exponential_tail(double y)
{
    static const double SERIES[SPRING_POWERS] = {
        1.0 / 2.0,     1.0 / 6.0,      1.0 / 24.0,      1.0 / 120.0,      1.0 / 720.0,       1.0 / 5040.0,
        1.0 / 40320.0, 1.0 / 362880.0, 1.0 / 3628800.0, 1.0 / 39916800.0, 1.0 / 479001600.0, 1.0 / 6227020800.0};
    return spring_polynomial(SERIES, y);
}

double spring_exponential(double y)
{
    if (y < -708.0)
        return 0.0;
    int exponent = (int)(y / (LN_2_HIGH + LN_2_LOW) - 0.5);
    double rest = (y - exponent * LN_2_HIGH) - exponent * LN_2_LOW, power;
    uint64_t bits = (uint64_t)(exponent + 1023) << 52;
    memcpy(&power, &bits, sizeof power);
    return power * (1.0 + (rest + rest * rest * spring_exponential_tail(rest)));
}

double spring_power(double u, double n)
{
    return u > 0.0 ? spring_exponential(n * spring_logarithm(u)) : 0.0;
}
