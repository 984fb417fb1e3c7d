/* The spring along whole paths, and at points of given strokes. */
#ifndef PATH_H
#define PATH_H

#include "../../core/c/spring/spring.h"

#include <stddef.h>
#include <stdint.h>

/* omega [-], force [N], tangent stiffness in the direction that led to each sample [N/m] (of loading before the first
 * motion), and energy absorbed since the first sample [J], at each of `count` displacements [m]. What is NULL is not
 * computed. The path starts at the first displacement with omega_start. Energies need a table with energies. */
void spring_path(const SpringLaw *law, size_t count, const double *displacement, double omega_start, double *omega,
                 double *force, double *stiffness, double *energy);

/* The displacement that friction follows where reversals of less than `resolution` [m] are none, at each sample [m]. */
void spring_resolved_path(size_t count, const double *displacement, double resolution, double *resolved);

/* Force at samples with given omega [N], and its derivatives by displacement [N/m] and omega [N]. */
void spring_force_at(const SpringLaw *law, size_t count, const double *displacement, const double *omega, double *force,
                     double *by_displacement, double *by_omega);

/* omega at points of several records, each of consecutive strokes, for each rho (`rates` rows of all points), and,
 * unless `derivatives` is NULL, its derivatives for the last rho: rows of all points by ln rho, ln sigma, ln n and the
 * omega_start of the record that a point is of; the table must have derivatives.
 *
 * omega_start                 at the beginning of each record
 * first_stroke, first_point   of each record, and the number of all
 * direction, length           of each stroke: +1 or -1, alternating; [m]
 * stroke, travel              of each point: the stroke it is on, numbered through all records, and how far from its
 *                             beginning [m]
 * workspace                   5 doubles for each stroke */
void spring_on_records(const SpringTable *table, size_t rates, const double *rho, const double *omega_start,
                       size_t records, const int64_t *first_stroke, const int64_t *first_point,
                       const int64_t *direction, const double *length, const int64_t *stroke, const double *travel,
                       double *workspace, double *omega, double *derivatives);

#endif
