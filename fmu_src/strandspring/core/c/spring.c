#include "spring.h"

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- parameters.py ---------------------------------------------------------------------------------------------- */

static const double SIGMA_LOW = 0.5, SIGMA_HIGH = 1000.0;
static const double N_LOW = 0.01, N_HIGH = 100.0;
static const double LEAST_AMPLIFIER = 1e-12;

static double clip(double value, double low, double high)
{
    value = low > value ? low : value;
    return high < value ? high : value;
}

static double polynomial(const double *coefficients, int count, double x)
{
    double total = coefficients[count - 1];
    for (int i = count - 2; i >= 0; i--)
        total = total * x + coefficients[i];
    return total;
}

/* Returns the number of coefficients of the derivative. */
static int derivative(const double *coefficients, int count, double *of)
{
    of[0] = 0.0;
    for (int i = 1; i < count; i++)
        of[i - 1] = i * coefficients[i];
    return count > 1 ? count - 1 : 1;
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
        double at_left = polynomial(coefficients, count, a);
        if (at_left * polynomial(coefficients, count, b) >= 0.0)
            continue;
        for (double middle = 0.5 * (a + b); a < middle && middle < b; middle = 0.5 * (a + b)) {
            if (at_left * polynomial(coefficients, count, middle) > 0.0)
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

SpringNumber spring_number(double value)
{
    SpringNumber number;
    if (isnan(value)) {
        strcpy(number.text, "nan");
        return number;
    }
    /* repr writes 1e15, but not 1e16, without an exponent. */
    int least = fabs(value) >= 1e15 && fabs(value) < 1e16 ? 16 : 15;
    for (int digits = least; digits <= 17; digits++) {
        snprintf(number.text, sizeof number.text, "%.*g", digits, value);
        if (strtod(number.text, NULL) == value)
            break;
    }
    for (char *c = number.text; *c != '\0'; c++)
        if (*c == ',')
            *c = '.';
    if (strpbrk(number.text, ".en") == NULL)
        strcat(number.text, ".0");
    return number;
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
    } columns[] = {{"kE", p->elastic, p->kE}, {"kA", p->amplifier, p->kA}};

    snprintf(text, size, "%s", "");
    for (int i = 0; i < 2; i++)
        if (columns[i].count < 1 || columns[i].count > SPRING_COEFFICIENTS) {
            snprintf(text, size, "`%s` must have between 1 and %d coefficients, got %d.", columns[i].name,
                     SPRING_COEFFICIENTS, columns[i].count);
            return 1;
        }
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < columns[i].count; k++)
            if (!isfinite(columns[i].values[k])) {
                snprintf(text, size, "`%s[%d]` must be finite, got %s.", columns[i].name, k,
                         spring_number(columns[i].values[k]).text);
                return 1;
            }
    for (size_t i = 0; i < sizeof named / sizeof *named; i++)
        if (!isfinite(named[i].value)) {
            snprintf(text, size, "`%s` must be finite, got %s.", named[i].name, spring_number(named[i].value).text);
            return 1;
        }
    if (p->kA[0] != 1.0) {
        snprintf(text, size, "`kA[0]` must be 1 (kappa_omega carries the scale), got %s.",
                 spring_number(p->kA[0]).text);
        return 1;
    }
    if (!(p->kappa_omega > 0.0)) {
        snprintf(text, size, "`kappa_omega` must be > 0 [N], got %s.", spring_number(p->kappa_omega).text);
        return 1;
    }
    if (!(p->rho > 0.0)) {
        snprintf(text, size, "`rho` must be > 0 [1/m], got %s.", spring_number(p->rho).text);
        return 1;
    }
    if (!(SIGMA_LOW <= p->sigma && p->sigma <= SIGMA_HIGH)) {
        snprintf(text, size, "`sigma` must be within [%g, %g], got %s.", SIGMA_LOW, SIGMA_HIGH,
                 spring_number(p->sigma).text);
        return 1;
    }
    if (!(N_LOW <= p->n && p->n <= N_HIGH)) {
        snprintf(text, size, "`n` must be within [%g, %g], got %s.", N_LOW, N_HIGH, spring_number(p->n).text);
        return 1;
    }
    if (!(p->displacement_min < p->displacement_max && isfinite(p->displacement_max - p->displacement_min))) {
        snprintf(text, size, "`displacement_min` must be below `displacement_max` [m], got %s and %s.",
                 spring_number(p->displacement_min).text, spring_number(p->displacement_max).text);
        return 1;
    }
    if (!(p->displacement_min <= p->displacement_offset && p->displacement_offset <= p->displacement_max)) {
        snprintf(text, size,
                 "`displacement_offset` must lie between `displacement_min` and `displacement_max` [m], got %s.",
                 spring_number(p->displacement_offset).text);
        return 1;
    }
    double where;
    double least = least_value(p->kA, p->amplifier, p->displacement_min - p->displacement_offset,
                               p->displacement_max - p->displacement_offset, &where);
    if (!(least > LEAST_AMPLIFIER)) {
        snprintf(text, size,
                 "the amplifier FA (coefficients `kA`) must be > 0 over the identified range, "
                 "got %.6g at displacement %.6g m.",
                 least, where + p->displacement_offset);
        return 1;
    }
    return 0;
}

