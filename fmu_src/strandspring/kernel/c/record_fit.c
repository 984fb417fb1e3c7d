#include "record_fit.h"
#include "../../core/c/spring/saturation_table.h"
#include "least_squares.h"
#include "linear.h"
#include "path.h"
#include "projected.h"

#include <math.h>
#include <string.h>

/* What is found at one x. */
typedef struct {
    double *omega;        /* rows of points: omega, then its derivatives */
    double *rows;         /* of moving columns, orthonormal */
    double *residuals, *coefficients;
} FittedPoint;

/* A fit under way. Everything that is taken over points is weighted but omega. */
typedef struct {
    const RecordFit *given;
    size_t variables;
    double *frame, *triangle, *along; /* of the fixed columns, as of projected_fit */
    double *moving, *target;
    double *strokes, *workspace;
    FittedPoint trial, best;
} FitUnderWay;

static FittedPoint take_point(const RecordFit *fit, double **from)
{
    FittedPoint point;
    point.omega = linear_taken(from, (4 + fit->records) * fit->points);
    point.rows = linear_taken(from, fit->moving * fit->points);
    point.residuals = linear_taken(from, fit->points);
    point.coefficients = linear_taken(from, fit->fixed + fit->moving);
    return point;
}

/* Of projected_fit and projected_triangle. */
static size_t projection_workspace(const RecordFit *fit)
{
    size_t width = fit->fixed + fit->moving;
    size_t of_fit = (fit->moving + 1) * width, of_triangle = (4 + fit->records) * fit->points + width;
    return of_fit > of_triangle ? of_fit : of_triangle;
}

size_t record_fit_workspace(const RecordFit *fit)
{
    size_t width = fit->fixed + fit->moving, of_point = (5 + fit->records + fit->moving) * fit->points + width;
    return (width + 1) * fit->points + (fit->fixed + 1) * fit->fixed + 5 * fit->strokes + 2 * of_point +
           projection_workspace(fit) + least_squares_workspace(3 + fit->records);
}

static FitUnderWay lay_out(const RecordFit *fit, double **memory)
{
    FitUnderWay way = {.given = fit, .variables = 3 + fit->records};
    way.frame = linear_taken(memory, fit->fixed * fit->points);
    way.triangle = linear_taken(memory, fit->fixed * fit->fixed);
    way.along = linear_taken(memory, fit->fixed);
    way.moving = linear_taken(memory, fit->moving * fit->points);
    way.target = linear_taken(memory, fit->points);
    way.strokes = linear_taken(memory, 5 * fit->strokes);
    way.trial = take_point(fit, memory);
    way.best = take_point(fit, memory);
    way.workspace = linear_taken(memory, projection_workspace(fit));
    return way;
}

static double cost_at(void *problem, const double *x)
{
    FitUnderWay *way = problem;
    const RecordFit *fit = way->given;
    FittedPoint *trial = &way->trial;
    double rho = exp(x[0]);
    spring_tabulate(fit->table, exp(x[2]), exp(x[1]), fit->with);
    spring_on_records(fit->table, 1, &rho, x + 3, fit->records, fit->first_stroke, fit->first_point, fit->direction,
                      fit->length, fit->stroke, fit->travel, way->strokes, trial->omega, trial->omega + fit->points);
    return projected_fit(fit->points, fit->fixed, way->frame, way->triangle, way->along, fit->moving, way->moving,
                         way->target, trial->omega, trial->rows, trial->coefficients, trial->residuals,
                         way->workspace);
}

static void keep_trial(void *problem)
{
    FitUnderWay *way = problem;
    FittedPoint before = way->best;
    way->best = way->trial;
    way->trial = before;
}

static void triangle_there(void *problem, double *triangle)
{
    FitUnderWay *way = problem;
    const RecordFit *fit = way->given;
    const FittedPoint *best = &way->best;
    projected_triangle(fit->points, fit->fixed, way->frame, fit->moving, way->moving, best->rows, best->coefficients,
                       best->residuals, way->variables, best->omega + fit->points, triangle, way->workspace);
}

int record_fit(const RecordFit *fit, double *x, double *coefficients, double *omega, double *workspace)
{
    double *rest = workspace;
    FitUnderWay way = lay_out(fit, &rest);
    for (size_t k = 0; k < fit->fixed + fit->moving; k++) {
        double *row = k < fit->fixed ? way.frame + k * fit->points : way.moving + (k - fit->fixed) * fit->points;
        for (size_t i = 0; i < fit->points; i++)
            row[i] = fit->columns[k * fit->points + i] * fit->root[i];
    }
    for (size_t i = 0; i < fit->points; i++)
        way.target[i] = fit->force[i] * fit->root[i];
    projected_frame(fit->points, fit->fixed, way.frame, way.triangle);
    projected_beside(fit->points, fit->fixed, way.frame, way.target, way.along);
    const LeastSquares problem = {way.variables,    fit->points, fit->low, fit->high, fit->tolerance,
                                  fit->evaluations, &way,        cost_at,  keep_trial, triangle_there};
    int converged = least_squares(&problem, x, rest);
    memcpy(coefficients, way.best.coefficients, (fit->fixed + fit->moving) * sizeof *coefficients);
    memcpy(omega, way.best.omega, (4 + fit->records) * fit->points * sizeof *omega);
    return converged;
}
