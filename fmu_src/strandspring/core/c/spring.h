/* Hysteretic spring of the modified normalized Bouc-Wen model (Zhao et al. 2013), one step at a time.
 *
 * A second transcription of the Python files core/parameters.py, saturation.py, law.py, restoring.py, work.py,
 * stepper.py and kernel/sensitivity.py, which are normative: the same functions, under the same names, in the same
 * order; a test holds the two together. Those files derive the method; the comments here say only what C adds. That is
 * speed: W, which Python takes from its cells through logarithms and exponentials, is turned once into polynomials of
 * xi itself over short pieces, so that a step costs a search among their edges and one polynomial.
 *
 * C11 and its mathematics library. No global that changes, no allocation, no platform code but that a double is of
 * IEEE 754: the caller owns all memory, and one SpringLaw may be read by any number of threads at once. Compile without
 * contraction to fused multiply-add (-ffp-contract=off) and without -ffast-math, or the last bits differ from machine
 * to machine.
 */
#ifndef SPRING_H
#define SPRING_H

#include "spring_local.h"

#include <stddef.h>

#define SPRING_MAXIMUM_DEGREE 20

enum {
    SPRING_COEFFICIENTS = SPRING_MAXIMUM_DEGREE + 1,
    SPRING_NODES = 289,   /* quadrature nodes of the rising branch; the falling one has fewer */
    SPRING_POWERS = 10,   /* coefficients of an interpolant of degree 9 */
    SPRING_CELLS = 192,   /* Python's cells of a branch; 176 are taken */
    SPRING_PIECES = 352,  /* of a branch; over the supported n and sigma up to 326 are taken */
    SPRING_BUCKETS = 960, /* of a branch, 16 to the octave of xi; up to 931 are taken */
    SPRING_MOMENTS = 7,   /* for FA of degree 6 at most */
    SPRING_WORK_POINTS = 8 * (SPRING_MAXIMUM_DEGREE / 2)
};

/* One spring in SI units; elastic and amplifier count the coefficients used of kE and kA. */
typedef struct {
    int elastic, amplifier;
    double kE[SPRING_COEFFICIENTS], kA[SPRING_COEFFICIENTS];
    double kappa_omega, rho, sigma, n;
    double displacement_offset, displacement_min, displacement_max;
} SpringParameters;

/* |W| over a short interval of |xi| as a polynomial in theta = (|xi| - middle)*per_half, -1 <= theta <= 1. */
typedef struct {
    double middle, per_half, coefficients[SPRING_POWERS];
} SpringPiece;

/* One branch of W: the quadrature grid of Python with the integral up to each node, and the pieces of |W|. */
typedef struct {
    int nodes, pieces;
    double grid[SPRING_NODES], integral[SPRING_NODES];
    /* Integrals over the same grid of the integrand's derivatives by n and, on the falling branch, by sigma. */
    double integral_by_n[SPRING_NODES], integral_by_sigma[SPRING_NODES];
    double edges[SPRING_PIECES + 1]; /* |xi| between the pieces; beyond the last |W| = 1 */
    SpringPiece piece[SPRING_PIECES];
    double moments[SPRING_PIECES + 1][SPRING_MOMENTS]; /* integral of |W|*|xi|^m from 0 up to each edge */
    int first_bucket;
    unsigned short guess[SPRING_BUCKETS + 1]; /* piece at the lower end of each bucket */
} SpringBranch;

/* Python's cells of a branch. */
typedef struct {
    int count;
    double edges[SPRING_CELLS + 1];                   /* in the abscissa */
    double coefficients[SPRING_CELLS][SPRING_POWERS]; /* of theta^k, theta in [-1, 1] over the cell */
} SpringCells;

/* Tables of W for one pair (n, sigma). */
typedef struct {
    double n, curvature;
    SpringBranch rising, falling;
    SpringCells cells; /* while a branch is prepared; too large for the stack */
} SpringSaturation;

/* What the force functions need of one spring; some 150 kB. */
typedef struct {
    SpringParameters parameters;
    double dFE[SPRING_COEFFICIENTS], dFA[SPRING_COEFFICIENTS], FE_work[SPRING_COEFFICIENTS + 1];
    double x_min, x_max;
    SpringSaturation table;
    int work_rule_count;
    double work_rule[SPRING_WORK_POINTS][2]; /* node, weight */
} SpringLaw;

