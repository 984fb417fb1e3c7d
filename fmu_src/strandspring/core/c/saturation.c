#include "numerics.h"
#include "saturation.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { DEGREE = SPRING_POWERS - 1 };

static const double PI = 3.14159265358979323846;
/* How finely W is tabulated: ln of the smallest |W| resolved, the logit above which W counts as 1, minus ln of what is
 * lost beside 1, and the width of a piece in the logit of W, or in ln|W| and in n*ln|W| on the falling branch. */
typedef struct {
    double lowest, highest, lost, width;
} Fineness;
/* As in saturation.py. The nearest singularity, most often xi = 0, is 4.5 half widths away at least, and the polynomial's
 * error below 1e-13; above the highest logit 1 - W is below a rounding. */
static const Fineness FINE = {-32.0, 36.5, 36.0, 0.45};
/* The nearest singularity is 2.2 half widths away, and the error of W below 1e-8. */
static const Fineness COARSE = {-16.0, 20.0, 16.0, 0.9};
/* W' never quite vanishes, so that one may divide by it. */
static const double LEAST_SLOPE = 1e-15;
/* Of a piece's half width, the most by which Newton's method moves: more is rounding, where W is nearly level. */
static const double LARGEST_CORRECTION = 1e-6;

/* The order in which interpolation takes the nodes: each far from those before, or rounding errors grow. */
static const int ORDER[SPRING_POWERS] = {0, 11, 6, 3, 9, 1, 8, 5, 10, 2, 7, 4};

/* Chebyshev-Lobatto nodes on [-1, 1], and the weights of the integral from -1 to each. */
typedef struct {
    double node[SPRING_POWERS], integral[SPRING_POWERS][SPRING_POWERS];
} Rule;

/* The values at the nodes of one piece. */
typedef struct {
    double z[SPRING_POWERS];          /* |xi| */
    double value[SPRING_POWERS];      /* |W| */
    double complement[SPRING_POWERS]; /* |W| - 1 */
    double slope[SPRING_POWERS];      /* W' */
    double rate[SPRING_POWERS], rate_by_n[SPRING_POWERS], rate_by_sigma[SPRING_POWERS];
} Nodes;

/* ---- polynomials on a piece ---- */

static double polynomial_slope(const double *c, double t)
{
    double square = t * t, fourth = square * square;
    double low = (c[1] + 2.0 * c[2] * t) + (3.0 * c[3] + 4.0 * c[4] * t) * square;
    double middle = (5.0 * c[5] + 6.0 * c[6] * t) + (7.0 * c[7] + 8.0 * c[8] * t) * square;
    double high = (9.0 * c[9] + 10.0 * c[10] * t) + 11.0 * c[11] * square;
    return low + fourth * (middle + fourth * high);
}

/* Where a polynomial is fitted: theta of each argument, in the order in which interpolation takes them, and the
 * 1/(theta[k] - theta[k - step]) that it divides by, one after the other. */
typedef struct {
    double middle, per_half, theta[SPRING_POWERS], per_gap[SPRING_POWERS * DEGREE / 2];
} Grid;

/* The arguments are monotone. */
static void make_grid(Grid *grid, const double *argument)
{
    grid->middle = 0.5 * (argument[0] + argument[DEGREE]);
    grid->per_half = 2.0 / (argument[DEGREE] - argument[0]);
    for (int k = 0; k < SPRING_POWERS; k++)
        grid->theta[k] = (argument[ORDER[k]] - grid->middle) * grid->per_half;
    for (int step = 1, i = 0; step < SPRING_POWERS; step++)
        for (int k = DEGREE; k >= step; k--)
            grid->per_gap[i++] = 1.0 / (grid->theta[k] - grid->theta[k - step]);
}

