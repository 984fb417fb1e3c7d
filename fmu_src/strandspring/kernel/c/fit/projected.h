/* Linear least squares with some columns that never change: orthonormal rows and what lies beside them. Everything is
 * in rows of `points` numbers. */
#ifndef PROJECTED_H
#define PROJECTED_H

#include <stddef.h>

/* Makes rows orthonormal one after the other by the modified method of Gram and Schmidt, repeated where much was lost.
 * What they were is triangle*rows, transposed: triangle[k*count + i] is the share of row i in what row k was. A row
 * that depends on those before it becomes 0, as does its element of the diagonal. */
void projected_frame(size_t points, size_t count, double *rows, double *triangle);

/* Takes from a row what lies along orthonormal ones, and writes the shares of each. */
void projected_beside(size_t points, size_t count, const double *frame, double *row, double *along);

/* Least squares of a target by the rows of a frame and others times omega.
 *
 * frame, triangle   of the fixed columns, from projected_frame: `fixed` of them
 * along             of the target along the frame
 * moving            `count` rows, which are taken times omega
 * target            beside the frame
 * rows              becomes those beside the frame, orthonormal: `count` of them
 * coefficients      become those of the fixed and of the moving columns; 0 where a column depends on those before it
 * residuals         become those of the target
 * workspace         count*(fixed + count) + fixed + count doubles
 *
 * Returns half the sum of their squares. */
double projected_fit(size_t points, size_t fixed, const double *frame, const double *triangle, const double *along,
                     size_t count, const double *moving, const double *target, const double *omega, double *rows,
                     double *coefficients, double *residuals, double *workspace);

/* Triangle R of the QR decomposition of [J, residuals], transposed as above, with J in Kaufman's form: the derivatives
 * of omega (`parameters` rows) times the sum of the moving columns, beside all columns. Workspace: parameters + 1
 * rows, and fixed + count doubles. */
void projected_triangle(size_t points, size_t fixed, const double *frame, size_t count, const double *moving,
                        const double *rows, const double *coefficients, const double *residuals, size_t parameters,
                        const double *derivatives, double *triangle, double *workspace);

#endif
