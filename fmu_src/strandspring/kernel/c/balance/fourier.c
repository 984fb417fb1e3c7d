#include "fourier.h"

#include "../../../core/c/spring/numerics.h"

#include <math.h>
#include <string.h>

enum {
    TURN_STEPS = 3,  /* of Newton's method between samples: 1e-3 of their distance, 1e-6, 1e-12 */
    SAMPLE_LANES = 8 /* samples at once, which compilers vectorise */
};

static const double FULL_TURN = 6.28318530717958647693;

size_t fourier_size(const FourierBasis *basis)
{
    return 2 * basis->harmonics + 1;
}

static const double *cosine_row(const FourierBasis *basis, size_t order)
{
    return basis->rows + order * basis->samples;
}

/* Of an order from 1 on. */
static const double *sine_row(const FourierBasis *basis, size_t order)
{
    return basis->rows + (2 * basis->harmonics + order) * basis->samples;
}

double fourier_dot(size_t count, const double *a, const double *b)
{
    double sum[SAMPLE_LANES] = {0.0};
    size_t i = 0;
    for (; i + SAMPLE_LANES <= count; i += SAMPLE_LANES)
        for (int k = 0; k < SAMPLE_LANES; k++)
            sum[k] += a[i + k] * b[i + k];
    for (; i < count; i++)
        sum[0] += a[i] * b[i];
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

void fourier_samples(const FourierBasis *basis, const double *c, double *value, double *rate)
{
    size_t harmonics = basis->harmonics, samples = basis->samples;
    memset(value, 0, samples * sizeof *value);
    memset(rate, 0, samples * sizeof *rate);
    for (size_t k = 1; k <= harmonics; k++) {
        const double *cosine = cosine_row(basis, k), *sine = sine_row(basis, k);
        double a = c[k], b = c[harmonics + k], rate_a = -(double)k * a, rate_b = (double)k * b;
        for (size_t j = 0; j < samples; j++) {
            value[j] += a * cosine[j] + b * sine[j];
            rate[j] += rate_a * sine[j] + rate_b * cosine[j];
        }
    }
    /* The mean last, which may be far larger than the motion. */
    for (size_t j = 0; j < samples; j++)
        value[j] += c[0];
}

/* ---- turning points ---- */

/* The functions of the basis at any phase. */
static void functions_at(size_t harmonics, double phase, double *column)
{
    double turn_cosine = cos(phase), turn_sine = sin(phase), cosine = turn_cosine, sine = turn_sine;
    column[0] = 1.0;
    for (size_t k = 1; k <= harmonics; k++) {
        column[k] = cosine;
        column[harmonics + k] = sine;
        double next = cosine * turn_cosine - sine * turn_sine;
        sine = sine * turn_cosine + cosine * turn_sine;
        cosine = next;
    }
}

/* First over second derivative of the series by the phase; 0 where the second vanishes. */
static double newton_step(size_t harmonics, const double *c, const double *column)
{
    double first = 0.0, second = 0.0;
    for (size_t k = 1; k <= harmonics; k++) {
        double order = (double)k, cosine = column[k], sine = column[harmonics + k];
        first += order * (c[harmonics + k] * cosine - c[k] * sine);
        second -= order * order * (c[k] * cosine + c[harmonics + k] * sine);
    }
    return second != 0.0 ? first / second : 0.0;
}

/* The turning point between a sample and the next. */
static Turn turn_in(const FourierBasis *basis, const double *c, double here, double next, size_t cell, double *column)
{
    size_t harmonics = basis->harmonics;
    double width = FULL_TURN / (double)basis->samples, low = width * (double)cell;
    Turn turn = {.phase = low + width * here / (here - next), .cell = cell};
    for (int step = 0; step < TURN_STEPS; step++) {
        functions_at(harmonics, turn.phase, column);
        /* Within the cell, also where the curvature vanishes. */
        turn.phase = clip(turn.phase - newton_step(harmonics, c, column), low, low + width);
    }
    functions_at(harmonics, turn.phase, column);
    /* The mean last, which may be far larger than the motion. */
    turn.value = c[0] + fourier_dot(2 * harmonics, c + 1, column + 1);
    return turn;
}

size_t fourier_turns(const FourierBasis *basis, const double *c, const double *rate, Turn *turns, double *columns)
{
    size_t count = 0;
    for (size_t j = 0; j < basis->samples; j++) {
        double next = rate[j + 1 < basis->samples ? j + 1 : 0];
        if ((rate[j] > 0.0) != (next > 0.0)) {
            turns[count] = turn_in(basis, c, rate[j], next, j, columns + count * fourier_size(basis));
            count++;
        }
    }
    return count;
}

/* ---- sums ---- */

void fourier_add_sums(
    const FourierBasis *basis, const double *signal, Span span, size_t last, double *cosines, double *sines)
{
    size_t count = span.to - span.from;
    if (count == 0)
        return;
    for (size_t k = 0; k <= last; k++)
        cosines[k] += fourier_dot(count, cosine_row(basis, k) + span.from, signal + span.from);
    for (size_t k = 1; k <= last; k++)
        sines[k] += fourier_dot(count, sine_row(basis, k) + span.from, signal + span.from);
}

void fourier_coefficients(const FourierBasis *basis, const double *signal, double *c)
{
    memset(c, 0, fourier_size(basis) * sizeof *c);
    fourier_add_sums(basis, signal, (Span){0, basis->samples}, basis->harmonics, c, c + basis->harmonics);
    for (size_t i = 0; i < fourier_size(basis); i++)
        c[i] *= (i ? 2.0 : 1.0) / (double)basis->samples;
}

/* Products of two rows of the basis are half the sum and difference of two others. */
void fourier_product(const FourierBasis *basis, const double *signal, double *matrix, double *workspace)
{
    size_t harmonics = basis->harmonics, size = fourier_size(basis);
    double *c = workspace + harmonics, *s = c + 3 * harmonics + 1;
    double scale = 1.0 / (double)basis->samples;
    memset(workspace, 0, 2 * (3 * harmonics + 1) * sizeof *workspace);
    fourier_add_sums(basis, signal, (Span){0, basis->samples}, 2 * harmonics, c, s);
    for (size_t k = 0; k <= 2 * harmonics; k++) {
        c[k] *= scale;
        s[k] *= scale;
    }
    /* From order -H on. */
    for (size_t k = 1; k <= harmonics; k++) {
        c[-(ptrdiff_t)k] = c[k];
        s[-(ptrdiff_t)k] = -s[k];
    }
    memcpy(matrix, c, (harmonics + 1) * sizeof *matrix);
    memcpy(matrix + harmonics + 1, s + 1, harmonics * sizeof *matrix);
    for (size_t a = 1; a <= harmonics; a++) {
        double *of_cosine = matrix + a * size, *of_sine = matrix + (harmonics + a) * size;
        const double *c_sum = c + a, *s_sum = s + a, *c_difference = c - a, *s_difference = s - a;
        of_cosine[0] = 2.0 * c[a];
        of_sine[0] = 2.0 * s[a];
        for (size_t b = 1; b <= harmonics; b++) {
            of_cosine[b] = c_sum[b] + c_difference[b];
            of_cosine[harmonics + b] = s_sum[b] + s_difference[b];
            of_sine[b] = s_sum[b] - s_difference[b];
            of_sine[harmonics + b] = c_difference[b] - c_sum[b];
        }
    }
}
