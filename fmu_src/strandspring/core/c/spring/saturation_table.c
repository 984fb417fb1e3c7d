#include "numerics.h"
#include "saturation.h"

/* Tables are made here, and looked up in saturation.c, which needs no mathematics library. */
#ifndef SPRING_STEPS_ONLY

#include <float.h>
#include <math.h>
#include <string.h>

/* Of a series at most so many terms are added, however the host rounds; 731 are the most that count. */
enum { DEGREE = SPRING_POWERS - 1, MOST_TERMS = 1000 };

static const double PI = 3.14159265358979323846;
/* How finely W is tabulated: ln of the smallest |W| resolved, the logit above which W counts as 1, minus ln of what is
 * lost beside 1, and the width of a piece in the logit of W, or in ln|W| and in n*ln|W| on the falling branch. */
typedef struct {
    double lowest, highest, lost, width;
} Fineness;
/* As in saturation.py. The nearest singularity, most often xi = 0, is 4.5 half widths away at least, and the
 * polynomial's error below 1e-13; above the highest logit 1 - W is below a rounding. */
static const Fineness FINE = {-32.0, 36.5, 36.0, 0.45};
/* The nearest singularity is 2.2 half widths away, and the error of W below 1e-8. */
static const Fineness COARSE = {-16.0, 20.0, 16.0, 0.9};
/* The order in which interpolation takes the nodes: each far from those before, or rounding errors grow. */
static const int ORDER[SPRING_POWERS] = {0, 11, 6, 3, 9, 1, 8, 5, 10, 2, 7, 4};

/* Chebyshev-Lobatto nodes on [-1, 1], and the weight of each in the integrals from -1 to all of them. */
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
    /* Both in an order in which every loop reads ahead of what it writes, which compilers vectorise. */
    double difference[SPRING_POWERS], power[SPRING_POWERS];
    for (int k = 0; k < SPRING_POWERS; k++)
        difference[k] = value[ORDER[DEGREE - k]];
    const double *per_gap = grid->per_gap;
    for (int left = DEGREE; left > 0; per_gap += left--)
        for (int k = 0; k < left; k++)
            difference[k] = (difference[k] - difference[k + 1]) * per_gap[k];
    /* Newton's form, multiplied out from the innermost bracket. */
    power[DEGREE] = difference[0];
    for (int first = DEGREE - 1; first >= 0; first--) {
        power[first] = difference[DEGREE - first];
        for (int k = first; k < DEGREE; k++)
            power[k] -= grid->theta[first] * power[k + 1];
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
    double integral[SPRING_POWERS][SPRING_POWERS], share[SPRING_POWERS][SPRING_POWERS];
    for (int j = 0; j < SPRING_POWERS; j++)
        for (int m = 0; m < SPRING_POWERS; m++) {
            double x = rule->node[j], at_start = m % 2 ? 1.0 : -1.0;
            double factor = (m % DEGREE ? 2.0 : 1.0) * (j % DEGREE ? 1.0 : 0.5) / (double)DEGREE;
            share[j][m] = factor * cosine[m * (DEGREE - j) % (2 * DEGREE)];
            integral[j][m] = m == 0 ? x + 1.0 : 0.5 * (x * x - 1.0);
            if (m > 1)
                integral[j][m] = 0.5 * ((cosine[(m + 1) * (DEGREE - j) % (2 * DEGREE)] - at_start) / (m + 1) -
                                        (cosine[(m - 1) * (DEGREE - j) % (2 * DEGREE)] - at_start) / (m - 1));
        }
    for (int i = 0; i < SPRING_POWERS; i++)
        for (int j = 0; j < SPRING_POWERS; j++) {
            double total = 0.0;
            for (int m = 0; m < SPRING_POWERS; m++)
                total += share[i][m] * integral[j][m];
            rule->integral[i][j] = total;
        }
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
        nodes->slope[k] = slope;
        nodes->rate[k] = w / slope;
        nodes->rate_by_n[k] = -nodes->rate[k] * y[k] * table->curvature * power / slope;
        nodes->rate_by_sigma[k] = -2.0 * nodes->rate[k] * power / slope;
    }
    nodes->complement[DEGREE] = expm1(y[DEGREE]); /* at the end of the piece; between no-one asks for it */
}

