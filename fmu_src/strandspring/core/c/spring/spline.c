#include "spline.h"

/* The equations of the second derivatives at the inner knots. `first` and `last` say how far those at the ends lie on
 * the lines through their neighbours: M_0 = M_1 + first*(M_1 - M_2). */
typedef struct {
    int size;
    double width[SPRING_KNOTS - 1];
    double lower[SPRING_KNOTS - 2], diagonal[SPRING_KNOTS - 2], upper[SPRING_KNOTS - 2];
    double first, last;
} BendEquations;

static void make_equations(BendEquations *equations, int count, const double *knots)
{
    double *h = equations->width;
    int size = equations->size = count - 2;
    for (int k = 0; k < count - 1; k++)
        h[k] = knots[k + 1] - knots[k];
    /* NOLINTBEGIN(clang-analyzer-core.UndefinedBinaryOperatorResult): a table that has been checked has 7 knots or
     * more. */
    for (int k = 0; k < size; k++) {
        equations->lower[k] = h[k] / 6.0;
        equations->diagonal[k] = (h[k] + h[k + 1]) / 3.0;
        equations->upper[k] = h[k + 1] / 6.0;
    }
    equations->first = h[0] / h[1];
    equations->last = h[size] / h[size - 1];
    /* NOLINTEND(clang-analyzer-core.UndefinedBinaryOperatorResult) */
    equations->diagonal[0] += (1.0 + equations->first) * h[0] / 6.0;
    equations->upper[0] -= equations->first * h[0] / 6.0;
    equations->diagonal[size - 1] += (1.0 + equations->last) * h[size] / 6.0;
    equations->lower[size - 1] -= equations->last * h[size] / 6.0;
}

/* Solves them, the solution replacing the right side. The diagonal dominates, so that elimination needs no
 * interchange. */
static void solve(const BendEquations *equations, double *right)
{
    double diagonal[SPRING_KNOTS - 2] = {equations->diagonal[0]};
    int size = equations->size;
    for (int k = 1; k < size; k++) {
        double share = equations->lower[k] / diagonal[k - 1];
        diagonal[k] = equations->diagonal[k] - share * equations->upper[k - 1];
        right[k] -= share * right[k - 1];
    }
    right[size - 1] /= diagonal[size - 1];
    for (int k = size - 2; k >= 0; k--)
        right[k] = (right[k] - equations->upper[k] * right[k + 1]) / diagonal[k];
}

static void solve_transposed(BendEquations *equations, double *right)
{
    for (int k = 1; k < equations->size; k++) {
        double lower = equations->lower[k];
        equations->lower[k] = equations->upper[k - 1];
        equations->upper[k - 1] = lower;
    }
    solve(equations, right);
}

void spring_spline(SpringSpline *spline, int count, const double *knots, const double *forces, double offset)
{
    double M[SPRING_KNOTS], work = 0.0;
    BendEquations equations;
    for (int k = 0; k < count; k++)
        spline->knots[k] = knots[k] - offset;
    make_equations(&equations, count, spline->knots);
    const double *h = equations.width;
    int last = count - 1;
    for (int k = 1; k < last; k++)
        M[k] = (forces[k + 1] - forces[k]) / h[k] - (forces[k] - forces[k - 1]) / h[k - 1];
    solve(&equations, M + 1);
    M[0] = M[1] + equations.first * (M[1] - M[2]);
    M[last] = M[last - 1] + equations.last * (M[last - 1] - M[last - 2]);
    for (int k = 0; k < last; k++) {
        double *c = spline->cubic[k];
        c[0] = forces[k];
        c[1] = (forces[k + 1] - forces[k]) / h[k] - h[k] * (2.0 * M[k] + M[k + 1]) / 6.0;
        c[2] = 0.5 * M[k];
        c[3] = (M[k + 1] - M[k]) / (6.0 * h[k]);
        spline->work[k] = work;
        work = spline_work(spline, k, h[k]);
    }
    int home = spline_piece(spline, count, 0.0);
    double at_offset = spline_work(spline, home, -spline->knots[home]);
    for (int k = 0; k < last; k++)
        spline->work[k] -= at_offset;
}

/* What is asked for is linear in the two forces and the two second derivatives at the ends of the piece. The latter
 * solve T*M = D*forces, so that the weights of a row of theirs, w, are D^T of the solution of T^T*z = w. */
static void weights_of_forces(
    const SpringSpline *spline, int count, double x, double by_force, double by_slope, double *weights)
{
    BendEquations equations;
    make_equations(&equations, count, spline->knots);
    const double *h = equations.width;
    int i = spline_piece(spline, count, x), last = count - 1;
    double t = x - spline->knots[i], width = h[i];
    /* The weights of the coefficients of the piece. */
    double of_1 = by_force * t + by_slope;
    double of_2 = t * (by_force * t + 2.0 * by_slope);
    double of_3 = t * t * (by_force * t + 3.0 * by_slope);
    double w[SPRING_KNOTS] = {0.0};
    w[i] = 0.5 * of_2 - of_1 * width / 3.0 - of_3 / (6.0 * width);
    w[i + 1] = of_3 / (6.0 * width) - of_1 * width / 6.0;
    w[1] += (1.0 + equations.first) * w[0];
    w[2] -= equations.first * w[0];
    w[last - 1] += (1.0 + equations.last) * w[last];
    w[last - 2] -= equations.last * w[last];
    solve_transposed(&equations, w + 1);
    for (int k = 0; k < count; k++)
        weights[k] = 0.0;
    weights[i] = by_force - of_1 / width;
    weights[i + 1] = of_1 / width;
    for (int k = 1; k < last; k++) {
        weights[k - 1] += w[k] / h[k - 1];
        weights[k] -= w[k] / h[k - 1] + w[k] / h[k];
        weights[k + 1] += w[k] / h[k];
    }
}

/* When knot k moves, FE changes by -FE' there, so that it passes through the force at the new place; its second
 * derivative, which must be continuous at the new place, changes by a step of -J at the old one, J being the step of
 * the third. With g = -J/2*(x - knot)^2 beyond the knot, the change less g is the spline through what it is at the
 * knots. */
void spring_spline_gradient(
    const SpringSpline *spline, int count, double x, double by_force, double by_slope, double *by_forces,
    double *by_knots)
{
    int last = count - 1;
    weights_of_forces(spline, count, x, by_force, by_slope, by_forces);
    for (int k = 0; k < count; k++) {
        int piece = k < last ? k : last - 1;
        double knot = spline->knots[k], beyond = x > knot ? x - knot : 0.0;
        double step = k == 0 || k == last ? 0.0 : 6.0 * (spline->cubic[k][3] - spline->cubic[k - 1][3]);
        double total = -step * beyond * (0.5 * by_force * beyond + by_slope);
        total -= spline_slope(spline, piece, knot - spline->knots[piece]) * by_forces[k];
        for (int j = k + 1; j < count; j++) {
            double distance = spline->knots[j] - knot;
            total += 0.5 * step * distance * distance * by_forces[j];
        }
        by_knots[k] = total;
    }
}
