/* A period is a closed chain of monotone strokes between the turning points of the series. What the spring remembers at
 * the first of them is the fixed point of one period (steady.c); then omega = D*W(xi0 + rho*s) at every sample, with D
 * the direction of its stroke, which begins at displacement z_k, and s the distance from there.
 *
 * The derivatives follow the same chain:
 *
 *     d omega = D*W'(xi)*(d xi0 + rho*D*(dz - dz_k)),     d xi0 = D*d omega_k/W'(xi0),
 *
 * and where the stroke ends this is d omega of the next beginning: a linear recursion once around the period. A turning
 * point moves with the series itself, since dz/dtau = 0 there. With D^2 = 1 the force r at a sample changes by
 *
 *     dr = g*dz + h*(d omega_k/W'(xi0) - rho*dz_k),     g = dr/dz + rho*h,     h = dr/domega*W'(xi),
 *
 * and the bracket is the same for all samples of a stroke; g is the `stiffness`, and h times rho the `memory`. */
#include "periodic.h"

#include "../linear.h"
#include "../path.h"

#include <math.h>
#include <string.h>

/* Strokes, from the highest turning point on, where omega depends least on what was before; the even ones fall. */
typedef struct {
    size_t strokes, top; /* top: the highest turning point, by rising phase */
    Turn *turns;         /* K, by rising phase */
    double *columns;     /* K*N: the functions of the basis at the turning points */
    double *way, *xi;    /* K each: rho times the length of each stroke, and xi at its beginning */
    double *start_slope, *end_slope; /* K each: W' at the ends of each stroke */
} Chain;

/* The parts of the workspace. */
typedef struct {
    Chain chain;
    double *slope; /* K */
    double *begin; /* N */
    double *fourier;
} PeriodRoom;

static PeriodRoom lay_room_of_period(const FourierBasis *basis, Workspace *workspace)
{
    size_t samples = basis->samples, size = fourier_size(basis);
    return (PeriodRoom){
        .chain = {.turns = (Turn *)linear_taken(workspace, samples * (sizeof(Turn) / sizeof(double))),
                  .columns = linear_taken(workspace, samples * size),
                  .way = linear_taken(workspace, samples),
                  .xi = linear_taken(workspace, samples),
                  .start_slope = linear_taken(workspace, samples),
                  .end_slope = linear_taken(workspace, samples)},
        .slope = linear_taken(workspace, samples),
        .begin = linear_taken(workspace, size),
        .fourier = linear_taken(workspace, fourier_workspace(basis))};
}

size_t spring_periodic_workspace(size_t harmonics, size_t samples)
{
    Workspace counted = {.taken = 0};
    (void)lay_room_of_period(&(FourierBasis){.harmonics = harmonics, .samples = samples}, &counted);
    return counted.taken;
}

/* ---- strokes ---- */

/* The turning point at which a stroke begins, by rising phase. */
static size_t turn_of(const Chain *chain, size_t stroke)
{
    return (stroke + chain->top) % chain->strokes;
}

/* The samples of a stroke, in two spans if it goes round the end of the period. */
static void spans_of(const FourierBasis *basis, const Chain *chain, size_t stroke, Span *spans)
{
    size_t from = chain->turns[turn_of(chain, stroke)].cell + 1, to = chain->turns[turn_of(chain, stroke + 1)].cell + 1;
    spans[0] = (Span){from, from < to ? to : basis->samples};
    spans[1] = (Span){0, from < to ? 0 : to};
}

static double slope_at(const SpringTable *table, double xi)
{
    double slope;
    spring_saturation_slope(table, xi, &slope);
    return slope;
}

