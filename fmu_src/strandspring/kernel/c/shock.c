/* Shock response spectra: largest responses of oscillators with one degree of freedom to a base acceleration. */
#include <math.h>

/* Below this w*h the coefficients are taken from their power series. */
#define SHOCK_SERIES 1.0
#define SHOCK_PI 3.14159265358979323846

/* The longest step of w*h in which a response is taken as a cubic, with an error up to 1/384 of its fourth power. */
#define SHOCK_LONGEST 0.63
/* Numbers of a piece, and where the bound is. */
enum { SHOCK_PIECE = 5, SHOCK_MOST = 4 };

/* A step of w*h = theta. With p = w^2*z, q = w*z' and primes for d/d(w*t), p' = q and q' = -2*zeta*q - p - x; for an
 * input x0 + x1*s + x2*s^2 + x3*s^3 at the share s of the step,
 *
 *     p1 = p + I0*q - I1*p - sum of k!*I(k+1)/theta^k*xk,   q1 = q - I0*p - d*q - sum of k!*Ik/theta^k*xk,
 *
 * with the impulse response I0(theta), its integrals I1 to I4 and d = I1 + 2*zeta*I0. Increments keep the digits that the
 * coefficients of a recursive filter lose where theta is tiny. */
typedef struct {
    double d, of_p[4], of_q[4];
} ShockStep;

static ShockStep shock_step(double theta, double zeta)
{
    double I[5] = {0.0};
    if (theta < SHOCK_SERIES) {
        /* I0 = sum of a_n*theta^n/n! with a_0 = 0, a_1 = 1, a_(n+2) = -2*zeta*a_(n+1) - a_n. */
        double a = 1.0, before = 0.0, power = theta;
        for (int n = 1; n <= 24; n++) {
            double term = a * power, next = -2.0 * zeta * a - before;
            for (int k = 0; k < 5; k++) {
                I[k] += term;
                term *= theta / (n + k + 1.0);
            }
            before = a;
            a = next;
            power *= theta / (n + 1.0);
        }
    } else {
        double beta = sqrt((1.0 - zeta) * (1.0 + zeta)), e = exp(-zeta * theta), power = 1.0;
        I[0] = e * sin(beta * theta) / beta;
        I[1] = 1.0 - e * cos(beta * theta) - zeta * I[0];
        for (int k = 2; k < 5; k++) {
            power *= theta / (k - 1.0);
            I[k] = power - I[k - 2] - 2.0 * zeta * I[k - 1];
        }
    }
    ShockStep step = {.d = I[1] + 2.0 * zeta * I[0]};
    double factor = 1.0;
    for (int k = 0; k < 4; k++) {
        step.of_p[k] = factor * I[k + 1];
        step.of_q[k] = factor * I[k];
        factor *= (k + 1.0) / theta;
    }
    return step;
}

/* An oscillator and its largest and smallest response so far. */
typedef struct {
    double p, q, most, least;
} ShockState;

static inline void shock_move(const ShockStep *step, const double *x, ShockState *state)
{
    double of_p = step->of_p[0] * x[0] + step->of_p[1] * x[1] + step->of_p[2] * x[2] + step->of_p[3] * x[3];
    double of_q = step->of_q[0] * x[0] + step->of_q[1] * x[1] + step->of_q[2] * x[2] + step->of_q[3] * x[3];
    double p = state->p, q = state->q;
    state->p = p + (step->of_q[0] * q - of_p - step->of_p[0] * p);
    state->q = q - (step->d * q + of_q + step->of_q[0] * p);
}

/* Whether the magnitude of the response may be above all before within a step of w*h = 1/per. The response is x + e
 * with e'' + 2*zeta*e' + e = -x'': e less the line that solves this swings freely. */
static inline int shock_may_exceed(const double *x, const ShockState *state, double per, double zeta)
{
    double third = 6.0 * per * per * per * x[3], at = 2.0 * (zeta * third - per * per * x[2]), q = state->q;
    double y = -state->p - 2.0 * zeta * q, swing = y - x[0] - at;
    double rate = 2.0 * zeta * (x[0] - y) - q - per * x[1] + third;
    double level = state->most > -state->least ? state->most : -state->least;
    double left = level - x[SHOCK_MOST] - fabs(at) - 6.0 * per * per * fabs(x[3]);
    return left < 0.0 || swing * (swing + 2.0 * zeta * rate) + rate * rate > (1.0 - zeta * zeta) * left * left;
}

/* Where the cubic with these values and slopes at 0 and 1 is largest between them; m0 > 0 > m1. */
static double shock_top(double y0, double m0, double y1, double m1)
{
    double rise = y1 - y0, b = 3.0 * rise - 2.0 * m0 - m1, c = m0 + m1 - 2.0 * rise;
    double at = m0 / (sqrt(fmax(b * b - 3.0 * c * m0, 0.0)) - b);
    return y0 + at * (m0 + at * (b + at * c));
}

