/* The universal function W of the normalized Bouc-Wen model and its inverse, tabulated.
 *
 * On a monotone stroke u = direction*omega obeys du/dxi = 1 - u^n for u >= 0 and 1 + (2 sigma - 1)*(-u)^n for u < 0
 * (Zhao et al. 2013, eq. 22), so that one increasing function u = W(xi), W(0) = 0, describes every stroke; see
 * saturation.py, which derives it. Here both branches are cut into pieces on which |W| is a polynomial of |xi| and |xi|
 * nearly one of |W|, so that W and its inverse each cost a look-up and a polynomial, wherever they are asked for.
 *
 * The caller owns all memory. A table is read by any number of threads at once.
 */
#ifndef SATURATION_H
#define SATURATION_H

#include "numerics.h"
#include "spring_library.h"
#include "spring_local.h"

enum {
    SPRING_POWERS = 12,    /* coefficients of a polynomial of degree 11 */
    SPRING_PIECES = 156,   /* of a branch; 153 are taken at most */
    SPRING_GROUPS = 206    /* of 1, 4, 16 and 64 pieces */
};

/* A polynomial on a short interval: of theta = (argument - middle)*per_half, -1 <= theta <= 1. |W| is one of |xi|, and
 * the theta of that one is a polynomial of |W|, or of 1 - |W| near saturation; the latter is only where Newton's method
 * for the former begins. */
typedef struct {
    double middle, per_half, coefficients[SPRING_POWERS];
} SpringPiece;

/* One branch of W, W >= 0 or W < 0. */
typedef struct {
    int pieces;
    int complemented;                      /* from this piece on the inverse is written for 1 - |W| */
    double edges[SPRING_PIECES + 1];       /* |xi| between the pieces; beyond the last |W| = 1 */
    double values[SPRING_PIECES + 1];      /* |W| at the edges */
    double complements[SPRING_PIECES + 1]; /* |W| - 1 at the edges, accurate also where |W| is 1 within rounding */
    SpringPiece piece[SPRING_PIECES];
    SpringPiece inverse[SPRING_PIECES];
    /* For energies: the integral of |W|*p over a group of pieces is the sum of shares*p at Gauss's nodes on the group, for
     * every polynomial p of degree 9; numbered by spring_group. */
    double shares[SPRING_GROUPS][GAUSS_POINTS];
#ifndef SPRING_STEPS_ONLY
    /* Derivatives of |W| by n and sigma at fixed |xi|, as polynomials of theta. */
    double by_n[SPRING_PIECES][SPRING_POWERS], by_sigma[SPRING_PIECES][SPRING_POWERS];
#endif
} SpringBranch;

/* W for one pair (n, sigma); some 170 kB. */
typedef struct {
    double n, curvature; /* 2 sigma - 1 */
    int has_energies;    /* whether the shares are filled */
    SpringBranch rising, falling;
} SpringTable;

/* W at one xi, with its derivatives by xi, n and sigma. */
typedef struct {
    double u, slope, by_n, by_sigma;
} SpringSlopes;

#ifndef SPRING_STEPS_ONLY
/* What a table holds besides W and its inverse, each of which takes about half as long to fill again; and how
 * finely. */
enum {
    SPRING_WITH_DERIVATIVES = 1, /* by n and sigma */
    SPRING_WITH_ENERGIES = 2,    /* the blocks */
    SPRING_COARSE = 4            /* to 1e-8 only, in a quarter of the time */
};

/* Fills a table in a fraction of a millisecond; 0.01 <= n <= 100, 0.5 <= sigma <= 1000. */
SPRING_LOCAL void spring_tabulate(SpringTable *table, double n, double sigma, int with);
#endif

/* W(xi). */
SPRING_LOCAL double spring_saturation(const SpringTable *table, double xi);

/* xi where a stroke begins that takes over -1 <= u <= 1: the inverse of the tabulated W itself, to rounding, so that
 * many small reversals do not drift. u = 1 gives the largest xi of the table. */
SPRING_LOCAL double spring_inverse(const SpringTable *table, double u);

/* W and W' at xi. */
SPRING_LOCAL double spring_saturation_slope(const SpringTable *table, double xi, double *slope);

/* W and its derivatives at xi; those by n and sigma are valid if the table has been filled with them. */
SPRING_LOCAL SpringSlopes spring_slopes(const SpringTable *table, double xi);

/* u^n, 0 <= u <= 1, within 3e-16, and ln u, u > 0, within 3e-16 of itself: the same bits on every machine, without
 * errno. */
SPRING_LOCAL double spring_power(double u, double n);
SPRING_LOCAL double spring_logarithm(double u);

/* e^y, y <= 0, and (e^y - 1 - y)/y^2, |y| <= 0.35, likewise. */
SPRING_LOCAL double spring_exponential(double y);
SPRING_LOCAL double spring_exponential_tail(double y);

/* The polynomial of a piece. */
static inline double spring_polynomial(const double *c, double t)
{
    /* Not Horner's rule, whose operations each wait for the one before. */
    double square = t * t, fourth = square * square;
    double low = (c[0] + c[1] * t) + (c[2] + c[3] * t) * square;
    double middle = (c[4] + c[5] * t) + (c[6] + c[7] * t) * square;
    double high = (c[8] + c[9] * t) + (c[10] + c[11] * t) * square;
    return low + fourth * (middle + fourth * high);
}

/* The number of the group of 4^level pieces that begins with a piece. */
static inline int spring_group(int level, int piece)
{
    static const int FIRST[] = {0, 156, 195, 204};
    return FIRST[level] + (piece >> 2 * level);
}

/* The piece that holds |xi| = z >= 0, as many as there are beyond the last, and |W| there. */
SPRING_LOCAL int spring_piece(const SpringBranch *branch, double z);
SPRING_LOCAL double spring_on_piece(const SpringBranch *branch, int piece, double z);

/* The shares of what lies between |xi| = a and b on one piece, or beyond the last. */
static inline void spring_shares(const SpringBranch *branch, int piece, double a, double b, double *shares)
{
    double half = 0.5 * (b - a);
    for (int k = 0; k < GAUSS_POINTS; k++)
        shares[k] = half * GAUSS_WEIGHTS[k] * spring_on_piece(branch, piece, a + half * (1.0 + GAUSS_NODES[k]));
}

#endif
