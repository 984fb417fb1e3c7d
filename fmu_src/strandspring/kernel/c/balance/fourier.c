#include "fourier.h"

#include "../../../core/c/spring/numerics.h"
#include "../linear.h"

#include <math.h>
#include <string.h>

enum { TURN_STEPS = 3 }; /* of Newton's method between samples: 1e-3 of their distance, 1e-6, 1e-12 */

static const double FULL_TURN = 6.28318530717958647693;

size_t fourier_size(const FourierBasis *basis)
{
    return 2 * basis->harmonics + 1;
}

/* ---- quarters ---- */

/* About phase 0 cosines are even and sines odd, and about a quarter of the period each is even or odd by its order: of a
 * row of the basis the samples from one to the other, both included, are enough. A folded signal has four such quarters:
 * what cosines of even and of odd order see of it, and what sines do. */
enum { QUARTERS = 4 };

static size_t quarter_size(const FourierBasis *basis)
{
    return basis->samples / QUARTERS + 1;
}

size_t fourier_workspace(const FourierBasis *basis)
{
    return QUARTERS * quarter_size(basis) + 3 * fourier_size(basis);
}

static const double *cosine_row(const FourierBasis *basis, size_t order)
{
    return basis->rows + order * quarter_size(basis);
}

/* Of an order from 1 on. */
static const double *sine_row(const FourierBasis *basis, size_t order)
{
    return basis->rows + (2 * basis->harmonics + order) * quarter_size(basis);
}

/* Samples a and c, and b and d, which are as far from half the period or its end; 0 where they are the same. */
static inline void fold_at(size_t count, double a, double b, double c, double d, double *folded)
{
    double outer = a + d, inner = b + c, outer_sine = a - d, inner_sine = b - c;
    folded[0] = outer + inner;
    folded[count] = outer - inner;
    folded[2 * count] = outer_sine - inner_sine;
    folded[3 * count] = outer_sine + inner_sine;
}

static void fold(const FourierBasis *basis, const double *signal, double *folded)
{
    size_t count = quarter_size(basis), last = count - 1, half = 2 * last;
    fold_at(count, signal[0], 0.0, signal[half], 0.0, folded);
    for (size_t j = 1; j < last; j++)
        fold_at(count, signal[j], signal[half - j], signal[half + j], signal[2 * half - j], folded + j);
    fold_at(count, signal[last], 0.0, signal[half + last], 0.0, folded + last);
}

/* Fills a signal with a series but for its mean. */
static void unfold(const FourierBasis *basis, const double *c, double *signal, double *folded)
{
    size_t count = quarter_size(basis), last = count - 1, half = 2 * last;
    memset(folded, 0, QUARTERS * count * sizeof *folded);
    for (size_t k = 1; k <= basis->harmonics; k++) {
        const double *cosine = cosine_row(basis, k), *sine = sine_row(basis, k);
        double *of_cosine = folded + k % 2 * count, *of_sine = of_cosine + 2 * count;
        double a = c[k], b = c[basis->harmonics + k];
        for (size_t j = 0; j < count; j++) {
            of_cosine[j] += a * cosine[j];
            of_sine[j] += b * sine[j];
        }
    }
    const double *even = folded, *odd = even + count, *even_sine = odd + count, *odd_sine = even_sine + count;
    for (size_t j = 0; j < count; j++) {
        signal[j] = (even[j] + odd[j]) + (even_sine[j] + odd_sine[j]);
        signal[half + j] = (even[j] - odd[j]) + (even_sine[j] - odd_sine[j]);
    }
    for (size_t j = 1; j < last; j++) {
        signal[half - j] = (even[j] - odd[j]) - (even_sine[j] - odd_sine[j]);
        signal[2 * half - j] = (even[j] + odd[j]) - (even_sine[j] + odd_sine[j]);
    }
}

void fourier_samples(const FourierBasis *basis, const double *c, double *value, double *rate, double *workspace)
{
    size_t harmonics = basis->harmonics;
    double *by_phase = workspace + QUARTERS * quarter_size(basis);
    for (size_t k = 1; k <= harmonics; k++) {
        by_phase[k] = (double)k * c[harmonics + k];
        by_phase[harmonics + k] = -(double)k * c[k];
    }
    unfold(basis, by_phase, rate, workspace);
    unfold(basis, c, value, workspace);
    /* The mean last, which may be far larger than the motion. */
    for (size_t j = 0; j < basis->samples; j++)
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
    turn.value = c[0] + linear_dot(2 * harmonics, c + 1, column + 1);
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

void fourier_sums(
    const FourierBasis *basis, const double *signal, size_t last, double *cosines, double *sines, double *workspace)
{
    size_t count = quarter_size(basis);
    fold(basis, signal, workspace);
    for (size_t k = 0; k <= last; k++)
        cosines[k] = linear_dot(count, cosine_row(basis, k), workspace + k % 2 * count);
    for (size_t k = 1; k <= last; k++)
        sines[k] = linear_dot(count, sine_row(basis, k), workspace + (2 + k % 2) * count);
}

void fourier_coefficients(const FourierBasis *basis, const double *signal, double *c, double *workspace)
{
    fourier_sums(basis, signal, basis->harmonics, c, c + basis->harmonics, workspace);
    for (size_t i = 0; i < fourier_size(basis); i++)
        c[i] *= (i ? 2.0 : 1.0) / (double)basis->samples;
}

/* Products of two rows of the basis are half the sum and difference of two others. */
void fourier_product(const FourierBasis *basis, const double *signal, double *matrix, double *workspace)
{
    size_t harmonics = basis->harmonics, size = fourier_size(basis);
    double *c = workspace + QUARTERS * quarter_size(basis) + harmonics, *s = c + 3 * harmonics + 1;
    double scale = 1.0 / (double)basis->samples;
    s[0] = 0.0;
    fourier_sums(basis, signal, 2 * harmonics, c, s, workspace);
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