/* Integral at each node of what its rate is at the nodes, by the piece's half width. */
static void integrate(const Rule *rule, double half, const double *rate, double start, double *integral)
{
    double total[SPRING_POWERS] = {0.0};
    for (int i = 0; i < SPRING_POWERS; i++)
        for (int j = 0; j < SPRING_POWERS; j++)
            total[j] += rule->integral[i][j] * rate[i];
    for (int j = 0; j < SPRING_POWERS; j++)
        integral[j] = start + half * total[j];
}

/* |xi| at the nodes of a piece. W' may be 2000, so that the roundings of a hundred pieces would count: what they lose
 * is carried from piece to piece. */
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

static void add_piece(SpringBranch *branch, const Grid *grid, const Nodes *nodes, int with)
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
    if (!(with & SPRING_COARSE))
        correct(grid, nodes->value, branch->piece[index].coefficients);
    branch->inverse[index] = (SpringPiece){.middle = inverse.middle, .per_half = inverse.per_half};
    add_interpolant(&inverse, theta, branch->inverse[index].coefficients);
    branch->edges[index + 1] = nodes->z[DEGREE];
    branch->values[index + 1] = nodes->value[DEGREE];
    branch->complements[index + 1] = nodes->complement[DEGREE];
}

/* S(u) = sum of u^(k n + 1)/(k n + 1), for a small u. */
static double rising_series(double n, double u)
{
    double factor = pow(u, n), power = u, total = u, before = 0.0;
    for (int k = 1; total > before && k <= MOST_TERMS; k++) {
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
    for (int k = 1; total > before && k <= MOST_TERMS; k++) {
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
        add_piece(branch, &grid, &nodes, with);
    }
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
        add_piece(branch, &grid, &nodes, with);
    }
    /* Exactly, so that every u from -1 on has its place. */
    branch->values[branch->pieces] = 1.0;
}

/* ---- energies ---- */

/* 1/(the product of a Gauss node's distances to the others): the scale of its Lagrange polynomial. */
static void make_scales(double *scale)
{
    for (int k = 0; k < GAUSS_POINTS; k++) {
        double product = 1.0;
        for (int m = 0; m < GAUSS_POINTS; m++)
            product *= m == k ? 1.0 : GAUSS_NODES[k] - GAUSS_NODES[m];
        scale[k] = 1.0 / product;
    }
}

/* Adds weight times each Lagrange polynomial of Gauss's nodes at t. */
static void add_lagrange(const double *scale, double t, double weight, double *shares)
{
    double before[GAUSS_POINTS], after = weight;
    before[0] = 1.0;
    for (int k = 1; k < GAUSS_POINTS; k++)
        before[k] = before[k - 1] * (t - GAUSS_NODES[k - 1]);
    for (int k = GAUSS_POINTS - 1; k >= 0; k--) {
        shares[k] += scale[k] * before[k] * after;
        after *= t - GAUSS_NODES[k];
    }
}

/* A share is the integral of |W| times a Lagrange polynomial of Gauss's nodes: of a group by the shares of its parts. */
static void add_shares(const double *scale, SpringBranch *branch)
{
    const double *edges = branch->edges;
    for (int piece = 0; piece < branch->pieces; piece++)
        spring_shares(branch, piece, edges[piece], edges[piece + 1], branch->shares[piece]);
    for (int level = 1, size = 4; size <= branch->pieces; level++, size *= 4)
        for (int begin = 0, part = size / 4; begin + size <= branch->pieces; begin += size) {
            double *shares = branch->shares[spring_group(level, begin)];
            double middle = 0.5 * (edges[begin] + edges[begin + size]), per_half = 1.0 / (edges[begin + size] - middle);
            memset(shares, 0, sizeof branch->shares[0]);
            for (int at = begin; at < begin + size; at += part)
                for (int k = 0; k < GAUSS_POINTS; k++) {
                    double z = edges[at] + 0.5 * (edges[at + part] - edges[at]) * (1.0 + GAUSS_NODES[k]);
                    double share = branch->shares[spring_group(level - 1, at)][k];
                    add_lagrange(scale, (z - middle) * per_half, share, shares);
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
    table->has_energies = (with & SPRING_WITH_ENERGIES) != 0;
    if (table->has_energies) {
        double scale[GAUSS_POINTS];
        make_scales(scale);
        add_shares(scale, &table->rising);
        add_shares(scale, &table->falling);
    }
}

#endif
