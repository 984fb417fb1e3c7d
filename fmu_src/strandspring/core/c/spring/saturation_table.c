#include "numerics.h"
#include "saturation.h"

/* Tables are made here, and looked up in saturation.c, which needs no mathematics library. */
#ifndef SPRING_STEPS_ONLY

#include <float.h>
#include <math.h>
#include <string.h>

enum { DEGREE = SPRING_POWERS - 1 };

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
/* Of 1 - |W|: a table ends earlier only where W is not yet level within rounding, or its inverse would change. */
static const double LEAST_COMPLEMENT = 1e-12;
/* The order in which interpolation takes the nodes: each far from those before, or rounding errors grow. */
static const int ORDER[SPRING_POWERS] = {0, 11, 6, 3, 9, 1, 8, 5, 10, 2, 7, 4};

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

static void make_rule(SpringRule *rule)
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
static void rising_nodes(const SpringTable *table, const SpringBranchDraft *of, int index, Nodes *nodes)
{
    double first = exp(-(of->lowest + of->width * (index - 1)));
    double log_of[SPRING_POWERS];
    for (int k = 0; k < SPRING_POWERS; k++) {
        log_of[k] = -log1p(first * of->share[k]);
        nodes->slope[k] = -expm1(table->n * log_of[k]);
    }
    /* Without calls, which compilers vectorise. */
    for (int k = 0; k < SPRING_POWERS; k++) {
        double decay = first * of->share[k], log_u = log_of[k], u = 1.0 / (1.0 + decay), slope = nodes->slope[k];
        nodes->value[k] = u;
        nodes->complement[k] = -decay * u;
        nodes->rate[k] = u * u * decay / slope;
        nodes->rate_by_n[k] = nodes->rate[k] * (1.0 - slope) * log_u / slope;
        nodes->rate_by_sigma[k] = 0.0;
    }
}

/* -xi = T(w) over y = ln(w), w = -u; rate is d(-xi)/dy. */
static void falling_nodes(const SpringTable *table, const SpringRule *rule, const SpringBranchDraft *of, int index,
                          int pieces, Nodes *nodes)
{
    double y[SPRING_POWERS];
    for (int k = 0; k < SPRING_POWERS; k++)
        y[k] = of->lowest - of->lowest * (index - 1) / pieces + of->half * (1.0 + rule->node[k]);
    double first = exp(y[0]), first_n = exp(table->n * y[0]);
    for (int k = 0; k < SPRING_POWERS; k++) {
        double w = first * of->share[k], power = first_n * of->share_n[k], slope = 1.0 + table->curvature * power;
        nodes->value[k] = w;
        nodes->slope[k] = slope;
        nodes->rate[k] = w / slope;
        nodes->rate_by_n[k] = -nodes->rate[k] * y[k] * table->curvature * power / slope;
        nodes->rate_by_sigma[k] = -2.0 * nodes->rate[k] * power / slope;
    }
    nodes->complement[DEGREE] = expm1(y[DEGREE]); /* at the end of the piece; between no-one asks for it */
}

/* Integral up to each node, or to the end of the piece alone, of what its rate is at the nodes. */
static void integrate(
    const SpringRule *rule, double half, const double *rate, double start, int everywhere, double *integral)
{
    double total[SPRING_POWERS] = {0.0};
    if (!everywhere) {
        for (int i = 0; i < SPRING_POWERS; i++)
            total[DEGREE] += rule->integral[i][DEGREE] * rate[i];
        integral[DEGREE] = start + half * total[DEGREE];
        return;
    }
    for (int i = 0; i < SPRING_POWERS; i++)
        for (int j = 0; j < SPRING_POWERS; j++)
            total[j] += rule->integral[i][j] * rate[i];
    for (int j = 0; j < SPRING_POWERS; j++)
        integral[j] = start + half * total[j];
}

/* A derivative of |W| from the integral of that of |xi|. */
static void fit_derivative(const Grid *grid, const Nodes *nodes, double *integral, double *coefficients)
{
    /* With I the integral, xi = I(u) at a fixed xi gives d|W| = -W' dI. */
    for (int k = 0; k < SPRING_POWERS; k++)
        integral[k] *= -nodes->slope[k];
    memset(coefficients, 0, SPRING_POWERS * sizeof *coefficients);
    add_interpolant(grid, integral, coefficients);
}

