/* Vectors and matrices of a few dozen numbers. */
#ifndef LINEAR_H
#define LINEAR_H

#include "../../core/c/spring/spring_local.h"

#include <stddef.h>

/* Memory that is divided into parts, and how many numbers of it are taken; without memory they are only counted. */
typedef struct {
    double *memory;
    size_t taken;
} Workspace;

/* The next `count` numbers of a workspace. */
SPRING_LOCAL double *linear_taken(Workspace *workspace, size_t count);

/* Largest absolute value; NaN if there is one. */
SPRING_LOCAL double linear_largest(size_t count, const double *values);

/* Euclidean norm, and that of a difference. */
SPRING_LOCAL double linear_norm(size_t count, const double *values);
SPRING_LOCAL double linear_distance(size_t count, const double *a, const double *b);

/* Solves matrix*x = right side by Gaussian elimination with row interchanges; the solution replaces the right side, the
 * matrix (rows of `count`) is lost. Returns 0 if it is singular. */
SPRING_LOCAL int linear_solve(size_t count, double *matrix, double *right);

#endif
