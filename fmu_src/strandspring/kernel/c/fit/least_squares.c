#include "least_squares.h"
#include "../linear.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum {
    VECTORS = 11,
    SWEEPS = 60,
    RADIUS_ITERATIONS = 10
};
static const double NEGLIGIBLE = 0.1;        /* share of the tolerance up to which a step that promises so little is not
                                              * tried */
static const double LEAST_STEP = 1e-12;      /* relative length of a step at which the iteration ends */
static const double LEAST_GRADIENT = 1e-14;  /* gradient at which it ends */
static const double RADIUS_TOLERANCE = 0.01; /* share of the trust radius to which a step's length is matched to it */
static const double NEAR_BOUND = 0.995;      /* share of the way to a bound that a step may go */

/* The quadratic model s.H.s/2 + g.s of the cost in variables s = (x - best)/unit, at the best point. */
typedef struct {
    size_t n;
    const double *low, *high;
    double *x, *unit, *gradient, *hessian; /* H in rows of n */
    double back;                           /* share of the way to a bound that a step may go now */
    double *reflected, *on_bound, *candidate;
} Model;

/* The same by its singular values: of J and the barriers of the bounds, in columns. */
typedef struct {
    size_t n, felt;
    double *columns, *turns;  /* orthogonal columns of 2n; the rotation that made them so, in columns of n */
    double *singular, *along; /* length of each column, and the residuals along it times that length */
} Rotated;

/* ---- the quadratic model ---- */

static double bend(const Model *model, const double *a, const double *b)
{
    double total = 0.0;
    for (size_t i = 0; i < model->n; i++)
        total += a[i] * linear_product(model->n, model->hessian + i * model->n, b);
    return total;
}

static double model_value(const Model *model, const double *s)
{
    return 0.5 * bend(model, s, s) + linear_product(model->n, model->gradient, s);
}

/* The stride within [low, high] along s from an origin (NULL: 0) with the least value, and that value. */
static double least_along(
    const Model *model, const double *s, double low, double high, const double *origin, double *value)
{
    double curvature = 0.5 * bend(model, s, s), slope = linear_product(model->n, model->gradient, s), constant = 0.0;
    if (origin != NULL) {
        slope += bend(model, origin, s);
        constant = model_value(model, origin);
    }
    double middle = -0.5 * slope / curvature, best = low;
    *value = low * (curvature * low + slope) + constant;
    const double strides[2] = {high, low < middle && middle < high ? middle : high};
    for (int k = 0; k < 2; k++) {
        double there = strides[k] * (curvature * strides[k] + slope) + constant;
        if (there < *value) {
            *value = there;
            best = strides[k];
        }
    }
    return best;
}

/* Multiple of a step in s at which it meets a bound, from an origin in s (NULL: 0). */
static double to_bound(const Model *model, const double *origin, const double *step)
{
    double least = INFINITY;
    for (size_t i = 0; i < model->n; i++) {
        double from = model->x[i] + (origin != NULL ? model->unit[i] * origin[i] : 0.0);
        double move = model->unit[i] * step[i];
        double stride = move > 0.0 ? (model->high[i] - from) / move : (model->low[i] - from) / move;
        if (move != 0.0 && stride < least)
            least = stride;
    }
    return least;
}

/* Multiple of a direction at which it leaves the trust region. */
static double to_radius(size_t n, const double *origin, const double *direction, double radius)
{
    double a = linear_product(n, direction, direction), b = linear_product(n, origin, direction);
    double c = linear_product(n, origin, origin) - radius * radius, root = b * b - a * c;
    double q = -(b + copysign(sqrt(root > 0.0 ? root : 0.0), b));
    return q / a > c / q ? q / a : c / q;
}

/* A candidate takes the place of the step if the model promises more of it. */
static void propose(const Model *model, double value, double *step, double *best)
{
    if (value < *best) {
        *best = value;
        memcpy(step, model->candidate, model->n * sizeof *step);
    }
}