/* A straight line from the origin up to the first node that is resolved. */
static void begin_branch(SpringBranch *branch, double z, double value)
{
    memset(branch->sums[1], 0, sizeof branch->sums[1]);
    memset(branch->is_fitted, 0, sizeof branch->is_fitted);
    branch->is_fitted[0] = 1;
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

static void fit_piece(SpringBranch *branch, int index, const Grid *grid, const Nodes *nodes, int with)
{
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
}

/* The piece from an edge to the next, which becomes known; its polynomials if they are wanted. */
static void make_piece(SpringDraft *draft, int falls, int index, int fits)
{
    SpringTable *table = draft->table;
    SpringBranch *branch = falls ? &table->falling : &table->rising;
    SpringBranchDraft *of = &draft->branch[falls];
    double before = branch->edges[index], lost = branch->sums[index][0];
    double integral[2][SPRING_POWERS];
    Nodes nodes;
    if (falls)
        falling_nodes(table, &draft->rule, of, index, branch->pieces - 1, &nodes);
    else
        rising_nodes(table, of, index, &nodes);
    integrate(&draft->rule, of->half, nodes.rate, 0.0, fits, nodes.z);
    /* W' may be 2000, so that the roundings of a hundred pieces would count: what they lose is carried from piece to
     * piece. */
    double step = nodes.z[DEGREE] + lost;
    branch->edges[index + 1] = before + (lost + nodes.z[DEGREE]);
    branch->values[index + 1] = nodes.value[DEGREE];
    branch->complements[index + 1] = nodes.complement[DEGREE];
    if (falls && index + 1 == branch->pieces)
        branch->values[index + 1] = 1.0; /* exactly, so that every u from -1 on has its place */
    branch->sums[index + 1][0] = step - (branch->edges[index + 1] - before);
    /* By n alone, or by n and sigma. */
    int derivatives = draft->with & SPRING_WITH_DERIVATIVES ? 1 + falls : 0;
    for (int k = 0; k < derivatives; k++) {
        integrate(&draft->rule, of->half, k == 0 ? nodes.rate_by_n : nodes.rate_by_sigma, branch->sums[index][1 + k], fits,
                  integral[k]);
        branch->sums[index + 1][1 + k] = integral[k][DEGREE];
    }
    if (!fits)
        return;
    Grid grid;
    for (int k = 0; k < SPRING_POWERS; k++)
        nodes.z[k] = before + (lost + nodes.z[k]);
    make_grid(&grid, nodes.z);
    for (int k = 0; k < derivatives; k++)
        fit_derivative(&grid, &nodes, integral[k], k == 0 ? branch->by_n[index] : branch->by_sigma[index]);
    fit_piece(branch, index, &grid, &nodes, draft->with);
    branch->is_fitted[index] = 1;
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

static void begin_rising(SpringDraft *draft, const Fineness *is)
{
    SpringBranch *branch = &draft->table->rising;
    SpringBranchDraft *of = &draft->branch[0];
    double lowest = 1.0 / (1.0 + exp(-is->lowest));
    of->lowest = is->lowest;
    of->width = is->width;
    of->half = 0.5 * is->width;
    for (int k = 0; k < SPRING_POWERS; k++)
        of->share[k] = exp(-0.5 * is->width * (1.0 + draft->rule.node[k]));
    branch->pieces = 1 + (int)((is->highest - is->lowest) / is->width);
    branch->complemented = 1 - (int)(is->lowest / is->width);
    begin_branch(branch, rising_series(draft->table->n, lowest), lowest);
}

static void begin_falling(SpringDraft *draft, const Fineness *is)
{
    SpringBranch *branch = &draft->table->falling;
    SpringBranchDraft *of = &draft->branch[1];
    double n = draft->table->n, curvature = draft->table->curvature;
    /* Below this the term (2 sigma - 1)*w^n is lost in rounding. */
    of->lowest = clip(-(is->lost + log1p(curvature)) / n, is->lowest, 0.0);
    int pieces = (int)ceil(-of->lowest / clip(is->width / n, 0.0, is->width));
    of->half = -0.5 * of->lowest / pieces;
    for (int k = 0; k < SPRING_POWERS; k++) {
        of->share[k] = exp(of->half * (1.0 + draft->rule.node[k]));
        of->share_n[k] = exp(n * of->half * (1.0 + draft->rule.node[k]));
    }
    branch->pieces = 1 + pieces;
    branch->complemented = SPRING_PIECES;
    begin_branch(branch, falling_series(n, curvature, exp(of->lowest)), exp(of->lowest));
}

/* Up to |xi| = highest at least. */
static void make_pieces(
    SpringDraft *draft, SpringTable *table, double n, double sigma, int with, double highest, int fits)
{
    const Fineness *is = with & SPRING_COARSE ? &COARSE : &FINE;
    table->n = n;
    table->curvature = 2.0 * sigma - 1.0;
    table->has_energies = (with & SPRING_WITH_ENERGIES) != 0;
    draft->table = table;
    draft->with = with;
    make_rule(&draft->rule);
    begin_rising(draft, is);
    begin_falling(draft, is);
    for (int index = 1; index < table->rising.pieces; index++) {
        make_piece(draft, 0, index, fits);
        if (table->rising.edges[index] > highest && table->rising.complements[index] < -LEAST_COMPLEMENT)
            table->rising.pieces = index + 1;
    }
    for (int index = 1; index < table->falling.pieces; index++)
        make_piece(draft, 1, index, fits);
}

void spring_draft(SpringDraft *draft, SpringTable *table, double n, double sigma, int with, double highest)
{
    make_pieces(draft, table, n, sigma, with, highest, 0);
}

void spring_fit(SpringDraft *draft, int falls, int piece)
{
    const SpringBranch *branch = falls ? &draft->table->falling : &draft->table->rising;
    if (!branch->is_fitted[piece])
        make_piece(draft, falls, piece, 1);
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
    SpringDraft draft;
    make_pieces(&draft, table, n, sigma, with, INFINITY, 1);
    if (table->has_energies) {
        double scale[GAUSS_POINTS];
        make_scales(scale);
        add_shares(scale, &table->rising);
        add_shares(scale, &table->falling);
    }
}

#endif
