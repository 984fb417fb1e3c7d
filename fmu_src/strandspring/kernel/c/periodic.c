/* A period is a closed chain of monotone strokes between the turning points of the series. What the spring remembers at the
 * first of them is the fixed point of one period (steady.h); then omega = D*W(xi0 + rho*s) at every sample, with D the
 * direction of its stroke, which begins at displacement z_k, and s the distance from there.
 *
 * The derivatives follow the same chain:
 *
 *     d omega = D*W'(xi)*(d xi0 + rho*D*(dz - dz_k)),     d xi0 = D*d omega_k/W'(xi0),
 *
 * and where the stroke ends this is d omega of the next beginning: a linear recursion once around the period. A turning point
 * moves with the series itself, since dz/dtau = 0 there. With D^2 = 1 the force r at a sample changes by
 *
 *     dr = g*dz + h*(d omega_k/W'(xi0) - rho*dz_k),     g = dr/dz + rho*h,     h = dr/domega*W'(xi),
 *
 * and the bracket is the same for all samples of a stroke. Products of two rows of the basis are half the sum and difference of
 * two others, so that the part of g in the Jacobian comes from the sums of g with the rows up to order 2H (Toeplitz plus
 * Hankel), and that of h is the product of a column and a row for each stroke. */
#include "periodic.h"

#include "path.h"
#include "steady.h"

#include <math.h>
#include <string.h>

enum {
    TURN_STEPS = 3,  /* of Newton's method between samples: 1e-3 of their distance, 1e-6, 1e-12 */
    SAMPLE_LANES = 8 /* samples at once, which compilers vectorise */
};

static const double FULL_TURN = 6.28318530717958647693;
/* Slope of omega after a period over omega before it; it is 1 for motion too small for a loop. */
static const double STEEPEST_PERIOD = 1.0 - 1e-9;

typedef struct {
    double phase, displacement;
    size_t cell; /* the last sample before it */
} Turn;

/* Samples from one to before another. */
typedef struct {
    size_t from, to;
} Span;

/* The parts of the workspace. */
typedef struct {
    Turn *turn;                              /* K */
    double *way, *xi, *start_slope, *end_slope; /* K each: of each stroke */
    double *columns;                         /* K*N: the basis at the turning points */
    double *g, *h, *slope;                   /* K each: of each sample */
    double *begin, *inherited, *projected;   /* N each */
    double *cosines, *sines;                 /* 3H + 1 each: sums of g, from order -H to 2H */
} Room;

size_t spring_periodic_workspace(size_t harmonics, size_t samples)
{
    size_t size = 2 * harmonics + 1;
    return samples * (sizeof(Turn) / sizeof(double) + 7 + size) + 3 * size + 2 * (3 * harmonics + 1);
}

static Room divide(size_t harmonics, size_t samples, double *workspace)
{
    size_t size = 2 * harmonics + 1;
    Room room = {.turn = (Turn *)workspace};
    workspace += samples * (sizeof(Turn) / sizeof(double));
    double **of_samples[] = {&room.way, &room.xi, &room.start_slope, &room.end_slope, &room.g, &room.h, &room.slope};
    for (size_t i = 0; i < sizeof of_samples / sizeof *of_samples; i++, workspace += samples)
        *of_samples[i] = workspace;
    double **of_coefficients[] = {&room.begin, &room.inherited, &room.projected};
    for (size_t i = 0; i < sizeof of_coefficients / sizeof *of_coefficients; i++, workspace += size)
        *of_coefficients[i] = workspace;
    room.cosines = workspace;
    room.sines = room.cosines + 3 * harmonics + 1;
    room.columns = room.sines + 3 * harmonics + 1;
    return room;
}

/* ---- the series ---- */

/* Sum of products, in an order that does not depend on the compiler. */
static double dot(size_t count, const double *a, const double *b)
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