/* The best of a step shortened, reflected at the bound it meets, and along the gradient; returns what it promises. */
static double inside_bounds(const Model *model, double *step, double radius)
{
    size_t n = model->n;
    double stride = to_bound(model, NULL, step), best = INFINITY, value;
    int is_inside = 1;
    for (size_t i = 0; i < n; i++) {
        double there = model->x[i] + model->unit[i] * step[i];
        is_inside &= there >= model->low[i] && there <= model->high[i];
    }
    if (is_inside)
        return -model_value(model, step);
    for (size_t i = 0; i < n; i++) {
        double move = model->unit[i] * step[i];
        double own = ((move > 0.0 ? model->high[i] : model->low[i]) - model->x[i]) / move;
        model->on_bound[i] = stride * step[i];
        model->reflected[i] = move != 0.0 && own == stride ? -step[i] : step[i];
    }
    double inside = to_radius(n, model->on_bound, model->reflected, radius);
    double bound = to_bound(model, model->on_bound, model->reflected);
    double reach = bound < inside ? bound : inside;
    if (reach > 0.0) {
        double least = (1.0 - model->back) * stride / reach, most = reach == bound ? model->back * bound : inside;
        if (least <= most) {
            double length = least_along(model, model->reflected, least, most, model->on_bound, &value);
            for (size_t i = 0; i < n; i++)
                model->candidate[i] = model->on_bound[i] + length * model->reflected[i];
            propose(model, value, step, &best);
        }
    }
    for (size_t i = 0; i < n; i++)
        model->candidate[i] = model->back * model->on_bound[i];
    propose(model, model_value(model, model->candidate), step, &best);
    double *downhill = model->reflected;
    for (size_t i = 0; i < n; i++)
        downhill[i] = -model->gradient[i];
    inside = radius / linear_norm(n, downhill);
    bound = to_bound(model, NULL, downhill);
    double length = least_along(model, downhill, 0.0, bound < inside ? model->back * bound : inside, NULL, &value);
    for (size_t i = 0; i < n; i++)
        model->candidate[i] = length * downhill[i];
    propose(model, value, step, &best);
    return -best;
}

/* ---- Gauss-Newton steps ---- */

/* Turns two columns so that they are orthogonal; returns whether they were not. */
static int turn_apart(size_t rows, double *a, double *b, size_t n, double *turn_a, double *turn_b)
{
    double aa = linear_product(rows, a, a), bb = linear_product(rows, b, b), ab = linear_product(rows, a, b);
    if (!(fabs(ab) > DBL_EPSILON * sqrt(aa * bb)))
        return 0;
    double zeta = (bb - aa) / (2.0 * ab), tangent = copysign(1.0, zeta) / (fabs(zeta) + sqrt(1.0 + zeta * zeta));
    double cosine = 1.0 / sqrt(1.0 + tangent * tangent), sine = cosine * tangent;
    for (size_t i = 0; i < rows + n; i++) {
        double *p = i < rows ? a + i : turn_a + (i - rows), *q = i < rows ? b + i : turn_b + (i - rows);
        double before = *p;
        *p = cosine * before - sine * *q;
        *q = sine * before + cosine * *q;
    }
    return 1;
}

/* Singular values by Jacobi's method in the form of Hestenes (1958). */
static void decompose(Rotated *rotated, const double *reduced, size_t residuals)
{
    size_t n = rotated->n, rows = 2 * n;
    double largest = 0.0;
    memset(rotated->turns, 0, n * n * sizeof *rotated->turns);
    for (size_t k = 0; k < n; k++)
        rotated->turns[k * n + k] = 1.0;
    for (int sweep = 0, any = 1; any && sweep < SWEEPS; sweep++) {
        any = 0;
        for (size_t k = 0; k < n; k++)
            for (size_t i = 0; i < k; i++)
                any |= turn_apart(rows, rotated->columns + i * rows, rotated->columns + k * rows, n,
                                  rotated->turns + i * n, rotated->turns + k * n);
    }
    for (size_t k = 0; k < n; k++) {
        rotated->singular[k] = linear_norm(rows, rotated->columns + k * rows);
        rotated->along[k] = linear_product(n, rotated->columns + k * rows, reduced);
        largest = rotated->singular[k] > largest ? rotated->singular[k] : largest;
    }
    /* What has no effect on the residuals, such as the memory of a stroke that is left out, takes no part in steps. */
    rotated->felt = 0;
    for (size_t k = 0; k < n; k++)
        if (rotated->singular[k] > DBL_EPSILON * (double)residuals * largest) {
            size_t to = rotated->felt++;
            rotated->singular[to] = rotated->singular[k];
            rotated->along[to] = rotated->along[k];
            memmove(rotated->turns + to * n, rotated->turns + k * n, n * sizeof *rotated->turns);
        }
}

