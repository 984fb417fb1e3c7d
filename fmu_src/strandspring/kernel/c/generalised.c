/* The generalised Bouc-Wen model of Song and Der Kiureghian (2006), a rival of the spring's own law. */
#include <math.h>

/* Step of the travel over the length in which z changes, most steps between two displacements, rate below which z
 * stays, and where a z that grows is held. */
#define GENERALISED_STEP 0.4
#define GENERALISED_MOST 20000
#define GENERALISED_STILL 1e-10
#define GENERALISED_LARGEST 10.0
/* |z| below which that length is taken as at this |z|: for n < 1 it vanishes at z = 0. */
#define GENERALISED_SMALL 0.05

/* |z|^n*psi in the direction d of motion, on the side c of the displacement's zero. */
static double generalised_loss(double z, double d, double c, double n, const double *beta)
{
    double y = z >= 0.0 ? 1.0 : -1.0;
    double psi = beta[0] * d * y + beta[1] * c * d + beta[2] * c * y + beta[3] * d + beta[4] * y + beta[5] * c;
    return z == 0.0 ? 0.0 : pow(fmin(fabs(z), GENERALISED_LARGEST), n) * psi;
}

/* z after the travel s; xi = rho*s counts it. */
static double generalised_travel(double z, double xi, double d, double c, double n, const double *beta)
{
    for (int k = 0; k < GENERALISED_MOST && xi > 0.0; k++) {
        double loss = generalised_loss(z, d, c, n, beta);
        if (fabs(1.0 - loss) < GENERALISED_STILL)
            break;
        double rate = 1.0 + (1.0 + n / fmax(fabs(z), GENERALISED_SMALL)) * fabs(loss);
        double h = fmin(xi, GENERALISED_STEP / rate);
        double k1 = d * (1.0 - loss);
        double k2 = d * (1.0 - generalised_loss(z + 0.5 * h * k1, d, c, n, beta));
        double k3 = d * (1.0 - generalised_loss(z + 0.5 * h * k2, d, c, n, beta));
        double k4 = d * (1.0 - generalised_loss(z + h * k3, d, c, n, beta));
        z += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        z = fmax(-GENERALISED_LARGEST, fmin(GENERALISED_LARGEST, z));
        xi -= h;
    }
    return z;
}

/* z at each of `count` displacements, z = 0 at the first, of
 *
 *     dz/dx = rho*(1 - |z|^n * psi),   psi = b1*s*y + b2*c*s + b3*c*y + b4*s + b5*y + b6*c,
 *
 * s = sgn(dx), y = sgn(z), c = sgn(x). Between two displacements x goes straight; Runge-Kutta steps of order 4 are
 * short against the length over which z saturates and end where x changes sign. */
void generalised_path(size_t count, const double *displacement, double rho, double n, const double *beta, double *z)
{
    z[0] = 0.0;
    for (size_t i = 1; i < count; i++) {
        double from = displacement[i - 1], to = displacement[i], d = to >= from ? 1.0 : -1.0;
        double value = z[i - 1];
        if (from * to < 0.0) {
            value = generalised_travel(value, rho * fabs(from), d, from < 0.0 ? -1.0 : 1.0, n, beta);
            from = 0.0;
        }
        z[i] = generalised_travel(value, rho * fabs(to - from), d, from + to < 0.0 ? -1.0 : 1.0, n, beta);
    }
}