/* The series and its derivative by the phase at `count` samples from `first` on. */
static void synthesise(size_t harmonics, size_t samples, const double *basis, const double *c, size_t first, size_t count,
                       double *value, double *rate)
{
    double total[SAMPLE_LANES], change[SAMPLE_LANES];
    for (size_t i = 0; i < count; i++) {
        total[i] = c[0];
        change[i] = 0.0;
    }
    for (size_t k = 1; k <= harmonics; k++) {
        const double *cosine = basis + k * samples + first, *sine = cosine + 2 * harmonics * samples;
        double a = c[k], b = c[harmonics + k], rate_a = (double)k * b, rate_b = -(double)k * a;
        if (count == SAMPLE_LANES)
            for (size_t i = 0; i < SAMPLE_LANES; i++) {
                total[i] += a * cosine[i] + b * sine[i];
                change[i] += rate_a * cosine[i] + rate_b * sine[i];
            }
        else
            for (size_t i = 0; i < count; i++) {
                total[i] += a * cosine[i] + b * sine[i];
                change[i] += rate_a * cosine[i] + rate_b * sine[i];
            }
    }
    memcpy(value + first, total, count * sizeof *value);
    memcpy(rate + first, change, count * sizeof *rate);
}

/* The basis at any phase. */
static void basis_at(size_t harmonics, double phase, double *column)
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

static Turn turn_in(size_t harmonics, size_t samples, const double *c, const double *rate, size_t cell, double *column)
{
    double width = FULL_TURN / (double)samples, low = width * (double)cell;
    double here = rate[cell], there = rate[cell + 1 < samples ? cell + 1 : 0];
    Turn turn = {.phase = low + width * here / (here - there), .cell = cell};
    for (int step = 0; step < TURN_STEPS; step++) {
        basis_at(harmonics, turn.phase, column);
        /* Within the cell, also where the curvature vanishes. */
        turn.phase = clip(turn.phase - newton_step(harmonics, c, column), low, low + width);
    }
    basis_at(harmonics, turn.phase, column);
    turn.displacement = dot(2 * harmonics + 1, c, column);
    return turn;
}

/* The turning points by rising phase; returns their number. */
static size_t find_turns(size_t harmonics, size_t samples, const double *c, const double *rate, const Room *room)
{
    size_t found = 0;
    for (size_t j = 0; j < samples; j++)
        if ((rate[j] > 0.0) != (rate[j + 1 < samples ? j + 1 : 0] > 0.0)) {
            room->turn[found] = turn_in(harmonics, samples, c, rate, j, room->columns + found * (2 * harmonics + 1));
            found++;
        }
    return found;
}

/* ---- the strokes ---- */

static double slope_at(const SpringTable *table, double xi)
{
    double slope;
    spring_saturation_slope(table, xi, &slope);
    return slope;
}

/* omega and W' at samples of a stroke. */
static void follow_stroke(const SpringLaw *law, double start_xi, double start, double side, Span span,
                          const double *displacement, double *omega, double *slope)
{
    double rho = law->parameters.rho;
    for (size_t j = span.from; j < span.to; j++) {
        /* A sample within rounding of a turning point may lie a bit beyond it. */
        double s = side * (displacement[j] - start);
        omega[j] = side * spring_saturation_slope(law->table, start_xi + rho * (s > 0.0 ? s : 0.0), &slope[j]);
    }
}

/* Where a stroke begins, by rising phase. Even strokes fall. */
static size_t turn_of(size_t stroke, size_t top, size_t strokes)
{
    return (stroke + top) % strokes;
}

/* Derivatives of omega at the end of a stroke by the coefficients, from those at its beginning. */
static void carry(const SpringLaw *law, const Room *room, size_t size, size_t stroke, const double *here, const double *next,
                  const double *before, double *after)
{
    double ratio = room->end_slope[stroke] / room->start_slope[stroke];
    double moved = law->parameters.rho * room->end_slope[stroke];
    for (size_t i = 0; i < size; i++)
        after[i] = ratio * before[i] + moved * (next[i] - here[i]);
}