/* What the spring remembers of its path; see Memory in stepper.py. Ordered so that what each step writes is not copied
 * in one machine word with what it leaves, which would make the next step wait for it. */
typedef struct {
    double displacement, omega;
    double start, start_xi;
    double settled, energy;
    int direction;
} SpringMemory;

/* Derivatives of start_xi, which is all that a stroke inherits, by rho, sigma, n and omega_start. Zero at rest,
 * where the first stroke takes omega_start itself. Kept beside the memory by those who ask for derivatives. */
typedef struct {
    double by_rho, by_sigma, by_n, by_omega_start;
} SpringSensitivity;

/* Derivatives of one output by displacement and by every parameter. */
typedef struct {
    double by_displacement;
    double by_kE[SPRING_COEFFICIENTS], by_kA[SPRING_COEFFICIENTS];
    double by_kappa_omega, by_rho, by_sigma, by_n;
    double by_displacement_offset, by_displacement_min, by_displacement_max, by_omega_start;
} SpringGradient;

/* A number as Python's repr writes it, whatever the locale. */
typedef struct {
    char text[32];
} SpringNumber;

SPRING_LOCAL SpringNumber spring_number(double value);

/* The first reason why the parameters are no physically possible spring, written into text (always terminated), in
 * the words of problems() in parameters.py. Returns 0 if they are possible, else 1. */
SPRING_LOCAL int spring_problem(const SpringParameters *parameters, char *text, size_t size);

/* Prepares a law; the parameters must be possible. Takes one or two milliseconds. */
SPRING_LOCAL void spring_prepare(SpringLaw *law, const SpringParameters *parameters);

/* W(xi) and its inverse for -1 <= u <= 1. */
SPRING_LOCAL double spring_saturation(const SpringSaturation *table, double xi);
SPRING_LOCAL double spring_inverse_saturation(const SpringSaturation *table, double u);

/* The memory at the start of a path. */
SPRING_LOCAL SpringMemory spring_rest(double displacement, double omega);

/* The memory after a straight path to displacement [m], finite; *memory is left as it was. */
SPRING_LOCAL SpringMemory spring_advance(const SpringLaw *law, const SpringMemory *memory, double displacement);

/* Restoring force [N], tangent stiffness in the direction of the last motion [N/m], and energy absorbed since the
 * beginning [J], where the path ends. */
SPRING_LOCAL double spring_force(const SpringLaw *law, const SpringMemory *memory);
SPRING_LOCAL double spring_stiffness(const SpringLaw *law, const SpringMemory *memory);
SPRING_LOCAL double spring_absorbed_energy(const SpringLaw *law, const SpringMemory *memory);

/* The same memory with its energy integrated up to now, so that asking again costs little. */
SPRING_LOCAL SpringMemory spring_settle(const SpringLaw *law, const SpringMemory *memory);

/* The sensitivity that belongs to `after`, which spring_advance made of `before`. Costs nothing while the direction
 * holds. */
SPRING_LOCAL SpringSensitivity spring_advance_sensitivity(
    const SpringLaw *law, const SpringMemory *before, const SpringSensitivity *sensitivity, const SpringMemory *after);

/* spring_advance and, unless `sensitivity` is NULL, spring_advance_sensitivity in place. This takes a third of the time
 * while the direction holds, for what a step has just written is not copied, which would have to wait for it. */
SPRING_LOCAL void spring_move(
    const SpringLaw *law, SpringMemory *memory, SpringSensitivity *sensitivity, double displacement);

/* Exact derivatives of force and stiffness where the path ends. The force's derivative by displacement is the tangent
 * stiffness; a path that has not moved yet (direction 0) answers for the loading direction. For n < 1 the stiffness has
 * a cusp at omega = 0, where its derivative is that of the nearest omega a double resolves beside 1, 2e-16, so that it
 * stays finite. */
SPRING_LOCAL void spring_gradient(
    const SpringLaw *law, const SpringMemory *memory, const SpringSensitivity *sensitivity,
    SpringGradient *of_force, SpringGradient *of_stiffness);

#endif
