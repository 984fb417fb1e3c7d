/* Shock response spectra: largest responses of oscillators with one degree of freedom to a base acceleration. */
#include <math.h>

/* Below this w*h the coefficients are taken from their power series. */
#define SHOCK_SERIES 1.0
#define SHOCK_PI 3.14159265358979323846

/* A step of w*h = theta. With p = w^2*z, q = w*z' and primes for d/d(w*t), p' = q and q' = -2*zeta*q - p - x; for x
 * straight over the step from x0 by dx,
 *
 *     p1 = p + s*q - u*(p + x0) - ramp_p*dx,   q1 = q - s*(p + x0) - d*q - ramp_q*dx,
 *
 * with the impulse response s(theta), u and w its first and second integrals, d = u + 2*zeta*s, ramp_p = w/theta and
 * ramp_q = u/theta. Increments keep the digits that the coefficients of a recursive filter lose where theta is tiny. */
typedef struct {
    double s, u, d, ramp_p, ramp_q;
} ShockStep;

static ShockStep shock_step(double theta, double zeta)
{
    double s, u, w;
    if (theta < SHOCK_SERIES) {
        /* s = sum of a_n*theta^n/n! with a_0 = 0, a_1 = 1, a_(n+2) = -2*zeta*a_(n+1) - a_n. */
        double a = 1.0, before = 0.0, power = theta;
        s = u = w = 0.0;
        for (int n = 1; n <= 24; n++) {
            s += a * power;
            u += a * power * theta / (n + 1.0);
            w += a * power * theta / (n + 1.0) * theta / (n + 2.0);
            double next = -2.0 * zeta * a - before;
            before = a;
            a = next;
            power *= theta / (n + 1.0);
        }
    } else {
        double beta = sqrt((1.0 - zeta) * (1.0 + zeta)), e = exp(-zeta * theta);
        s = e * sin(beta * theta) / beta;
        u = 1.0 - e * cos(beta * theta) - zeta * s;
        w = theta - s - 2.0 * zeta * u;
    }
    return (ShockStep){s, u, u + 2.0 * zeta * s, w / theta, u / theta};
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

/* Largest and smallest absolute acceleration x + z'' = -(w^2*z + 2*zeta*w*z') of an oscillator z'' + 2*zeta*w*z' + w^2*z
 * = -x(t) during the samples and after them, out[4*k] .. out[4*k + 3] = primary maximum, primary minimum, residual
 * maximum, residual minimum of the oscillator with w*h = theta[k] > 0; none of the primary is below 0 or above it
 * respectively, as all start at rest. x is straight between its `count` >= 1 samples and 0 after the last;
 * 0 <= zeta < 1. */
void shock_spectrum(size_t count, const double *x, double zeta, size_t frequencies, const double *theta, double *out)
{
    for (size_t k = 0; k < frequencies; k++) {
        ShockStep step = shock_step(theta[k], zeta);
        /* The response is y = a*p + b*q, its slope over a step theta*(a*q + b*q'). */
        const double a = -1.0, b = -2.0 * zeta;
        double p = 0.0, q = 0.0, y = 0.0, slope = -theta[k] * b * x[0], most = 0.0, least = 0.0;
        for (size_t i = 1; i < count; i++) {
            double force = p + x[i - 1], change = x[i] - x[i - 1];
            double p1 = p + (step.s * q - step.u * force - step.ramp_p * change);
            double q1 = q - (step.s * force + step.d * q + step.ramp_q * change);
            double y1 = a * p1 + b * q1;
            double slope1 = theta[k] * (a * q1 - b * (2.0 * zeta * q1 + p1 + x[i]));
            most = fmax(most, y1);
            least = fmin(least, y1);
            if (slope > 0.0 && slope1 < 0.0)
                most = fmax(most, shock_top(y, slope, y1, slope1));
            else if (slope < 0.0 && slope1 > 0.0)
                least = fmin(least, -shock_top(-y, -slope, -y1, -slope1));
            p = p1;
            q = q1;
            y = y1;
            slope = slope1;
        }
        out[4 * k] = most;
        out[4 * k + 1] = least;
        shock_residual(y, a * q - b * (2.0 * zeta * q + p), zeta, &out[4 * k + 2], &out[4 * k + 3]);
    }
}