/* ---- saturation.py ---------------------------------------------------------------------------------------------- */

enum {
    DEGREE = SPRING_POWERS - 1,
    NEWTON_STEPS = 3,
    GAUSS_POINTS = 8,
    MOST_HALVINGS = 4
};

static const double PI = 3.14159265358979323846;
static const double LOWEST = -32.0, HIGHEST = 40.0, QUADRATURE_STEP = 0.25;
static const double CORRECTED = 1e-3;
/* Last Chebyshev coefficient of a piece over its middle value; those left out are at least ten times smaller. */
static const double LARGEST_LAST = 1e-14;
/* Of the Chebyshev polynomial of degree 9, the coefficient of theta^9. */
static const double HIGHEST_POWER = 256.0;

static const double GAUSS_8[GAUSS_POINTS][2] = {
    {-0.18343464249564980, 0.36268378337836198}, {0.18343464249564980, 0.36268378337836198},
    {-0.52553240991632899, 0.31370664587788729}, {0.52553240991632899, 0.31370664587788729},
    {-0.79666647741362674, 0.22238103445337447}, {0.79666647741362674, 0.22238103445337447},
    {-0.96028985649753623, 0.10122853629037626}, {0.96028985649753623, 0.10122853629037626}};

/* The Chebyshev points on [-1, 1], and what turns values there into coefficients of powers of theta. */
typedef struct {
    double theta[SPRING_POWERS], to_monomials[SPRING_POWERS][SPRING_POWERS];
} Basis;

static void monomials_from_chebyshev_values(Basis *basis)
{
    double *theta = basis->theta;
    for (int k = 0; k < SPRING_POWERS; k++)
        theta[k] = cos(PI * (1.0 - k / (double)DEGREE));
    for (int j = 0; j < SPRING_POWERS; j++) {
        double product[SPRING_POWERS] = {1.0};
        for (int k = 0, size = 1; k < SPRING_POWERS; k++)
            if (k != j) {
                double gap = theta[j] - theta[k];
                for (int power = size; power > 0; power--)
                    product[power] = (product[power - 1] - theta[k] * product[power]) / gap;
                product[0] = (0.0 - theta[k] * product[0]) / gap;
                size++;
            }
        for (int power = 0; power < SPRING_POWERS; power++)
            basis->to_monomials[power][j] = product[power];
    }
}

static void interpolant(const Basis *basis, const double *values, double *coefficients)
{
    double middle = values[DEGREE / 2];
    for (int power = 0; power < SPRING_POWERS; power++) {
        double total = 0.0;
        for (int j = 0; j < SPRING_POWERS; j++)
            total += basis->to_monomials[power][j] * (values[j] - middle);
        coefficients[power] = total;
    }
    coefficients[0] += middle;
}

