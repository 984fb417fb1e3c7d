#include "linear.h"

#include <math.h>

enum {
    PIVOTS = 4 /* columns that are eliminated together */
};

double *linear_taken(double **workspace, size_t count)
{
    double *begin = *workspace;
    *workspace += count;
    return begin;
}

double linear_largest(size_t count, const double *values)
{
    double largest = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (isnan(values[i]))
            return values[i];
        largest = fabs(values[i]) > largest ? fabs(values[i]) : largest;
    }
    return largest;
}

double linear_norm(size_t count, const double *values)
{
    double total = 0.0;
    for (size_t i = 0; i < count; i++)
        total += values[i] * values[i];
    return sqrt(total);
}

double linear_distance(size_t count, const double *a, const double *b)
{
    double total = 0.0;
    for (size_t i = 0; i < count; i++)
        total += (a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(total);
}

/* Eliminates some columns, from the first on, from the rest of a row in the order of their pivots. */
static void eliminate(size_t count, size_t first, size_t pivots, size_t end, const double *matrix, double *row)
{
    for (size_t k = first; k < first + pivots; k++)
        for (size_t j = end; j < count; j++)
            row[j] -= row[k] * matrix[k * count + j];
}

/* The same for PIVOTS columns and two rows at once, which are below those of the pivots. */
static void eliminate_twice(size_t count, size_t first, const double *restrict matrix, double *restrict rows)
{
    const double *a = matrix + first * count, *b = a + count, *c = b + count, *d = c + count;
    double *x = rows, *y = rows + count;
    const double xa = x[first], xb = x[first + 1], xc = x[first + 2], xd = x[first + 3];
    const double ya = y[first], yb = y[first + 1], yc = y[first + 2], yd = y[first + 3];
    for (size_t j = first + PIVOTS; j < count; j++) {
        x[j] = (((x[j] - xa * a[j]) - xb * b[j]) - xc * c[j]) - xd * d[j];
        y[j] = (((y[j] - ya * a[j]) - yb * b[j]) - yc * c[j]) - yd * d[j];
    }
}

/* Brings the row with the largest entry of a column to the diagonal, from another column on; returns 0 if all are 0. */
static int bring_pivot(size_t count, size_t from, size_t column, double *matrix, double *right)
{
    size_t best = column;
    for (size_t i = column + 1; i < count; i++)
        if (fabs(matrix[i * count + column]) > fabs(matrix[best * count + column]))
            best = i;
    double *pivot = matrix + column * count, *row = matrix + best * count;
    for (size_t j = from; best != column && j < count; j++) {
        double kept = pivot[j];
        pivot[j] = row[j];
        row[j] = kept;
    }
    double kept = right[column];
    right[column] = right[best];
    right[best] = kept;
    return fabs(pivot[column]) > 0.0;
}

/* Some columns at a time, whose shares of the pivots take their place, are eliminated from the rest of all rows in one
 * go: each entry sees the same operations in the same order as column by column, in two thirds of the time. */
int linear_solve(size_t count, double *matrix, double *right)
{
    for (size_t first = 0; first < count; first += PIVOTS) {
        size_t end = first + PIVOTS < count ? first + PIVOTS : count;
        for (size_t k = first; k < end; k++) {
            if (!bring_pivot(count, first, k, matrix, right))
                return 0;
            const double *pivot = matrix + k * count;
            for (size_t i = k + 1; i < count; i++) {
                double *below = matrix + i * count;
                below[k] /= pivot[k];
                for (size_t j = k + 1; j < end; j++)
                    below[j] -= below[k] * pivot[j];
                right[i] -= below[k] * right[k];
            }
        }
        size_t row = first + 1;
        for (; row < end; row++)
            eliminate(count, first, row - first, end, matrix, matrix + row * count);
        for (; row + 2 <= count; row += 2)
            eliminate_twice(count, first, matrix, matrix + row * count);
        for (; row < count; row++)
            eliminate(count, first, PIVOTS, end, matrix, matrix + row * count);
    }
    for (size_t k = count; k-- > 0;) {
        double total = right[k];
        for (size_t j = k + 1; j < count; j++)
            total -= matrix[k * count + j] * right[j];
        right[k] = total / matrix[k * count + k];
    }
    return 1;
}
