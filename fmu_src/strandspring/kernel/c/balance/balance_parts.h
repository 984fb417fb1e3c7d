/* What the files of balance.h share. */
#ifndef BALANCE_PARTS_H
#define BALANCE_PARTS_H

#include "../linear.h"
#include "balance.h"
#include "periodic.h"

/* The balance of one motion; arrays as in balance.h. */
typedef struct {
    double *z, *residual, *by_frequency;
    BalancedMotion motion;
    double scale, size; /* size: largest entry of the residual [N] */
} Balance;

/* The parts of the workspace. */
typedef struct {
    Balance here, there;
    double *step, *guess, *last;           /* D*N each */
    double *tangent, *before;              /* D*N each: by ln(Omega), at the last motion and at the one before it */
    double way;                            /* of ln(Omega) between these; 0 if there is none before */
    double *matrix;                        /* D*N rows of D*N: the Jacobian of some motion near by, or its factors */
    size_t *order;                         /* D*N: of the factors */
    int is_factored;
    double *moved, *sizes;                 /* displacement of each axis, M rows of N [m]; how far it moves, M [m] */
    double *values, *rates;                /* the coordinates and their derivatives by the phase, D rows of K [m] */
    double *products;                      /* N rows of N for each coordinate, of products with it [m] */
    double *gradient, *turning;            /* g of an axis and its derivative by the phase, D rows of K */
    double *stiffness, *damping;           /* dr/dq and dr/dq' of the forces r, D*D rows of K [N/m] */
    double *is_coupled;                    /* D*D: whether they are anything but 0 */
    double *damped;                        /* forces of the dampers over Omega, D rows of K [N s] */
    double *column, *row;                  /* of a stroke, D*N each */
    int is_bent;                           /* whether any second derivative is not 0 */
    double *product;                       /* N rows of N */
    double *memory;                        /* what the force owes to the beginning of one stroke, K [N/m] */
    double *signal;                        /* K */
    SpringPeriod period;
    double *fourier, *periodic;
} BalanceRoom;

/* D*N. */
SPRING_LOCAL size_t balance_size(const BalancedSystem *system);

/* The parts of the workspace, where z is the motion of `here`. */
SPRING_LOCAL BalanceRoom balance_begin(const BalancedSystem *system, const double *z);

/* Fills the balance of the motion balance->z and, unless it is NULL, the Jacobian; returns 0 if it does not move. */
SPRING_LOCAL int balance_motion(
    BalancedSystem *system, double frequency, BalanceRoom *room, Balance *balance, double *jacobian);

/* Hands out what the motion in room->here is besides its coefficients, as the motion of a number. */
SPRING_LOCAL void balance_hand_out(
    const BalancedSystem *system, const BalanceRoom *room, const BalancedMotion *motion, size_t number);

#endif