/* Completes the chain from its turning points. turns: their displacements in its order. */
static void chain_strokes(const SpringLaw *law, Chain *chain, double *start, double *turns)
{
    size_t strokes = chain->strokes;
    chain->top = 0;
    for (size_t k = 1; k < strokes; k++)
        if (chain->turns[k].value > chain->turns[chain->top].value)
            chain->top = k;
    for (size_t k = 0; k < strokes; k++)
        turns[k] = chain->turns[turn_of(chain, k)].value;
    for (size_t k = 0; k < strokes; k++)
        chain->way[k] = law->parameters.rho * fabs(turns[k + 1 < strokes ? k + 1 : 0] - turns[k]);
    spring_steady(law->table, strokes, chain->way, -1, start, chain->xi);
    for (size_t k = 0; k < strokes; k++) {
        chain->start_slope[k] = slope_at(law->table, chain->xi[k]);
        chain->end_slope[k] = slope_at(law->table, chain->xi[k] + chain->way[k]);
    }
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

/* ---- derivatives ---- */

/* Derivatives of omega by the coefficients, from those at the beginning of a stroke to those at its end. */
static void carry(const SpringLaw *law, const Chain *chain, size_t size, size_t stroke, double *by)
{
    const double *here = chain->columns + turn_of(chain, stroke) * size;
    const double *next = chain->columns + turn_of(chain, stroke + 1) * size;
    double ratio = chain->end_slope[stroke] / chain->start_slope[stroke];
    double moved = law->parameters.rho * chain->end_slope[stroke];
    for (size_t i = 0; i < size; i++)
        by[i] = ratio * by[i] + moved * (next[i] - here[i]);
}

/* Derivatives of omega at the beginning of the first stroke. */
static void begin_derivatives(const SpringLaw *law, const Chain *chain, size_t size, double *by)
{
    /* The second of two strokes alone is enough, by their symmetry: 1 - product vanishes where the loop does. */
    int two = chain->strokes == 2;
    double product = 1.0;
    memset(by, 0, size * sizeof *by);
    for (size_t k = two ? 1 : 0; k < chain->strokes; k++) {
        carry(law, chain, size, k, by);
        product *= chain->end_slope[k] / chain->start_slope[k];
    }
    double divisor = two ? 1.0 + chain->end_slope[0] / chain->start_slope[0] : 1.0 - fmin(product, STEEPEST);
    for (size_t i = 0; i < size; i++)
        by[i] /= divisor;
}

size_t spring_periodic(
    const SpringLaw *law, const FourierBasis *basis, const double *coefficients, double *start, double *workspace,
    SpringPeriod *period)
{
    size_t size = fourier_size(basis), samples = basis->samples;
    PeriodRoom room = lay_room_of_period(basis, &(Workspace){.memory = workspace});
    Chain *chain = &room.chain;
    fourier_samples(basis, coefficients, period->displacement, period->rate, room.fourier);
    chain->strokes = fourier_turns(basis, coefficients, period->rate, chain->turns, chain->columns);
    if (chain->strokes == 0)
        return 0;
    chain_strokes(law, chain, start, period->turns);
    for (size_t k = 0; k < chain->strokes; k++) {
        spans_of(basis, chain, k, period->spans + 2 * k);
        for (int i = 0; i < 2; i++)
            follow_stroke(law, chain->xi[k], period->turns[k], k % 2 ? 1.0 : -1.0, period->spans[2 * k + (size_t)i],
                          period->displacement, period->omega, room.slope);
    }
    /* At first they hold the partial derivatives by displacement and by omega. */
    spring_force_at(law, samples, period->displacement, period->omega, period->force, period->stiffness, period->memory);
    for (size_t j = 0; j < samples; j++) {
        period->memory[j] *= law->parameters.rho * room.slope[j];
        period->stiffness[j] += period->memory[j];
    }
    begin_derivatives(law, chain, size, room.begin);
    for (size_t k = 0; k < chain->strokes; k++) {
        const double *column = chain->columns + turn_of(chain, k) * size;
        double *inherited = period->inherited + k * size, factor = 1.0 / (law->parameters.rho * chain->start_slope[k]);
        for (size_t i = 0; i < size; i++)
            inherited[i] = factor * room.begin[i] - column[i];
        carry(law, chain, size, k, room.begin);
    }
    return chain->strokes;
}