/* The step with a damping: its negative, and how its length changes with the damping, unless NULL. */
static double damped_length(const Rotated *rotated, double damping, double *slope)
{
    double square = 0.0, change = 0.0;
    for (size_t k = 0; k < rotated->felt; k++) {
        double denominator = rotated->singular[k] * rotated->singular[k] + damping;
        double part = rotated->along[k] / denominator;
        square += part * part;
        change += part * part / denominator;
    }
    *slope = -change / sqrt(square);
    return sqrt(square);
}

static void damped_step(const Rotated *rotated, double damping, double *step)
{
    memset(step, 0, rotated->n * sizeof *step);
    for (size_t k = 0; k < rotated->felt; k++) {
        double part = rotated->along[k] / (rotated->singular[k] * rotated->singular[k] + damping);
        for (size_t i = 0; i < rotated->n; i++)
            step[i] -= part * rotated->turns[k * rotated->n + i];
    }
}

/* The Gauss-Newton step, damped to the trust radius if it is longer (More 1977); returns the damping, which begins
 * with an earlier one. */
static double within_radius(const Rotated *rotated, double radius, double damping, double *step)
{
    double slope, length = damped_length(rotated, 0.0, &slope);
    damped_step(rotated, 0.0, step);
    if (!(length > radius))
        return 0.0;
    double low = -(length - radius) / slope, high = linear_norm(rotated->felt, rotated->along) / radius;
    for (int k = 0; k < RADIUS_ITERATIONS; k++) {
        if (!(low <= damping && damping <= high))
            damping = 0.001 * high > sqrt(low * high) ? 0.001 * high : sqrt(low * high);
        double excess = damped_length(rotated, damping, &slope) - radius;
        if (excess < 0.0)
            high = damping;
        if (damping - excess / slope > low)
            low = damping - excess / slope;
        damping -= (excess + radius) * excess / slope / radius;
        if (fabs(excess) < RADIUS_TOLERANCE * radius)
            break;
    }
    damped_step(rotated, damping, step);
    double share = radius / linear_norm(rotated->n, step);
    for (size_t i = 0; i < rotated->n; i++)
        step[i] *= share;
    return damping;
}

/* ---- the iteration ---- */

/* The model of the best point from R, and its singular values; returns how far the point is from a minimum. `scale` is
 * the greatest length so far of each column of R. */
static double make_model(Model *model, Rotated *rotated, const double *triangle, double *scale, double *room,
                         size_t residuals)
{
    size_t n = model->n, size = n + 1;
    const double *reduced = triangle + n * size;
    double optimality = 0.0;
    int is_first = linear_largest(n, scale) == 0.0;
    for (size_t k = 0; k < n; k++) {
        const double *column = triangle + k * size;
        double norm = linear_norm(n, column), gradient = linear_product(n, column, reduced);
        scale[k] = norm > scale[k] ? norm : scale[k];
        if (is_first && norm == 0.0)
            scale[k] = 1.0;
        /* Coleman and Li's scaling: the distance to the bound towards which the cost falls. */
        room[k] = gradient < 0.0 ? model->high[k] - model->x[k] : gradient > 0.0 ? model->x[k] - model->low[k] : 1.0;
        optimality = fmax(optimality, fabs(gradient * room[k]));
        if (gradient != 0.0)
            room[k] *= scale[k];
        model->unit[k] = sqrt(room[k]) / scale[k];
        model->gradient[k] = model->unit[k] * gradient;
        double *own = rotated->columns + k * 2 * n;
        memset(own, 0, 2 * n * sizeof *own);
        for (size_t i = 0; i < n; i++)
            own[i] = column[i] * model->unit[k];
        own[n + k] = sqrt(fabs(gradient) / scale[k]);
    }
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++)
            model->hessian[i * n + k] =
                linear_product(2 * n, rotated->columns + i * 2 * n, rotated->columns + k * 2 * n);
    model->back = fmax(NEAR_BOUND, 1.0 - optimality);
    decompose(rotated, reduced, residuals);
    return optimality;
}

