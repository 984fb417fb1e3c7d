#include "linear.h"

#include <math.h>

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

int linear_solve(size_t count, double *matrix, double *right)
{
    for (size_t k = 0; k < count; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < count; i++)
            if (fabs(matrix[i * count + k]) > fabs(matrix[best * count + k]))
                best = i;
        double *pivot = matrix + k * count, *row = matrix + best * count;
        if (!(fabs(row[k]) > 0.0))
            return 0;
        for (size_t j = k; best != k && j < count; j++) {
            double kept = pivot[j];
            pivot[j] = row[j];
            row[j] = kept;
        }
        double kept = right[k];
        right[k] = right[best];
        right[best] = kept;
        for (size_t i = k + 1; i < count; i++) {
            double *below = matrix + i * count, share = below[k] / pivot[k];
            for (size_t j = k + 1; j < count; j++)
                below[j] -= share * pivot[j];
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
