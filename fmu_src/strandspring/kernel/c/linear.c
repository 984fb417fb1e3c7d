#include "linear.h"

#include <math.h>

enum {
    SUMS = 8,  /* that are taken side by side, which compilers vectorise */
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

double linear_product(size_t count, const double *a, const double *b)
{
    double sum[SUMS] = {0.0}, total = 0.0;
    size_t i = 0;
    for (; i + SUMS <= count; i += SUMS)
        for (int k = 0; k < SUMS; k++)
            sum[k] += a[i + k] * b[i + k];
    for (; i < count; i++)
        total += a[i] * b[i];
    for (int k = 0; k < SUMS; k++)
        total += sum[k];
    return total;
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

/* Subtracts shares of `pivots` rows of a matrix from one below them, from a column on, in the order of the rows. */
static void linear_subtract(size_t count, size_t pivots, size_t from, const double *rows, const double *shares,
                            double *below)
{
    if (pivots == PIVOTS) {
        const double *a = rows, *b = a + count, *c = b + count, *d = c + count;
        for (size_t j = from; j < count; j++)
            below[j] = (((below[j] - shares[0] * a[j]) - shares[1] * b[j]) - shares[2] * c[j]) - shares[3] * d[j];
        return;
    }
    for (size_t k = 0; k < pivots; k++)
        for (size_t j = from; j < count; j++)
            below[j] -= shares[k] * rows[k * count + j];
}

/* Brings the row with the largest entry of a column to the diagonal; returns 0 if there is none but zeros. */
static int linear_pivot(size_t count, size_t column, double *matrix, double *right)
{
    size_t best = column;
    for (size_t i = column + 1; i < count; i++)
        if (fabs(matrix[i * count + column]) > fabs(matrix[best * count + column]))
            best = i;
    double *pivot = matrix + column * count, *row = matrix + best * count;
    for (size_t j = 0; best != column && j < count; j++) {
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
 * go: large matrices are read a few times less often, and each entry sees the same operations in the same order. */
int linear_solve(size_t count, double *matrix, double *right)
{
    for (size_t first = 0; first < count; first += PIVOTS) {
        size_t end = first + PIVOTS < count ? first + PIVOTS : count;
        for (size_t k = first; k < end; k++) {
            if (!linear_pivot(count, k, matrix, right))
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
        for (size_t i = first + 1; i < count; i++)
            linear_subtract(count, i < end ? i - first : end - first, end, matrix + first * count,
                            matrix + i * count + first, matrix + i * count);
    }
    for (size_t k = count; k-- > 0;) {
        double total = right[k];
        for (size_t j = k + 1; j < count; j++)
            total -= matrix[k * count + j] * right[j];
        right[k] = total / matrix[k * count + k];
    }
    return 1;
}