static double chebyshev_point(double theta, double a, double b)
{
    return 0.5 * ((1.0 - theta) * a + (1.0 + theta) * b);
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

static int locate(const double *edges, int count, double value)
{
    return search(edges, 0, count - 2, value);
}

/* An integrand; `of` is what it belongs to. */
typedef double Rate(const SpringSaturation *of, double p);

static double quadrature(Rate *rate, const SpringSaturation *of, double start, double end)
{
    double half = 0.5 * (end - start);
    double middle = 0.5 * (end + start);
    double total = 0.0;
    for (int i = 0; i < GAUSS_POINTS; i++)
        total = total + GAUSS_8[i][1] * rate(of, middle + half * GAUSS_8[i][0]);
    return half * total;
}

static void accumulate(const SpringBranch *branch, Rate *rate, const SpringSaturation *of, double initial, double *sums)
{
    sums[0] = initial;
    for (int i = 1; i < branch->nodes; i++)
        sums[i] = sums[i - 1] + quadrature(rate, of, branch->grid[i - 1], branch->grid[i]);
}

static double rising_rate(const SpringSaturation *table, double q)
{
    double decay = exp(-q);
    double log_u = -log1p(decay);
    return exp(log_u) * (decay / (1.0 + decay)) / -expm1(table->n * log_u);
}

static double falling_rate(const SpringSaturation *table, double y)
{
    return exp(y) / (1.0 + table->curvature * exp(table->n * y));
}

static double abscissa(double n, double xi)
{
    double scaled = n * xi;
    return scaled + log(-expm1(-scaled));
}

static double xi_of_abscissa(double n, double t)
{
    return (clip(t, 0.0, INFINITY) + log1p(exp(-fabs(t)))) / n;
}

static double zeta_of_abscissa(double n, double a)
{
    (void)n;
    return exp(a);
}

static double interpolate(const SpringCells *cells, int cell, double at)
{
    double low = cells->edges[cell];
    double high = cells->edges[cell + 1];
    double theta = clip((2.0 * at - low - high) / (high - low), -1.0, 1.0);
    return polynomial(cells->coefficients[cell], SPRING_POWERS, theta);
}

/* As e^t times a bounded factor, for t itself is rounded to 4e-15 where xi is small. */
static double rising(double n, const SpringCells *cells, int cell, double xi)
{
    double odds = expm1(n * xi) * exp(interpolate(cells, cell, abscissa(n, xi)));
    return odds / (1.0 + odds);
}

static double falling(double n, const SpringCells *cells, int cell, double zeta)
{
    (void)n;
    return zeta * exp(interpolate(cells, cell, log(zeta)));
}

/* The parameter p at which the integral reaches the target. */
static double invert(const SpringBranch *branch, Rate *rate, const SpringSaturation *of, double target)
{
    int cell = locate(branch->integral, branch->nodes, target);
    double origin = branch->grid[cell];
    double base = branch->integral[cell];
    double share = clip((target - base) / (branch->integral[cell + 1] - base), 0.0, 1.0);
    double p = origin + (branch->grid[cell + 1] - origin) * share;
    for (int step = 0; step < NEWTON_STEPS; step++)
        p = p + (target - base - quadrature(rate, of, origin, p)) / rate(of, p);
    return p;
}

/* One branch being tabulated: xi_of(n, abscissa) is |xi|, value(n, cells, cell, |xi|) is |W|. */
typedef struct {
    SpringSaturation *table;
    SpringBranch *branch;
    Rate *rate;
    double (*xi_of)(double n, double abscissa);
    double (*value)(double n, const SpringCells *cells, int cell, double z);
    Basis basis;
} Tabulation;

static void add_cells(const Tabulation *of)
{
    SpringCells *cells = &of->table->cells;
    double differences[SPRING_POWERS];
    for (int cell = 0; cell < cells->count; cell++) {
        for (int k = 0; k < SPRING_POWERS; k++) {
            double spot = chebyshev_point(of->basis.theta[k], cells->edges[cell], cells->edges[cell + 1]);
            differences[k] = invert(of->branch, of->rate, of->table, of->xi_of(of->table->n, spot)) - spot;
        }
        interpolant(&of->basis, differences, cells->coefficients[cell]);
    }
}

/* Adds the piece of a cell from the last piece's end to an abscissa b, or its halves if one polynomial does not do. */
static void add_piece(const Tabulation *of, int cell, double a, double b, int halvings)
{
    const SpringCells *cells = &of->table->cells;
    SpringBranch *branch = of->branch;
    SpringPiece *piece = &branch->piece[branch->pieces];
    double n = of->table->n, low = branch->edges[branch->pieces], high = of->xi_of(n, b);
    *piece = (SpringPiece){.middle = 0.5 * (low + high), .per_half = 2.0 / (high - low)};
    /* The second pass takes up what the rounding errors of the matrix and of the spots have left, some 1e-13. */
    for (int pass = 0; pass < 2; pass++) {
        double rest[SPRING_POWERS], correction[SPRING_POWERS];
        for (int k = 0; k < SPRING_POWERS; k++) {
            double spot = chebyshev_point(of->basis.theta[k], low, high);
            double theta = (spot - piece->middle) * piece->per_half;
            rest[k] = of->value(n, cells, cell, spot) - polynomial(piece->coefficients, SPRING_POWERS, theta);
        }
        interpolant(&of->basis, rest, correction);
        for (int k = 0; k < SPRING_POWERS; k++)
            piece->coefficients[k] += correction[k];
    }
    double last = fabs(piece->coefficients[DEGREE]) / HIGHEST_POWER;
    int room = branch->pieces + cells->count - cell + MOST_HALVINGS < SPRING_PIECES;
    if (last > LARGEST_LAST * fabs(piece->coefficients[0]) && halvings < MOST_HALVINGS && room) {
        double middle = 0.5 * (a + b);
        add_piece(of, cell, a, middle, halvings + 1);
        add_piece(of, cell, middle, b, halvings + 1);
        return;
    }
    branch->edges[++branch->pieces] = high;
}

static void add_pieces(const Tabulation *of)
{
    const SpringCells *cells = &of->table->cells;
    SpringBranch *branch = of->branch;
    double n = of->table->n, first = of->xi_of(n, cells->edges[0]);
    /* Below the cells W is a straight line. */
    branch->piece[0] = (SpringPiece){0.0, 1.0 / first, {0.0, of->value(n, cells, 0, first)}};
    branch->pieces = 1;
    branch->edges[0] = 0.0;
    branch->edges[1] = first;
    for (int cell = 0; cell < cells->count; cell++)
        add_piece(of, cell, cells->edges[cell], cells->edges[cell + 1], 0);
}

/* |W| at |xi| = z on a piece. */
static double value_on(const SpringBranch *branch, int index, double z)
{
    if (index == branch->pieces)
        return 1.0;
    const SpringPiece *piece = &branch->piece[index];
    const double *c = piece->coefficients;
    double theta = (z - piece->middle) * piece->per_half;
    /* Not Horner's rule, whose operations each wait for the one before. */
    double square = theta * theta, fourth = square * square;
    double low = (c[0] + c[1] * theta) + (c[2] + c[3] * theta) * square;
    double high = (c[4] + c[5] * theta) + (c[6] + c[7] * theta) * square;
    double value = low + high * fourth + (c[8] + c[9] * theta) * (fourth * fourth);
    return value < 1.0 ? value : 1.0;
}

static void add_moments(SpringBranch *branch)
{
    memset(branch->moments[0], 0, sizeof branch->moments[0]);
    for (int i = 0; i < branch->pieces; i++) {
        double half = 0.5 * (branch->edges[i + 1] - branch->edges[i]);
        double middle = 0.5 * (branch->edges[i + 1] + branch->edges[i]);
        memcpy(branch->moments[i + 1], branch->moments[i], sizeof branch->moments[i]);
        for (int k = 0; k < GAUSS_POINTS; k++) {
            double z = middle + half * GAUSS_8[k][0];
            double share = half * GAUSS_8[k][1] * value_on(branch, i, z);
            for (int m = 0; m < SPRING_MOMENTS; m++, share *= z)
                branch->moments[i + 1][m] += share;
        }
    }
}

/* A bucket is numbered by the upper 16 bits of a double: the exponent and the first four bits of the mantissa. */
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

static void add_buckets(SpringBranch *branch)
{
    branch->first_bucket = bucket_of(branch->edges[1]);
    int buckets = bucket_of(branch->edges[branch->pieces]) - branch->first_bucket + 1;
    branch->guess[0] = 0;
    for (int k = 1; k <= buckets; k++) {
        double start = start_of_bucket(branch->first_bucket + k);
        branch->guess[k] = (unsigned short)search(branch->edges, branch->guess[k - 1], branch->pieces - 1, start);
    }
}

/* The piece that holds |xi| = z, z >= +0; as many as there are beyond the last. */
static int piece_at(const SpringBranch *branch, double z)
{
    if (!(z < branch->edges[branch->pieces]))
        return branch->pieces;
    int bucket = bucket_of(z) - branch->first_bucket;
    bucket = bucket < 0 ? 0 : bucket;
    return search(branch->edges, branch->guess[bucket], branch->guess[bucket + 1], z);
}

static void tabulate(Tabulation *of)
{
    monomials_from_chebyshev_values(&of->basis);
    add_cells(of);
    add_pieces(of);
    add_moments(of->branch);
    add_buckets(of->branch);
}

static void rising_branch(SpringSaturation *table)
{
    SpringBranch *branch = &table->rising;
    SpringCells *cells = &table->cells;
    branch->nodes = (int)((HIGHEST - LOWEST) / QUADRATURE_STEP) + 1;
    for (int k = 0; k < branch->nodes; k++)
        branch->grid[k] = LOWEST + QUADRATURE_STEP * k;
    accumulate(branch, rising_rate, table, exp(LOWEST), branch->integral);
    double first = abscissa(table->n, branch->integral[0]);
    double last = abscissa(table->n, branch->integral[branch->nodes - 1]);
    cells->count = (int)ceil(last - first);
    double width = (last - first) / cells->count;
    for (int k = 0; k < cells->count; k++)
        cells->edges[k] = first + width * k;
    cells->edges[cells->count] = last;
    Tabulation of = {
        .table = table, .branch = branch, .rate = rising_rate, .xi_of = xi_of_abscissa, .value = rising};
    tabulate(&of);
}

static void falling_branch(SpringSaturation *table)
{
    SpringBranch *branch = &table->falling;
    SpringCells *cells = &table->cells;
    double n = table->n, curvature = table->curvature;
    double lowest = clip(-(36.0 + log1p(curvature)) / n, LOWEST, 0.0);
    cells->count = (int)ceil(-lowest / clip(0.25 / n, 0.0, 0.5));
    branch->nodes = cells->count + 1;
    for (int k = 0; k < branch->nodes; k++)
        branch->grid[k] = lowest * (1.0 - (double)k / cells->count);
    double start = exp(lowest) / (1.0 + curvature * exp(n * lowest) / (1.0 + n));
    accumulate(branch, falling_rate, table, start, branch->integral);
    for (int k = 0; k < branch->nodes; k++)
        cells->edges[k] = log(branch->integral[k]);
    Tabulation of = {
        .table = table, .branch = branch, .rate = falling_rate, .xi_of = zeta_of_abscissa, .value = falling};
    tabulate(&of);
}

double spring_saturation(const SpringSaturation *table, double xi)
{
    const SpringBranch *branch = xi >= 0.0 ? &table->rising : &table->falling;
    double z = fabs(xi);
    double value = value_on(branch, piece_at(branch, z), z);
    return xi >= 0.0 ? value : -value;
}

static double integral_to(const SpringBranch *branch, Rate *rate, const SpringSaturation *of, double p)
{
    if (p <= branch->grid[0])
        return branch->integral[0] * exp(p - branch->grid[0]);
    int cell = locate(branch->grid, branch->nodes, p);
    return branch->integral[cell] + quadrature(rate, of, branch->grid[cell], p);
}

double spring_inverse_saturation(const SpringSaturation *table, double u)
{
    if (u == 0.0)
        return 0.0;
    if (u > 0.0) {
        double q = u < 1.0 ? log(u) - log1p(-u) : HIGHEST;
        return integral_to(&table->rising, rising_rate, table, clip(q, q, HIGHEST));
    }
    return -integral_to(&table->falling, falling_rate, table, log(-u));
}

static double stroke_start(const SpringSaturation *table, double u)
{
    double xi = spring_inverse_saturation(table, u);
    double error = spring_saturation(table, xi) - u;
    double slope = 1.0 + (u >= 0.0 ? -1.0 : table->curvature) * pow(fabs(u), table->n);
    return fabs(error) * (1.0 + table->n) < CORRECTED * slope ? xi - error / slope : xi;
}

/* ---- law.py ----------------------------------------------------------------------------------------------------- */

/* Up to this degree of FA, 8 points give the work within a piece exactly: with W's 9 that is degree 15. */
enum { SMOOTH_DEGREE = SPRING_MOMENTS - 1 };

static void work_rule(SpringLaw *law)
{
    int degree = law->parameters.amplifier - 1;
    int panels = degree <= SMOOTH_DEGREE ? 1 : degree / 2;
    for (int panel = 0; panel < panels; panel++)
        for (int i = 0; i < GAUSS_POINTS; i++) {
            double *point = law->work_rule[panel * GAUSS_POINTS + i];
            point[0] = (2.0 * panel + 1.0 + GAUSS_8[i][0]) / panels - 1.0;
            point[1] = GAUSS_8[i][1] / panels;
        }
    law->work_rule_count = panels * GAUSS_POINTS;
}

static void sensitivity_sums(SpringSaturation *table);

void spring_prepare(SpringLaw *law, const SpringParameters *parameters)
{
    law->parameters = *parameters;
    const SpringParameters *p = &law->parameters;
    derivative(p->kE, p->elastic, law->dFE);
    antiderivative(p->kE, p->elastic, law->FE_work);
    derivative(p->kA, p->amplifier, law->dFA);
    law->x_min = p->displacement_min - p->displacement_offset;
    law->x_max = p->displacement_max - p->displacement_offset;
    law->table.n = p->n;
    law->table.curvature = 2.0 * p->sigma - 1.0;
    rising_branch(&law->table);
    falling_branch(&law->table);
    sensitivity_sums(&law->table);
    work_rule(law);
}

/* ---- restoring.py ----------------------------------------------------------------------------------------------- */

static int slopes(int coefficients)
{
    return coefficients > 1 ? coefficients - 1 : 1;
}

static double elastic_force(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    double inside = clip(x, law->x_min, law->x_max);
    double out = x - inside;
    double force = polynomial(p->kE, p->elastic, inside);
    return out == 0.0 ? force : force + polynomial(law->dFE, slopes(p->elastic), inside) * out;
}

static double amplifier(const SpringLaw *law, double x)
{
    return polynomial(law->parameters.kA, law->parameters.amplifier, clip(x, law->x_min, law->x_max));
}

static double restoring_force(const SpringLaw *law, double x, double omega)
{
    double hysteretic = law->parameters.kappa_omega * omega * amplifier(law, x);
    return elastic_force(law, x) + hysteretic;
}

static double tangent_stiffness(const SpringLaw *law, double x, double omega, int direction)
{
    const SpringParameters *p = &law->parameters;
    double u = direction * omega;
    double slope = 1.0 + (u >= 0.0 ? -1.0 : law->table.curvature) * pow(fabs(u), p->n);
    double inside = clip(x, law->x_min, law->x_max);
    double amplifier_slope = x == inside ? polynomial(law->dFA, slopes(p->amplifier), inside) : 0.0;
    double hysteretic = omega * amplifier_slope + polynomial(p->kA, p->amplifier, inside) * p->rho * slope;
    return polynomial(law->dFE, slopes(p->elastic), inside) + p->kappa_omega * hysteretic;
}

/* ---- work.py ---------------------------------------------------------------------------------------------------- */

/* Where sums of moments would lose more than this factor in accuracy, they are not used. */
static const double WORST_CANCELLATION = 300.0;

static double elastic_work(const SpringLaw *law, double x)
{
    const SpringParameters *p = &law->parameters;
    double inside = clip(x, law->x_min, law->x_max);
    double out = x - inside;
    double work = polynomial(law->FE_work, p->elastic + 1, inside);
    if (out == 0.0)
        return work;
    double force = polynomial(p->kE, p->elastic, inside);
    double slope = polynomial(law->dFE, slopes(p->elastic), inside);
    return work + out * (force + 0.5 * slope * out);
}

/* A part of a stroke on one branch, x = x_at_zero + per_z*|xi|, which crosses no end of the range. */
typedef struct {
    const SpringLaw *law;
    const SpringBranch *branch;
    double x_at_zero, per_z;
} Part;

/* Integral of |W|*FA over |xi| from a to b, both on one piece. */
static double piece_work(const Part *part, int index, double a, double b)
{
    const SpringLaw *law = part->law;
    double half = 0.5 * (b - a), middle = 0.5 * (b + a);
    double total = 0.0;
    for (int i = 0; i < law->work_rule_count; i++) {
        double z = middle + half * law->work_rule[i][0];
        double x = part->x_at_zero + part->per_z * z;
        total += law->work_rule[i][1] * value_on(part->branch, index, z) * amplifier(law, x);
    }
    return half * total;
}

/* The same over whole pieces from the moments, FA being expanded by powers of |xi|. Returns 0, which no work is, where
 * FA has too high a degree or the terms would cancel: when xi = 0 lies many times the range away. */
static double moments_work(const Part *part, int from, int to)
{
    const SpringLaw *law = part->law;
    const SpringBranch *branch = part->branch;
    const double *low = branch->moments[from], *high = branch->moments[to];
    double x = part->x_at_zero + 0.5 * part->per_z * (branch->edges[from] + branch->edges[to]);
    if (x < law->x_min || x > law->x_max)
        return amplifier(law, x) * (high[0] - low[0]);
    int count = law->parameters.amplifier;
    if (count > SPRING_MOMENTS)
        return 0.0;
    double f[SPRING_MOMENTS], largest = 0.0, total = 0.0, scale = 1.0;
    double reach = fabs(part->x_at_zero) + fabs(part->per_z) * branch->edges[to];
    for (int k = count - 1; k >= 0; k--) {
        f[k] = law->parameters.kA[k];
        largest = largest * reach + fabs(f[k]);
    }
    for (int m = 0; m < count; m++, scale *= part->per_z) {
        for (int k = count - 2; k >= m; k--)
            f[k] += part->x_at_zero * f[k + 1];
        total += f[m] * scale * (high[m] - low[m]);
    }
    return largest * high[0] < WORST_CANCELLATION * total ? total : 0.0;
}

static double pieces_work(const Part *part, int from, int to)
{
    double total = moments_work(part, from, to);
    for (int i = total == 0.0 ? from : to; i < to; i++)
        total += piece_work(part, i, part->branch->edges[i], part->branch->edges[i + 1]);
    return total;
}

static double branch_work(const Part *part, double a, double b)
{
    const SpringBranch *branch = part->branch;
    int from = piece_at(branch, a), to = piece_at(branch, b);
    if (from == to)
        return piece_work(part, from, a, b);
    double ends = piece_work(part, from, a, branch->edges[from + 1]) + piece_work(part, to, branch->edges[to], b);
    return from + 1 == to ? ends : ends + pieces_work(part, from + 1, to);
}

static double rising_work(const SpringLaw *law, int direction, double x_at_zero, double low, double high)
{
    const SpringParameters *p = &law->parameters;
    Part part = {.law = law, .branch = &law->table.rising, .x_at_zero = x_at_zero, .per_z = direction / p->rho};
    return p->kappa_omega / p->rho * branch_work(&part, low, high);
}

static double falling_work(const SpringLaw *law, int direction, double x_at_zero, double low, double high)
{
    const SpringParameters *p = &law->parameters;
    Part part = {.law = law, .branch = &law->table.falling, .x_at_zero = x_at_zero, .per_z = -direction / p->rho};
    return -p->kappa_omega / p->rho * branch_work(&part, fabs(high), fabs(low));
}

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

SpringMemory spring_rest(double displacement, double omega)
{
    return (SpringMemory){
        .displacement = displacement, .omega = omega, .start = displacement, .settled = displacement};
}

/* The memory at the beginning of a new stroke, which goes in the other direction. */
static void reverse(const SpringLaw *law, SpringMemory *memory, int direction)
{
    memory->energy = spring_absorbed_energy(law, memory);
    memory->start_xi = stroke_start(&law->table, direction * memory->omega);
    memory->settled = memory->displacement;
    memory->start = memory->displacement;
    memory->direction = direction;
}

/* The stroke goes on to a displacement. */
static void go_on(const SpringLaw *law, SpringMemory *memory, double displacement)
{
    double xi = memory->start_xi + law->parameters.rho * fabs(displacement - memory->start);
    memory->displacement = displacement;
    memory->omega = memory->direction * spring_saturation(&law->table, xi);
}

SpringMemory spring_advance(const SpringLaw *law, const SpringMemory *memory, double displacement)
{
    SpringMemory after = *memory;
    double travel = displacement - memory->displacement;
    if (travel == 0.0)
        return after;
    int direction = travel > 0.0 ? 1 : -1;
    if (direction != memory->direction)
        reverse(law, &after, direction);
    go_on(law, &after, displacement);
    return after;
}

double spring_force(const SpringLaw *law, const SpringMemory *memory)
{
    return restoring_force(law, memory->displacement - law->parameters.displacement_offset, memory->omega);
}

double spring_stiffness(const SpringLaw *law, const SpringMemory *memory)
{
    double x = memory->displacement - law->parameters.displacement_offset;
    return tangent_stiffness(law, x, memory->omega, memory->direction ? memory->direction : 1);
}

double spring_absorbed_energy(const SpringLaw *law, const SpringMemory *memory)
{
    const SpringParameters *p = &law->parameters;
    double before = memory->settled - p->displacement_offset, now = memory->displacement - p->displacement_offset;
    if (before == now)
        return memory->energy;
    double elastic = elastic_work(law, now) - elastic_work(law, before);
    double start = memory->start - p->displacement_offset;
    double x_at_zero = start - memory->direction * memory->start_xi / p->rho;
    double low = memory->start_xi + p->rho * fabs(before - start), high = memory->start_xi + p->rho * fabs(now - start);
    return memory->energy + elastic + hysteretic_work(law, memory->direction, x_at_zero, low, high);
}

SpringMemory spring_settle(const SpringLaw *law, const SpringMemory *memory)
{
    SpringMemory settled = *memory;
    settled.energy = spring_absorbed_energy(law, memory);
    settled.settled = memory->displacement;
    return settled;
}

/* ---- sensitivity.py --------------------------------------------------------------------------------------------- */

static double rising_rate_by_n(const SpringSaturation *table, double q)
{
    double log_u = -log1p(exp(-q));
    double complement = -expm1(table->n * log_u);
    return exp((1.0 + table->n) * log_u) / (1.0 + exp(q)) * log_u / (complement * complement);
}

static double falling_rate_by_n(const SpringSaturation *table, double y)
{
    double power = table->curvature * exp(table->n * y);
    return -exp(y) * y * power / ((1.0 + power) * (1.0 + power));
}

static double falling_rate_by_sigma(const SpringSaturation *table, double y)
{
    double power = exp(table->n * y);
    double full = 1.0 + table->curvature * power;
    return -2.0 * exp(y) * power / (full * full);
}

static void sensitivity_sums(SpringSaturation *table)
{
    accumulate(&table->rising, rising_rate_by_n, table, 0.0, table->rising.integral_by_n);
    accumulate(&table->falling, falling_rate_by_n, table, 0.0, table->falling.integral_by_n);
    accumulate(&table->falling, falling_rate_by_sigma, table, 0.0, table->falling.integral_by_sigma);
}

static double running(
    const SpringBranch *branch, Rate *rate, const SpringSaturation *of, const double *sums, double p)
{
    int cell = locate(branch->grid, branch->nodes, p);
    return sums[cell] + quadrature(rate, of, branch->grid[cell], clip(p, branch->grid[0], INFINITY));
}

/* W' and the derivatives of W by sigma and n at the xi where W is u. */
typedef struct {
    double slope, by_sigma, by_n;
} Slopes;

static Slopes slopes_of(const SpringSaturation *table, double u)
{
    const SpringBranch *up = &table->rising, *down = &table->falling;
    double log_size = log(clip(fabs(u), 1e-300, 1.0));
    Slopes found = {0.0, 0.0, 0.0};
    if (u >= 0.0) {
        found.slope = -expm1(table->n * log_size);
        if (0.0 < u && u < 1.0)
            found.by_n = -found.slope * running(up, rising_rate_by_n, table, up->integral_by_n, log(u) - log1p(-u));
    } else {
        found.slope = 1.0 + table->curvature * exp(table->n * log_size);
        found.by_n = found.slope * running(down, falling_rate_by_n, table, down->integral_by_n, log_size);
        found.by_sigma = found.slope * running(down, falling_rate_by_sigma, table, down->integral_by_sigma, log_size);
    }
    return found;
}

/* Derivatives of omega where the path ends. */
static SpringSensitivity omega_derivatives(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity)
{
    int direction = memory->direction;
    if (direction == 0)
        return (SpringSensitivity){.by_omega_start = 1.0};
    Slopes at = slopes_of(&law->table, direction * memory->omega);
    double length = fabs(memory->displacement - memory->start);
    return (SpringSensitivity){
        .by_rho = direction * at.slope * (sensitivity->by_rho + length),
        .by_sigma = direction * (at.slope * sensitivity->by_sigma + at.by_sigma),
        .by_n = direction * (at.slope * sensitivity->by_n + at.by_n),
        .by_omega_start = direction * at.slope * sensitivity->by_omega_start,
    };
}

SpringSensitivity spring_advance_sensitivity(
    const SpringLaw *law, const SpringMemory *before, const SpringSensitivity *sensitivity, const SpringMemory *after)
{
    if (after->direction == before->direction)
        return *sensitivity;
    SpringSensitivity change = omega_derivatives(law, before, sensitivity);
    int direction = after->direction;
    Slopes at = slopes_of(&law->table, direction * before->omega);
    double slope = clip(at.slope, 1e-12, INFINITY);
    return (SpringSensitivity){
        .by_rho = direction * change.by_rho / slope,
        .by_sigma = (direction * change.by_sigma - at.by_sigma) / slope,
        .by_n = (direction * change.by_n - at.by_n) / slope,
        .by_omega_start = direction * change.by_omega_start / slope,
    };
}

void spring_move(const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, double displacement)
{
    double travel = displacement - memory->displacement;
    if (travel == 0.0)
        return;
    if (memory->direction == (travel > 0.0 ? 1 : -1)) {
        go_on(law, memory, displacement);
        return;
    }
    SpringMemory after = spring_advance(law, memory, displacement);
    if (sensitivity != NULL)
        *sensitivity = spring_advance_sensitivity(law, memory, sensitivity, &after);
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

/* An output depends on x = displacement - offset, and on x held between min - offset and max - offset, `inside`. */
static void place(SpringGradient *gradient, int side, double by_x, double by_inside)
{
    gradient->by_displacement_offset = -(by_x + by_inside);
    gradient->by_displacement_min = side < 0 ? by_inside : 0.0;
    gradient->by_displacement_max = side > 0 ? by_inside : 0.0;
}

void spring_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity,
    SpringGradient *of_force, SpringGradient *of_stiffness)
{
    const SpringParameters *p = &law->parameters;
    const double rho = p->rho, kappa = p->kappa_omega, omega = memory->omega, n = p->n;
    double x = memory->displacement - p->displacement_offset;
    double inside = clip(x, law->x_min, law->x_max), out = x - inside;
    int side = x < law->x_min ? -1 : x > law->x_max ? 1 : 0;
    double within = side == 0 ? 1.0 : 0.0;
    int direction = memory->direction ? memory->direction : 1;
    SpringSensitivity change = omega_derivatives(law, memory, sensitivity);

    /* Paper eq. (22): slope is 1 + factor*|u|^n, and these are its derivatives by u, sigma and n. */
    double u = direction * omega, size = clip(fabs(u), DBL_EPSILON, 1.0);
    double factor = u >= 0.0 ? -1.0 : law->table.curvature;
    double power = pow(fabs(u), n);
    double slope = 1.0 + factor * power;
    double slope_by_u = (u >= 0.0 ? 1.0 : -1.0) * factor * n * pow(size, n - 1.0);
    double slope_by_sigma = u >= 0.0 ? 0.0 : 2.0 * power;
    double slope_by_n = factor * power * log(size);

    double ddFE[SPRING_COEFFICIENTS], ddFA[SPRING_COEFFICIENTS];
    int elastic = slopes(p->elastic), hysteretic = slopes(p->amplifier);
    int elastics = derivative(law->dFE, elastic, ddFE), hysteretics = derivative(law->dFA, hysteretic, ddFA);
    double FE_1 = polynomial(law->dFE, elastic, inside), FE_2 = polynomial(ddFE, elastics, inside);
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
    for (int i = 0; i < p->amplifier; i++) {
        of_force->by_kA[i] = kappa * omega * value[i];
        of_stiffness->by_kA[i] = kappa * (omega * first[i] * within + value[i] * rho * slope);
    }

    of_force->by_displacement = spring_stiffness(law, memory);
    of_force->by_kappa_omega = omega * FA;
    of_force->by_rho = kappa * FA * change.by_rho;
    of_force->by_sigma = kappa * FA * change.by_sigma;
    of_force->by_n = kappa * FA * change.by_n;
    of_force->by_omega_start = kappa * FA * change.by_omega_start;
    place(of_force, side, FE_1, FE_2 * out + kappa * omega * FA_1);

    double by_omega = kappa * (FA_1 * within + FA * rho * slope_by_u * direction);
    double by_slope = kappa * FA * rho;
    double by_inside = FE_2 + kappa * (omega * FA_2 * within + FA_1 * rho * slope);
    of_stiffness->by_displacement = by_inside * within + by_omega * rho * slope;
    of_stiffness->by_kappa_omega = omega * FA_1 * within + FA * rho * slope;
    of_stiffness->by_rho = by_omega * change.by_rho + kappa * FA * slope;
    of_stiffness->by_sigma = by_omega * change.by_sigma + by_slope * slope_by_sigma;
    of_stiffness->by_n = by_omega * change.by_n + by_slope * slope_by_n;
    of_stiffness->by_omega_start = by_omega * change.by_omega_start;
    place(of_stiffness, side, 0.0, by_inside);
}
