#include "linear.h"

#include <math.h>

enum {
    LANES = 8, /* of a sum, which compilers vectorise */
    PANEL = 4  /* columns that are eliminated from the rest of the matrix at once */
};

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

double linear_dot(size_t count, const double *a, const double *b)
{
    double sum[LANES] = {0.0};
    size_t i = 0;
    for (; i + LANES <= count; i += LANES)
        for (int k = 0; k < LANES; k++)
            sum[k] += a[i + k] * b[i + k];
    for (; i < count; i++)
        sum[0] += a[i] * b[i];
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
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

/* Brings the row with the largest entry of a column to the diagonal and returns its number. */
static size_t bring_pivot(size_t count, size_t column, double *matrix)
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
    return best;
}

/* row -= share*pivot, from one column to before another. */
static void eliminate(size_t from, size_t to, double share, const double *restrict pivot, double *restrict row)
{
    for (size_t j = from; j < to; j++)
        row[j] -= share * pivot[j];
}

int linear_factor(size_t count, double *matrix, size_t *order)
{
    for (size_t begin = 0; begin < count; begin += PANEL) {
        size_t end = begin + PANEL < count ? begin + PANEL : count;
        for (size_t k = begin; k < end; k++) {
            order[k] = bring_pivot(count, k, matrix);
            const double *pivot = matrix + k * count;
            if (!(fabs(pivot[k]) > 0.0))
                return 0;
            for (size_t i = k + 1; i < count; i++) {
                double *row = matrix + i * count;
                row[k] /= pivot[k];
                eliminate(k + 1, end, row[k], pivot, row);
            }
        }
        for (size_t i = begin + 1; i < end; i++)
            for (size_t k = begin; k < i; k++)
                eliminate(end, count, matrix[i * count + k], matrix + k * count, matrix + i * count);
        for (size_t i = end; i < count; i++) {
            const double *restrict first = matrix + begin * count, *restrict second = first + count;
            const double *restrict third = second + count, *restrict fourth = third + count;
            double *restrict row = matrix + i * count;
            double a = row[begin], b = row[begin + 1], c = row[begin + 2], d = row[begin + 3];
            for (size_t j = end; j < count; j++)
                row[j] = (((row[j] - a * first[j]) - b * second[j]) - c * third[j]) - d * fourth[j];
        }
    }
    return 1;
}

void linear_substitute(size_t count, const double *factors, const size_t *order, double *right)
{
    for (size_t k = 0; k < count; k++) {
        double kept = right[order[k]];
        right[order[k]] = right[k];
        right[k] = kept;
    }
    for (size_t i = 1; i < count; i++)
        right[i] -= linear_dot(i, factors + i * count, right);
    for (size_t i = count; i-- > 0;) {
        const double *row = factors + i * count;
        right[i] = (right[i] - linear_dot(count - i - 1, row + i + 1, right + i + 1)) / row[i];
    }
}
