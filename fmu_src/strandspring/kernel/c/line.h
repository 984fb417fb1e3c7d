/* Normal equations of the integrated eq. (22), which the two-stage identification scans over n. */
#ifndef LINE_H
#define LINE_H

#include <stddef.h>
#include <stdint.h>

/* On a stroke, with u = direction*omega and the travel s,
 *
 *     u(s) = u(0) + a*d + b*r,   d = s - integral over u > 0 of u^n ds,   r = integral over u < 0 of (-u)^n ds.
 *
 * Writes the weighted sums of d*d, d*r, r*r, d*target and r*target, each stroke's weighted means taken out, for each n:
 * five to a row of `sums`. Between two points u is a straight line.
 *
 * begin (strokes + 1): first point of each stroke, and the number of points. powers: |u|^(n + 1)/(n + 1), a row for
 * each n. step: travel since the point before, or since the beginning of the stroke. per_change: step over the change
 * of u; 0 where u does not change, as at the first point of a stroke. target: without each stroke's weighted mean. */
void spring_line_sums(size_t strokes, const int64_t *begin, size_t points, const double *travel, const double *u,
                      const double *step, const double *per_change, const double *weight, const double *target,
                      size_t count, const double *n, const double *powers, double *sums);

#endif