/* Derivatives of omega at the beginning of the first stroke. */
static void begin_derivatives(const SpringLaw *law, const Room *room, size_t size, size_t strokes, size_t top)
{
    double *begin = room->begin, product = 1.0;
    memset(begin, 0, size * sizeof *begin);
    /* In a period of two strokes the second alone is enough, by their symmetry: 1 - product vanishes where the loop does. */
    for (size_t k = strokes == 2 ? 1 : 0; k < strokes; k++) {
        const double *here = room->columns + turn_of(k, top, strokes) * size;
        const double *next = room->columns + turn_of(k + 1, top, strokes) * size;
        carry(law, room, size, k, here, next, begin, begin);
        product *= room->end_slope[k] / room->start_slope[k];
    }
    double divisor = strokes == 2 ? 1.0 + room->end_slope[0] / room->start_slope[0] : 1.0 - fmin(product, STEEPEST_PERIOD);
    for (size_t i = 0; i < size; i++)
        begin[i] /= divisor;
}

/* ---- the projection ---- */

/* Adds the sums of a signal's samples times the cosines and sines of orders up to `last`. */
static void add_sums(size_t harmonics, size_t samples, const double *basis, const double *signal, Span span, size_t last,
                     double *cosines, double *sines)
{
    size_t count = span.to - span.from;
    if (count == 0)
        return;
    basis += span.from;
    signal += span.from;
    for (size_t k = 0; k <= last; k++)
        cosines[k] += dot(count, basis + k * samples, signal);
    /* Sine 0 is none; what belongs to the sine of order k stands at index k. */
    for (size_t k = 1; k <= last; k++)
        sines[k] += dot(count, basis + (2 * harmonics + k) * samples, signal);
}

