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

/* Sum of products, in an order that does not depend on the compiler. */
SPRING_LOCAL double linear_dot(size_t count, const double *a, const double *b);

/* Euclidean norm, and that of a difference. */
SPRING_LOCAL double linear_norm(size_t count, const double *values);
SPRING_LOCAL double linear_distance(size_t count, const double *a, const double *b);

/* Replaces a matrix (rows of `count`) by its factors L and U, with the row that each row changed places with. Returns 0
 * if it is singular. */
SPRING_LOCAL int linear_factor(size_t count, double *matrix, size_t *order);

/* Solves matrix*x = right side by those factors; the solution replaces the right side. */
SPRING_LOCAL void linear_substitute(size_t count, const double *factors, const size_t *order, double *right);

#endif
