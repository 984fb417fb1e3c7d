/* The steady state of the spring over a period of strokes that repeats. */
#include "periodic.h"

#include <math.h>

enum { STEADY_STEPS = 100 };

static const double STEADY_TOLERANCE = 1e-14;

/* A stroke is direction*W(xi0 + rho*s) whatever its direction, so that omega is opposite at the two turns of a loop and
 * W(xi) + W(xi + way) = 0: one rising equation. */
static double two_strokes(const SpringTable *table, double way)
{
    /* No stroke begins before omega = -1. */
    double low = fmax(-way, spring_inverse(table, -1.0)), high = 0.0, xi = fmax(-0.5 * way, low);
    for (int step = 0; step < STEADY_STEPS; step++) {
        double slope_0, slope_1;
        double sum = spring_saturation_slope(table, xi, &slope_0) + spring_saturation_slope(table, xi + way, &slope_1);
        double change = -sum / (slope_0 + slope_1);
        if (change < 0.0)
            high = xi;
        else
            low = xi;
        int is_inside = low < xi + change && xi + change < high, is_last = fabs(change) <= STEADY_TOLERANCE * way;
        double next = is_inside ? xi + change : 0.5 * (low + high);
        if (next == xi || (is_last && !is_inside))
            break;
        xi = next;
        if (is_last)
            break;
    }
    return xi;
}

void spring_steady(const SpringTable *table, size_t strokes, const double *way, int direction, double *omega,
                   double *xi)
{
    if (strokes == 2) {
        xi[0] = xi[1] = two_strokes(table, way[0]);
        *omega = direction * spring_saturation(table, xi[0]);
        return;
    }
    /* omega after a period rises with omega before it, with a slope below 1: its fixed point is unique. */
    double low = -1.0, high = 1.0, last = 4.0;
    for (int step = 0; step < STEADY_STEPS; step++) {
        double before = *omega, at = before, ratio = 1.0;
        for (size_t k = 0; k < strokes; k++) {
            int side = k % 2 ? -direction : direction;
            double slope_0, slope_1;
            xi[k] = spring_inverse(table, side * at);
            spring_saturation_slope(table, xi[k], &slope_0);
            at = side * spring_saturation_slope(table, xi[k] + way[k], &slope_1);
            ratio *= slope_1 / slope_0;
        }
        double gap = at - before;
        if (fabs(gap) <= STEADY_TOLERANCE)
            return;
        if (gap > 0.0)
            low = before;
        else
            high = before;
        double change = gap / (1.0 - fmin(ratio, STEEPEST));
        /* For n < 1 Newton's method alone may oscillate about omega = 0. */
        if (low < before + change && before + change < high && fabs(change) < 0.5 * last) {
            *omega = before + change;
            last = fabs(change);
        } else {
            *omega = 0.5 * (low + high);
            last = high - low;
        }
        if (*omega == before)
            return;
    }
}
