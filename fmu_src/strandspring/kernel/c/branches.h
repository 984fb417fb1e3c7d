/* Maxwell branches along whole paths of times that never fall, straight between samples, with no force at the first. */
#ifndef KERNEL_BRANCHES_H
#define KERNEL_BRANCHES_H

#include "../../core/c/spring/branches.h"

#include <stddef.h>

/* Adds the force of a branch at each sample [N], the integral of it over the displacement since the first [J], and the
 * energy in its spring [J]. */
void spring_maxwell_path(double stiffness, double time_constant, size_t count, const double *displacement,
                         const double *time, double *force, double *energy, double *stored);

/* Elongations of branches, a row of `count` each [m], and their derivatives by the logarithm of the time constant. */
void spring_maxwell_columns(size_t branches, const double *time_constant, size_t count, const double *displacement,
                            const double *time, double *elongation, double *by_log);

#endif