/* Adds to the coefficients the polynomial that is value[k] at the argument k. */
static void add_interpolant(const Grid *grid, const double *value, double *coefficients)
{
    double difference[SPRING_POWERS], power[SPRING_POWERS];
    for (int k = 0; k < SPRING_POWERS; k++)
        difference[k] = value[ORDER[k]];
    for (int step = 1, i = 0; step < SPRING_POWERS; step++)
        for (int k = DEGREE; k >= step; k--)
            difference[k] = (difference[k] - difference[k - 1]) * grid->per_gap[i++];
    /* Newton's form, multiplied out from the innermost bracket. */
    power[0] = difference[DEGREE];
    for (int k = DEGREE - 1, size = 1; k >= 0; k--, size++) {
        power[size] = power[size - 1];
        for (int i = size - 1; i > 0; i--)
            power[i] = power[i - 1] - grid->theta[k] * power[i];
        power[0] = difference[k] - grid->theta[k] * power[0];
    }
    for (int k = 0; k < SPRING_POWERS; k++)
        coefficients[k] += power[k];
}

/* The polynomial once more for what rounding has left. */
static void correct(const Grid *grid, const double *value, double *coefficients)
{
    double left[SPRING_POWERS];
    for (int k = 0; k < SPRING_POWERS; k++)
        left[ORDER[k]] = value[ORDER[k]] - spring_polynomial(coefficients, grid->theta[k]);
    add_interpolant(grid, left, coefficients);
}

static void make_rule(Rule *rule)
{
    double cosine[2 * DEGREE];
    for (int k = 0; k < 2 * DEGREE; k++)
        cosine[k] = cos(PI * k / (double)DEGREE);
    for (int j = 0; j < SPRING_POWERS; j++)
        rule->node[j] = cosine[DEGREE - j];
    /* The integral of each Chebyshev polynomial, times its share in what is given at the nodes. */
    for (int j = 0; j < SPRING_POWERS; j++)
        for (int i = 0; i < SPRING_POWERS; i++) {
            double x = rule->node[j], total = 0.0;
            for (int m = 0; m < SPRING_POWERS; m++) {
                double at_start = m % 2 ? 1.0 : -1.0, integral = m == 0 ? x + 1.0 : 0.5 * (x * x - 1.0);
                if (m > 1)
                    integral = 0.5 * ((cosine[(m + 1) * (DEGREE - j) % (2 * DEGREE)] - at_start) / (m + 1) -
                                      (cosine[(m - 1) * (DEGREE - j) % (2 * DEGREE)] - at_start) / (m - 1));
                double share = (m % DEGREE ? 2.0 : 1.0) * (i % DEGREE ? 1.0 : 0.5) / (double)DEGREE;
                total += share * cosine[m * (DEGREE - i) % (2 * DEGREE)] * integral;
            }
            rule->integral[j][i] = total;
        }
}

/* ---- look-up ---- */

static int bucket_of(double z)
{
    uint64_t bits;
    memcpy(&bits, &z, sizeof bits);
    return (int)(bits >> 48);
}

static double start_of_bucket(int bucket)
{
    uint64_t bits = (uint64_t)bucket << 48;
    double z;
    memcpy(&z, &bits, sizeof z);
    return z;
}

/* The last of the edges low .. high that is <= value, or edge low. */
static int search(const double *edges, int low, int high, double value)
{
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (value < edges[middle])
            high = middle - 1;
        else
            low = middle;
    }
    return low;
}

/* Of rising edges, which are positive from edge `from` on, or negative and then indexed by their size. */
static void make_index(SpringIndex *index, const double *edges, int from, int pieces)
{
    double low = fabs(edges[from]), high = fabs(edges[pieces]);
    int up = low < high;
    index->first = bucket_of(up ? low : high);
    int buckets = bucket_of(up ? high : low) - index->first + 1;
    for (int k = 0; k <= buckets; k++) {
        double start = start_of_bucket(index->first + k);
        index->piece[k] = (unsigned char)search(edges, 0, pieces - 1, up ? start : -start);
    }
}

static int find(const SpringIndex *index, const double *edges, double value)
{
    int bucket = bucket_of(fabs(value)) - index->first;
    int here = index->piece[bucket], next = index->piece[bucket + 1];
    return value >= 0.0 ? search(edges, here, next, value) : search(edges, next, here, value);
}

