/* Normal equations of the integrated eq. (22), which the two-stage identification scans over n. */
#include <math.h>
#include <stdint.h>
#include <string.h>

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
                      size_t count, const double *n, const double *powers, double *sums)
{
    memset(sums, 0, 5 * count * sizeof *sums);
    for (size_t k = 0; k < count; k++) {
        const double *power = powers + k * points;
        double *sum = sums + 5 * k;
        for (size_t stroke = 0; stroke < strokes; stroke++) {
            double up = 0.0, down = 0.0, up_before = 0.0, down_before = 0.0;
            double w = 0.0, wd = 0.0, wr = 0.0, dd = 0.0, dr = 0.0, rr = 0.0, dy = 0.0, ry = 0.0;
            for (int64_t i = begin[stroke]; i < begin[stroke + 1]; i++) {
                double up_here = u[i] > 0.0 ? power[i] : 0.0, down_here = u[i] < 0.0 ? power[i] : 0.0;
                if (per_change[i] != 0.0) {
                    up += (up_here - up_before) * per_change[i];
                    down -= (down_here - down_before) * per_change[i];
                } else if (u[i] != 0.0) {
                    double level = power[i] * (n[k] + 1.0) / fabs(u[i]) * step[i];
                    *(u[i] > 0.0 ? &up : &down) += level;
                }
                up_before = up_here;
                down_before = down_here;
                double d = travel[i] - up, r = down;
                w += weight[i];
                wd += weight[i] * d;
                wr += weight[i] * r;
                dd += weight[i] * d * d;
                dr += weight[i] * d * r;
                rr += weight[i] * r * r;
                dy += weight[i] * d * target[i];
                ry += weight[i] * r * target[i];
            }
            sum[0] += dd - wd * wd / w;
            sum[1] += dr - wd * wr / w;
            sum[2] += rr - wr * wr / w;
            sum[3] += dy;
            sum[4] += ry;
        }
    }
}