/* The matrix of the products of rows of the basis with g. */
static void toeplitz_plus_hankel(size_t harmonics, size_t samples, const Room *room, double *jacobian)
{
    size_t size = 2 * harmonics + 1;
    double *c = room->cosines + harmonics, *s = room->sines + harmonics, scale = 1.0 / (double)samples;
    for (size_t k = 0; k <= 2 * harmonics; k++) {
        c[k] *= scale;
        s[k] *= scale;
    }
    for (size_t k = 1; k <= harmonics; k++) {
        c[-(ptrdiff_t)k] = c[k];
        s[-(ptrdiff_t)k] = -s[k];
    }
    memcpy(jacobian, c, (harmonics + 1) * sizeof *jacobian);
    memcpy(jacobian + harmonics + 1, s + 1, harmonics * sizeof *jacobian);
    for (size_t a = 1; a <= harmonics; a++) {
        double *of_cosine = jacobian + a * size, *of_sine = jacobian + (harmonics + a) * size;
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

/* Adds what comes from the beginning of a stroke, whose samples are those of two spans. */
static void add_inherited(const SpringLaw *law, size_t harmonics, size_t samples, const double *basis, const Room *room,
                          size_t stroke, const double *column, const Span *spans, double *jacobian)
{
    size_t size = 2 * harmonics + 1;
    double *inherited = room->inherited, *projected = room->projected, scale = 2.0 / (double)samples;
    for (size_t i = 0; i < size; i++)
        inherited[i] = room->begin[i] / room->start_slope[stroke] - law->parameters.rho * column[i];
    memset(projected, 0, size * sizeof *projected);
    for (int i = 0; i < 2; i++)
        add_sums(harmonics, samples, basis, room->h, spans[i], harmonics, projected, projected + harmonics);
    for (size_t i = 0; i < size; i++) {
        double factor = (i ? scale : 0.5 * scale) * projected[i];
        for (size_t j = 0; j < size; j++)
            jacobian[i * size + j] += factor * inherited[j];
    }
}

/* The samples of the stroke between two turning points, which may go round the end of the period. */
static void spans_of(const Turn *turn, const Turn *next, size_t samples, Span *spans)
{
    size_t from = turn->cell + 1, to = next->cell + 1;
    spans[0] = (Span){from, from < to ? to : samples};
    spans[1] = (Span){0, from < to ? 0 : to};
}

/* ---- the period ---- */

/* Puts the strokes into the workspace, from the highest turning point on, where omega depends least on what was before;
 * returns which it is. */
static size_t lay_strokes(const SpringLaw *law, size_t strokes, const Room *room, double *start, double *turns)
{
    size_t top = 0;
    for (size_t k = 1; k < strokes; k++)
        if (room->turn[k].displacement > room->turn[top].displacement)
            top = k;
    for (size_t k = 0; k < strokes; k++)
        turns[k] = room->turn[turn_of(k, top, strokes)].displacement;
    for (size_t k = 0; k < strokes; k++)
        room->way[k] = law->parameters.rho * fabs(turns[k + 1 < strokes ? k + 1 : 0] - turns[k]);
    spring_steady(law->table, strokes, room->way, -1, start, room->xi);
    for (size_t k = 0; k < strokes; k++) {
        room->start_slope[k] = slope_at(law->table, room->xi[k]);
        room->end_slope[k] = slope_at(law->table, room->xi[k] + room->way[k]);
    }
    return top;
}

/* The coefficients of the force, and g's part of the Jacobian. */
static void project(size_t harmonics, size_t samples, const double *basis, const Room *room, const SpringPeriod *period)
{
    size_t size = 2 * harmonics + 1;
    Span all = {0, samples};
    memset(period->coefficients, 0, size * sizeof *period->coefficients);
    memset(room->cosines, 0, 2 * (3 * harmonics + 1) * sizeof *room->cosines);
    add_sums(harmonics, samples, basis, period->force, all, harmonics, period->coefficients, period->coefficients + harmonics);
    for (size_t i = 0; i < size; i++)
        period->coefficients[i] *= (i ? 2.0 : 1.0) / (double)samples;
    add_sums(harmonics, samples, basis, room->g, all, 2 * harmonics, room->cosines + harmonics, room->sines + harmonics);
    toeplitz_plus_hankel(harmonics, samples, room, period->jacobian);
}

size_t spring_periodic(
    const SpringLaw *law, size_t harmonics, size_t samples, const double *basis, const double *coefficients, double *start,
    double *workspace, SpringPeriod *period)
{
    size_t size = 2 * harmonics + 1;
    Room room = divide(harmonics, samples, workspace);
    for (size_t first = 0; first < samples; first += SAMPLE_LANES)
        synthesise(harmonics, samples, basis, coefficients, first,
                   samples - first < SAMPLE_LANES ? samples - first : SAMPLE_LANES, period->displacement, period->rate);
    size_t strokes = find_turns(harmonics, samples, coefficients, period->rate, &room);
    if (strokes == 0)
        return 0;
    size_t top = lay_strokes(law, strokes, &room, start, period->turns);
    for (size_t k = 0; k < strokes; k++) {
        Span spans[2];
        spans_of(&room.turn[turn_of(k, top, strokes)], &room.turn[turn_of(k + 1, top, strokes)], samples, spans);
        for (int i = 0; i < 2; i++)
            follow_stroke(law, room.xi[k], period->turns[k], k % 2 ? 1.0 : -1.0, spans[i], period->displacement,
                          period->omega, room.slope);
    }
    /* g and h hold the partial derivatives by displacement and by omega for a moment. */
    spring_force_at(law, samples, period->displacement, period->omega, period->force, room.g, room.h);
    for (size_t j = 0; j < samples; j++) {
        room.h[j] *= room.slope[j];
        room.g[j] += law->parameters.rho * room.h[j];
    }
    project(harmonics, samples, basis, &room, period);
    begin_derivatives(law, &room, size, strokes, top);
    for (size_t k = 0; k < strokes; k++) {
        size_t here = turn_of(k, top, strokes), next = turn_of(k + 1, top, strokes);
        const double *column = room.columns + here * size;
        Span spans[2];
        spans_of(&room.turn[here], &room.turn[next], samples, spans);
        add_inherited(law, harmonics, samples, basis, &room, k, column, spans, period->jacobian);
        carry(law, &room, size, k, column, room.columns + next * size, room.begin, room.begin);
    }
    return strokes;
}