int spring_piece(const SpringBranch *branch, double z)
{
    if (z < branch->edges[1])
        return 0;
    return z < branch->edges[branch->pieces] ? find(&branch->of_xi, branch->edges, z) : branch->pieces;
}

double spring_on_piece(const SpringBranch *branch, int index, double z)
{
    if (index == branch->pieces)
        return 1.0;
    const SpringPiece *piece = &branch->piece[index];
    double value = spring_polynomial(piece->coefficients, (z - piece->middle) * piece->per_half);
    return value < 1.0 ? value : 1.0;
}

/* ---- the branches ---- */

/* xi = S(u) over q = logit(u); rate is d(xi)/dq. */
static void rising_nodes(const SpringTable *table, const double *share, double start, Nodes *nodes)
{
    double first = exp(-start);
    for (int k = 0; k < SPRING_POWERS; k++) {
        double decay = first * share[k], log_u = -log1p(decay), u = 1.0 / (1.0 + decay);
        double slope = -expm1(table->n * log_u);
        nodes->value[k] = u;
        nodes->complement[k] = -decay * u;
        nodes->slope[k] = slope;
        nodes->rate[k] = u * u * decay / slope;
        nodes->rate_by_n[k] = nodes->rate[k] * (1.0 - slope) * log_u / slope;
        nodes->rate_by_sigma[k] = 0.0;
    }
}

/* -xi = T(w) over y = ln(w), w = -u; rate is d(-xi)/dy. share_n are the shares of w^n. */
static void falling_nodes(
    const SpringTable *table, const double *share, const double *share_n, const double *y, Nodes *nodes)
{
    double first = exp(y[0]), first_n = exp(table->n * y[0]);
    for (int k = 0; k < SPRING_POWERS; k++) {
        double w = first * share[k], power = first_n * share_n[k], slope = 1.0 + table->curvature * power;
        nodes->value[k] = w;
        nodes->complement[k] = expm1(y[k]);
        nodes->slope[k] = slope;
        nodes->rate[k] = w / slope;
        nodes->rate_by_n[k] = -nodes->rate[k] * y[k] * table->curvature * power / slope;
        nodes->rate_by_sigma[k] = -2.0 * nodes->rate[k] * power / slope;
    }
}

/* Integral at each node of what its rate is at the nodes, by the piece's half width. */
static void integrate(const Rule *rule, double half, const double *rate, double start, double *integral)
{
    for (int j = 0; j < SPRING_POWERS; j++) {
        double total = 0.0;
        for (int i = 0; i < SPRING_POWERS; i++)
            total += rule->integral[j][i] * rate[i];
        integral[j] = start + half * total;
    }
}

/* |xi| at the nodes of a piece. W' may be 2000, so that the roundings of a hundred pieces would count: what they lose is
 * carried from piece to piece. */
static void integrate_xi(const Rule *rule, double half, double *z, double *lost, Nodes *nodes)
{
    integrate(rule, half, nodes->rate, 0.0, nodes->z);
    double step = nodes->z[DEGREE] + *lost, before = *z;
    for (int k = 0; k < SPRING_POWERS; k++)
        nodes->z[k] = before + (*lost + nodes->z[k]);
    *z = nodes->z[DEGREE];
    *lost = step - (*z - before);
}

/* By n alone, or by n and sigma. */
static void add_derivatives(const Rule *rule, SpringBranch *branch, double half, const Grid *grid, const Nodes *nodes,
                            double integrals[2], int count)
{
    const double *rates[2] = {nodes->rate_by_n, nodes->rate_by_sigma};
    double *coefficients[2] = {branch->by_n[branch->pieces], branch->by_sigma[branch->pieces]};
    for (int one = 0; one < count; one++) {
        double integral[SPRING_POWERS];
        integrate(rule, half, rates[one], integrals[one], integral);
        integrals[one] = integral[DEGREE];
        /* With I the integral, xi = I(u) at a fixed xi gives d|W| = -W' dI. */
        for (int k = 0; k < SPRING_POWERS; k++)
            integral[k] *= -nodes->slope[k];
        memset(coefficients[one], 0, sizeof branch->by_n[0]);
        add_interpolant(grid, integral, coefficients[one]);
    }
}