size_t least_squares_workspace(size_t n)
{
    return (n + 1) * (n + 1) + n * n + 2 * n * n + n * n + VECTORS * n;
}

/* The trust radius to begin with. */
static double first_radius(const double *x, const double *scale, const double *room, size_t n)
{
    double total = 0.0;
    for (size_t k = 0; k < n; k++)
        total += x[k] * scale[k] * x[k] * scale[k] / room[k];
    return total > 0.0 ? sqrt(total) : 1.0;
}

/* Moves a trial by a step from the best point, to within the bounds; the length of its way. */
static double move(const Model *model, const double *step, double *trial)
{
    double square = 0.0;
    for (size_t i = 0; i < model->n; i++) {
        double way = model->unit[i] * step[i];
        double low = nextafter(model->low[i], model->high[i]), high = nextafter(model->high[i], model->low[i]);
        square += way * way;
        trial[i] = fmin(fmax(model->x[i] + way, low), high);
    }
    return sqrt(square);
}

int least_squares(const LeastSquares *given, double *x, double *workspace)
{
    size_t n = given->variables, count = 1;
    double *vector[VECTORS], *triangle = workspace + VECTORS * n, *matrices = triangle + (n + 1) * (n + 1);
    for (int k = 0; k < VECTORS; k++)
        vector[k] = workspace + (size_t)k * n;
    Model model = {n,         given->low, given->high, x,         vector[0], vector[1],
                   matrices, 0.0,        vector[2],   vector[3], vector[4]};
    Rotated rotated = {n, 0, matrices + n * n, matrices + 3 * n * n, vector[5], vector[6]};
    double *scale = vector[7], *room = vector[8], *step = vector[9], *trial = vector[10];
    memset(scale, 0, n * sizeof *scale);
    double radius = 0.0, damping = 0.0, cost = given->cost(given->problem, x);
    given->keep(given->problem);
    for (;;) {
        given->triangle(given->problem, triangle);
        double optimality = make_model(&model, &rotated, triangle, scale, room, given->residuals), reduction = -1.0;
        if (radius == 0.0)
            radius = first_radius(x, scale, room, n);
        if (optimality < LEAST_GRADIENT)
            return 1;
        if (count == given->evaluations)
            return 0;
        while (reduction <= 0.0 && count < given->evaluations) {
            damping = within_radius(&rotated, radius, damping, step);
            double predicted = inside_bounds(&model, step, radius);
            if (damping == 0.0 && 0.0 <= predicted && predicted < NEGLIGIBLE * given->tolerance * cost)
                return 1;
            double way = move(&model, step, trial), after = given->cost(given->problem, trial);
            double length = linear_norm(n, step), before = radius;
            count++;
            if (!isfinite(after)) {
                radius = 0.25 * length;
                continue;
            }
            reduction = cost - after;
            double ratio = predicted > 0.0 ? reduction / predicted : predicted == 0.0 && reduction == 0.0;
            int ends = (reduction < given->tolerance * cost && ratio > 0.25) ||
                       way < LEAST_STEP * (LEAST_STEP + linear_norm(n, x));
            if (ratio < 0.25)
                radius = 0.25 * length;
            else if (ratio > 0.75 && length > 0.95 * radius)
                radius *= 2.0;
            damping *= before / radius;
            if (reduction > 0.0) {
                given->keep(given->problem);
                memcpy(x, trial, n * sizeof *x);
                cost = after;
            }
            if (ends)
                return 1;
        }
    }
}
