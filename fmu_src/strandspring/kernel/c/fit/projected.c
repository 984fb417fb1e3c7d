#include "projected.h"
#include "../linear.h"

#include <math.h>
#include <string.h>

enum { REPETITIONS = 3 };
static const double LOST = 0.1;        /* of a row's norm is left, and the projection is repeated */
static const double DEPENDENT = 1e-13; /* of a row's norm is left, and it is a combination of those before it */

static void add(size_t count, double factor, const double *restrict a, double *restrict to)
{
    for (size_t i = 0; i < count; i++)
        to[i] += factor * a[i];
}

static void along_rows(size_t points, size_t count, const double *frame, double *row, double *along)
{
    for (size_t k = 0; k < count; k++) {
        double share = linear_product(points, frame + k * points, row);
        add(points, -share, frame + k * points, row);
        along[k] += share;
    }
}

/* Takes from a row what lies along two sets of orthonormal ones; the norm of what is left. */
static double beside(size_t points, size_t first_count, const double *first, size_t second_count, const double *second,
                     double *row, double *along)
{
    double before = sqrt(linear_product(points, row, row)), after = before;
    memset(along, 0, (first_count + second_count) * sizeof *along);
    for (int k = 0; k < REPETITIONS; k++) {
        along_rows(points, first_count, first, row, along);
        along_rows(points, second_count, second, row, along + first_count);
        after = sqrt(linear_product(points, row, row));
        if (!(after < LOST * before))
            break;
        before = after;
    }
    return after;
}

/* Makes rows orthonormal beside a frame; the shares of row k in rows of fixed + count. */
static void orthonormal(size_t points, size_t fixed, const double *frame, size_t count, double *rows, double *shares)
{
    for (size_t k = 0; k < count; k++) {
        double *row = rows + k * points, *along = shares + k * (fixed + count);
        double before = sqrt(linear_product(points, row, row));
        double norm = beside(points, fixed, frame, k, rows, row, along);
        int depends = norm <= DEPENDENT * before;
        for (size_t i = 0; i < points; i++)
            row[i] = depends ? 0.0 : row[i] / norm;
        along[fixed + k] = depends ? 0.0 : norm;
    }
}

void projected_frame(size_t points, size_t count, double *rows, double *triangle)
{
    memset(triangle, 0, count * count * sizeof *triangle);
    orthonormal(points, 0, NULL, count, rows, triangle);
}

void projected_beside(size_t points, size_t count, const double *frame, double *row, double *along)
{
    beside(points, count, frame, 0, NULL, row, along);
}

/* Coefficients of columns whose shares in an orthonormal frame are rows of `width`, from those of a target. */
static void substitute_back(size_t count, size_t width, const double *shares, const double *along, double *coefficients)
{
    for (size_t k = count; k-- > 0;) {
        double left = along[k], own = shares[k * width + k];
        for (size_t j = k + 1; j < count; j++)
            left -= shares[j * width + k] * coefficients[j];
        coefficients[k] = own == 0.0 ? 0.0 : left / own;
    }
}

double projected_fit(size_t points, size_t fixed, const double *frame, const double *triangle, const double *along,
                     size_t count, const double *moving, const double *target, const double *omega, double *rows,
                     double *coefficients, double *residuals, double *workspace)
{
    size_t width = fixed + count;
    double *shares = workspace, *own = workspace + count * width;
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < points; i++)
            rows[k * points + i] = omega[i] * moving[k * points + i];
    orthonormal(points, fixed, frame, count, rows, shares);
    memcpy(residuals, target, points * sizeof *residuals);
    double norm = beside(points, fixed, frame, count, rows, residuals, own);
    substitute_back(count, width, shares + fixed, own + fixed, coefficients + fixed);
    for (size_t i = 0; i < fixed; i++) {
        own[i] += along[i];
        for (size_t k = 0; k < count; k++)
            own[i] -= shares[k * width + i] * coefficients[fixed + k];
    }
    substitute_back(fixed, fixed, triangle, own, coefficients);
    return 0.5 * norm * norm;
}

void projected_triangle(size_t points, size_t fixed, const double *frame, size_t count, const double *moving,
                        const double *rows, const double *coefficients, const double *residuals, size_t parameters,
                        const double *derivatives, double *triangle, double *workspace)
{
    double *sum = workspace + parameters * points, *along = sum + points;
    memset(sum, 0, points * sizeof *sum);
    for (size_t k = 0; k < count; k++)
        add(points, coefficients[fixed + k], moving + k * points, sum);
    for (size_t k = 0; k < parameters; k++) {
        double *row = workspace + k * points;
        for (size_t i = 0; i < points; i++)
            row[i] = -derivatives[k * points + i] * sum[i];
        beside(points, fixed, frame, count, rows, row, along);
    }
    memcpy(sum, residuals, points * sizeof *sum);
    projected_frame(points, parameters + 1, workspace, triangle);
}
