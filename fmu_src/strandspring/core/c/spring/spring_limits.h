/* The limits of what is a spring, and of a state of its FMU, as parameters.py says them and why; a test compares the
 * two. */
#ifndef SPRING_LIMITS_H
#define SPRING_LIMITS_H

/* Of kE, of degree 20 at most, and of kA, of degree 8. */
enum { SPRING_COEFFICIENTS = 21, SPRING_AMPLIFIERS = 9 };
enum { SPRING_KNOTS = 25 };

static const double N_LOW = 0.01, N_HIGH = 100.0;
static const double SIGMA_LOW = 0.5, SIGMA_HIGH = 1000.0;
static const double LEAST_SPACING = 1e-3;
static const double LARGEST_DISPLACEMENT = 1e9;                         /* [m] */
static const double LEAST_WIDTH = 1e-12, LARGEST_WIDTH = 1e6;           /* of the range [m] */
static const double LEAST_FORCE = 1e-15, LARGEST_FORCE = 1e15;          /* [N] */
static const double LEAST_SATURATION = 1e-9, LARGEST_SATURATION = 1e12; /* of rho times the range */
static const double LARGEST_AMPLIFIER = 1e9, LEAST_AMPLIFIER = 1e-12;
static const double LARGEST_VELOCITY = 1e9; /* [m/s]; of the native FMU alone */
static const double LEAST_TIME_CONSTANT = 1e-9, LARGEST_TIME_CONSTANT = 1e9; /* of a Maxwell branch [s] */
static const double LARGEST_START_XI = 1e6, LARGEST_SUM = 1e100;

#endif