/* A straight line from the origin up to the first node that is resolved. */
static void begin_branch(SpringBranch *branch, double z, double value)
{
    branch->pieces = 1;
    branch->edges[0] = branch->values[0] = 0.0;
    branch->complements[0] = -1.0;
    branch->piece[0] = (SpringPiece){0.0, 1.0 / z, {0.0, value}};
    branch->inverse[0] = (SpringPiece){0.0, 1.0 / value, {0.0, 1.0}};
    branch->edges[1] = z;
    branch->values[1] = value;
    branch->complements[1] = value - 1.0;
    memset(branch->by_n[0], 0, sizeof branch->by_n[0]);
    memset(branch->by_sigma[0], 0, sizeof branch->by_sigma[0]);
}

static void add_piece(SpringBranch *branch, const Grid *grid, const Nodes *nodes)
{
    int index = branch->pieces++;
    const double *argument = index < branch->complemented ? nodes->value : nodes->complement;
    double theta[SPRING_POWERS];
    Grid inverse;
    make_grid(&inverse, argument);
    for (int k = 0; k < SPRING_POWERS; k++)
        theta[ORDER[k]] = grid->theta[k];
    branch->piece[index] = (SpringPiece){.middle = grid->middle, .per_half = grid->per_half};
    add_interpolant(grid, nodes->value, branch->piece[index].coefficients);
    correct(grid, nodes->value, branch->piece[index].coefficients);
    branch->inverse[index] = (SpringPiece){.middle = inverse.middle, .per_half = inverse.per_half};
    add_interpolant(&inverse, theta, branch->inverse[index].coefficients);
    branch->edges[index + 1] = nodes->z[DEGREE];
    branch->values[index + 1] = nodes->value[DEGREE];
    branch->complements[index + 1] = nodes->complement[DEGREE];
}

static void make_indices(SpringBranch *branch)
{
    make_index(&branch->of_xi, branch->edges, 1, branch->pieces);
    make_index(&branch->of_value, branch->values, 1, branch->pieces);
    if (branch->complemented < branch->pieces)
        make_index(&branch->of_complement, branch->complements, branch->complemented, branch->pieces);
}

/* S(u) = sum of u^(k n + 1)/(k n + 1), for a small u. */
static double rising_series(double n, double u)
{
    double factor = pow(u, n), power = u, total = u, before = 0.0;
    for (int k = 1; total > before; k++) {
        before = total;
        power *= factor;
        total += power / (k * n + 1.0);
    }
    return total;
}

/* T(w) for a small w: 2F1 after Pfaff's transformation, as saturation.py has it. */
static double falling_series(double n, double curvature, double w)
{
    double p = curvature * pow(w, n), term = w / (1.0 + p), total = term, before = 0.0;
    for (int k = 1; total > before; k++) {
        before = total;
        term *= k / (k + 1.0 / n) * (p / (1.0 + p));
        total += term;
    }
    return total;
}

static void tabulate_rising(const Rule *rule, const Fineness *is, SpringTable *table, int with)
{
    SpringBranch *branch = &table->rising;
    int pieces = (int)((is->highest - is->lowest) / is->width);
    double lowest = 1.0 / (1.0 + exp(-is->lowest)), z = rising_series(table->n, lowest);
    double share[SPRING_POWERS], integrals[2] = {0.0, 0.0}, lost = 0.0;
    for (int k = 0; k < SPRING_POWERS; k++)
        share[k] = exp(-0.5 * is->width * (1.0 + rule->node[k]));
    branch->complemented = 1 - (int)(is->lowest / is->width);
    begin_branch(branch, z, lowest);
    for (int index = 0; index < pieces; index++) {
        Nodes nodes;
        Grid grid;
        rising_nodes(table, share, is->lowest + is->width * index, &nodes);
        integrate_xi(rule, 0.5 * is->width, &z, &lost, &nodes);
        make_grid(&grid, nodes.z);
        if (with & SPRING_WITH_DERIVATIVES)
            add_derivatives(rule, branch, 0.5 * is->width, &grid, &nodes, integrals, 1);
        add_piece(branch, &grid, &nodes);
    }
    make_indices(branch);
}

