#include "linear.h"

#include <math.h>

double *linear_taken(Workspace *workspace, size_t count)
{
    double *begin = workspace->memory == NULL ? NULL : workspace->memory + workspace->taken;
    workspace->taken += count;
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

/* Brings the row with the largest entry of a column to the diagonal; returns 0 if all are 0. */
static int bring_pivot(size_t count, size_t column, double *matrix, double *right)
{
    size_t best = column;
    for (size_t i = column + 1; i < count; i++)
        if (fabs(matrix[i * count + column]) > fabs(matrix[best * count + column]))
            best = i;
    double *pivot = matrix + column * count, *row = matrix + best * count;
    for (size_t j = column; best != column && j < count; j++) {
        double kept = pivot[j];
        pivot[j] = row[j];
        row[j] = kept;
    }
    double kept = right[column];
    right[column] = right[best];
    right[best] = kept;
    return fabs(pivot[column]) > 0.0;
}

int linear_solve(size_t count, double *matrix, double *right)
{
    for (size_t k = 0; k < count; k++) {
        if (!bring_pivot(count, k, matrix, right))
            return 0;
        const double *restrict pivot = matrix + k * count;
        for (size_t i = k + 1; i < count; i++) {
            double *restrict row = matrix + i * count, share = row[k] / pivot[k];
            for (size_t j = k + 1; j < count; j++)
                row[j] -= share * pivot[j];
            right[i] -= share * right[k];
        }
    }
    for (size_t k = count; k-- > 0;) {
        double total = right[k];
        for (size_t j = k + 1; j < count; j++)
            total -= matrix[k * count + j] * right[j];
        right[k] = total / matrix[k * count + k];
    }
    return 1;
}