/* Largest and smallest of y = exp(-zeta*t)*(y0*cos(beta*t) + k*sin(beta*t)) for t >= 0, with y'(0) = m0. */
static void shock_residual(double y0, double m0, double zeta, double *most, double *least)
{
    double beta = sqrt((1.0 - zeta) * (1.0 + zeta));
    *most = *least = y0;
    if (y0 == 0.0 && m0 == 0.0)
        return;
    double k = (m0 + zeta * y0) / beta;
    /* y' = exp(-zeta*t)*(m0*cos(beta*t) - n*sin(beta*t)) is 0 at tan(beta*t) = m0/n; the next extremum is half a period
     * on. */
    double n = zeta * k + beta * y0;
    double phase = atan2(m0, n);
    if (phase < 0.0)
        phase += SHOCK_PI;
    for (int i = 0; i < 2; i++) {
        double y = exp(-zeta * phase / beta) * (y0 * cos(phase) + k * sin(phase));
        *most = fmax(*most, y);
        *least = fmin(*least, y);
        phase += SHOCK_PI;
    }
}

/* Goes on by a step of theta. */
static inline void shock_take(const ShockStep *step, const double *x, double theta, double zeta, ShockState *state)
{
    /* The response is y = -p - 2*zeta*q, its slope over the step theta*(2*zeta*(x - y) - q). */
    const double b = 2.0 * zeta;
    double y = -state->p - b * state->q, slope = theta * (b * (x[0] - y) - state->q);
    shock_move(step, x, state);
    double y1 = -state->p - b * state->q, slope1 = theta * (b * (x[0] + x[1] + x[2] + x[3] - y1) - state->q);
    state->most = y1 > state->most ? y1 : state->most;
    state->least = y1 < state->least ? y1 : state->least;
    if (slope > 0.0 && slope1 < 0.0 && (y + slope > state->most || y1 - slope1 > state->most))
        state->most = fmax(state->most, shock_top(y, slope, y1, slope1));
    else if (slope < 0.0 && slope1 > 0.0 && (y + slope < state->least || y1 - slope1 < state->least))
        state->least = fmin(state->least, -shock_top(-y, -slope, -y1, -slope1));
}

/* Largest and smallest absolute acceleration x + z'' = -(w^2*z + 2*zeta*w*z') of an oscillator z'' + 2*zeta*w*z' + w^2*z
 * = -x(t) during the steps and after them, out[4*k] .. out[4*k + 3] = primary maximum, primary minimum, residual
 * maximum, residual minimum of the oscillator with w*h = theta[k] > 0; none of the primary is below 0 or above it
 * respectively, as all start at rest. Where theta[k] > SHOCK_LONGEST, that of the smaller magnitude may be larger. x is
 * the cubic piece[0] + piece[1]*s + piece[2]*s^2 + piece[3]*s^3 at the share s of each step, of a magnitude of
 * piece[SHOCK_MOST] at most, and 0 after the last; it may jump between them. 0 <= zeta < 1. */
void shock_spectrum(
    size_t steps, const double *pieces, double zeta, size_t frequencies, const double *theta, double *out)
{
    for (size_t k = 0; k < frequencies; k++, out += 4) {
        ShockState state = {.p = 0.0};
        size_t parts = 1 + (size_t)(theta[k] / SHOCK_LONGEST);
        double width = 1.0 / (double)parts, part = theta[k] * width, per = 1.0 / theta[k];
        ShockStep whole = shock_step(theta[k], zeta), short_step = shock_step(part, zeta);
        for (const double *x = pieces, *end = pieces + SHOCK_PIECE * steps; x < end; x += SHOCK_PIECE) {
            if (parts == 1)
                shock_take(&whole, x, part, zeta, &state);
            else if (!shock_may_exceed(x, &state, per, zeta))
                shock_move(&whole, x, &state);
            else
                for (size_t j = 0; j < parts; j++) {
                    double s = (double)j * width, bend = x[2] + 3.0 * s * x[3];
                    double piece[4] = {
                        x[0] + s * (x[1] + s * (x[2] + s * x[3])), width * (x[1] + s * (x[2] + bend)),
                        width * width * bend, width * width * width * x[3]};
                    shock_take(&short_step, piece, part, zeta, &state);
                }
        }
        double y = -state.p - 2.0 * zeta * state.q;
        out[0] = state.most;
        out[1] = state.least;
        shock_residual(y, -state.q - 2.0 * zeta * y, zeta, out + 2, out + 3);
    }
}