static void tabulate_falling(const Rule *rule, const Fineness *is, SpringTable *table, int with)
{
    SpringBranch *branch = &table->falling;
    double n = table->n, curvature = table->curvature;
    /* Below this the term (2 sigma - 1)*w^n is lost in rounding. */
    double lowest = clip(-(is->lost + log1p(curvature)) / n, is->lowest, 0.0);
    int pieces = (int)ceil(-lowest / clip(is->width / n, 0.0, is->width));
    double half = -0.5 * lowest / pieces;
    double share[SPRING_POWERS], share_n[SPRING_POWERS], y[SPRING_POWERS], integrals[2] = {0.0, 0.0};
    double z = falling_series(n, curvature, exp(lowest)), lost = 0.0;
    for (int k = 0; k < SPRING_POWERS; k++) {
        share[k] = exp(half * (1.0 + rule->node[k]));
        share_n[k] = exp(n * half * (1.0 + rule->node[k]));
    }
    branch->complemented = SPRING_PIECES;
    begin_branch(branch, z, exp(lowest));
    for (int index = 0; index < pieces; index++) {
        Nodes nodes;
        Grid grid;
        for (int k = 0; k < SPRING_POWERS; k++)
            y[k] = lowest - lowest * index / pieces + half * (1.0 + rule->node[k]);
        falling_nodes(table, share, share_n, y, &nodes);
        integrate_xi(rule, half, &z, &lost, &nodes);
        make_grid(&grid, nodes.z);
        if (with & SPRING_WITH_DERIVATIVES)
            add_derivatives(rule, branch, half, &grid, &nodes, integrals, 2);
        add_piece(branch, &grid, &nodes);
    }
    /* Exactly, so that every u from -1 on has its place. */
    branch->values[branch->pieces] = 1.0;
    make_indices(branch);
}

static void add_moments(SpringBranch *branch, int complement, double moments[][SPRING_MOMENTS])
{
    memset(moments[0], 0, sizeof moments[0]);
    for (int i = 0; i < branch->pieces; i++) {
        double half = 0.5 * (branch->edges[i + 1] - branch->edges[i]);
        double middle = 0.5 * (branch->edges[i + 1] + branch->edges[i]);
        memcpy(moments[i + 1], moments[i], sizeof moments[i]);
        for (int k = 0; k < GAUSS_POINTS; k++) {
            double z = middle + half * GAUSS_8[k][0], value = spring_on_piece(branch, i, z);
            double share = half * GAUSS_8[k][1] * (complement ? 1.0 - value : value);
            for (int m = 0; m < SPRING_MOMENTS; m++, share *= z)
                moments[i + 1][m] += share;
        }
    }
}

void spring_tabulate(SpringTable *table, double n, double sigma, int with)
{
    Rule rule;
    make_rule(&rule);
    table->n = n;
    table->curvature = 2.0 * sigma - 1.0;
    const Fineness *is = with & SPRING_COARSE ? &COARSE : &FINE;
    tabulate_rising(&rule, is, table, with);
    tabulate_falling(&rule, is, table, with);
    if (with & SPRING_WITH_MOMENTS) {
        add_moments(&table->rising, 0, table->rising.moments);
        add_moments(&table->rising, 1, table->rising.missing);
        add_moments(&table->falling, 0, table->falling.moments);
    }
}

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
    int index = near_one ? find(&branch->of_complement, branch->complements, complement)
                         : find(&branch->of_value, branch->values, value);
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
        slopes.by_n = side * spring_polynomial(at.branch->by_n[at.index], at.theta);
        slopes.by_sigma = xi >= 0.0 ? 0.0 : -spring_polynomial(at.branch->by_sigma[at.index], at.theta);
    } else {
        slopes.slope = 0.0; /* saturated: nothing is passed on to the next stroke */
    }
    return slopes;
}
