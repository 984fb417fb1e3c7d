/* Velocity Verlet on the kernel's spring: from static equilibrium until periods repeat, or to the fixed point of one
 * period by Anderson's acceleration. Includes the kernel, so that all are compiled alike. */
#include "kernel.c"

enum { AGREE = 3, UNKNOWNS_OF_PERIOD = 3 };

/* The system and its excitation. */
typedef struct {
    double parallel, series, mass, damping, static_load, strength, frequency; /* strength*cos(2 pi frequency t) [N] */
    double start;  /* displacement of the mount at rest [m] */
    double repeat; /* of the motion, within which periods must repeat */
} Shaking;

/* Displacement of the mount [m], its speed [m/s] and the spring, at a crest of the excitation. */
typedef struct {
    double z, speed;
    SpringMemory stroke;
} Motion;

/* One period in `steps` steps, wave being the cosine and sine at each. found: first harmonic of the mount's
 * displacement, cosine and sine, and half its stroke [m]. */
static void run_period(const SpringLaw *law, const Shaking *s, int steps, const double *wave, Motion *motion,
                       double *found)
{
    double h = 1.0 / (s->frequency * steps), half = 0.5 * h / s->mass, per_series = 1.0 / s->series;
    double after_damping = 1.0 / (1.0 + half * s->damping), before_damping = 1.0 - half * s->damping;
    double z = motion->z, speed = motion->speed, a = 0.0, b = 0.0, low = z, high = z;
    SpringMemory stroke = motion->stroke;
    double push = s->static_load + s->strength - s->parallel * spring_force(law, &stroke);
    for (int i = 0; i < steps; i++) {
        a += z * wave[2 * i];
        b += z * wave[2 * i + 1];
        double speed_between = before_damping * speed + half * push;
        z += h * speed_between;
        /* As in whole paths: no energy is carried along. */
        spring_commit(law, &stroke, NULL, z * per_series);
        push = s->static_load + s->strength * wave[2 * ((i + 1) % steps)] - s->parallel * spring_force(law, &stroke);
        speed = (speed_between + half * push) * after_damping;
        low = z < low ? z : low;
        high = z > high ? z : high;
    }
    *motion = (Motion){z, speed, stroke};
    found[0] = 2.0 / steps * a;
    found[1] = 2.0 / steps * b;
    found[2] = 0.5 * (high - low);
}

/* From rest. Returns the number of periods, 0 if `most` are not enough. */
int verlet(const SpringLaw *law, const Shaking *s, int steps, const double *wave, int most, double *found)
{
    Motion motion = {s->start, 0.0, spring_start(s->start / s->series, 0.0)};
    double last[2] = {0.0, 0.0};
    for (int period = 1, agreed = 0; period <= most; period++) {
        run_period(law, s, steps, wave, &motion, found);
        double change = hypot(found[0] - last[0], found[1] - last[1]);
        agreed = change <= s->repeat * hypot(found[0], found[1]) ? agreed + 1 : 0;
        last[0] = found[0];
        last[1] = found[1];
        if (agreed == AGREE)
            return period;
    }
    return 0;
}

/* Weights of the columns of a change (rows of the three unknowns) that add up best to `left`. */
static int best_weights(int columns, double change[][UNKNOWNS_OF_PERIOD], const double *left, double *weights)
{
    double normal[UNKNOWNS_OF_PERIOD * UNKNOWNS_OF_PERIOD];
    size_t order[UNKNOWNS_OF_PERIOD];
    for (int i = 0; i < columns; i++) {
        for (int j = 0; j < columns; j++)
            normal[i * columns + j] = linear_dot(UNKNOWNS_OF_PERIOD, change[i], change[j]) * (i == j ? 1.0 + 1e-14 : 1.0);
        weights[i] = linear_dot(UNKNOWNS_OF_PERIOD, change[i], left);
    }
    if (!linear_factor((size_t)columns, normal, order))
        return 0;
    linear_substitute((size_t)columns, normal, order, weights);
    return 1;
}

/* The periodic motion by Anderson's acceleration of the map over one period, from the state x: displacement, speed and
 * omega, which is replaced by what was found. Returns the number of periods, 0 if `most` are not enough. */
int verlet_accelerated(const SpringLaw *law, const Shaking *s, int steps, const double *wave, int most, double *x,
                       double *found)
{
    double of_x[UNKNOWNS_OF_PERIOD][UNKNOWNS_OF_PERIOD], of_left[UNKNOWNS_OF_PERIOD][UNKNOWNS_OF_PERIOD];
    double before[UNKNOWNS_OF_PERIOD], left_before[UNKNOWNS_OF_PERIOD], smallest = INFINITY;
    double scale[UNKNOWNS_OF_PERIOD] = {1.0, 1.0, 1.0};
    int columns = 0;
    for (int period = 1; period <= most; period++) {
        Motion motion = {x[0], x[1], spring_start(x[0] / s->series, x[2])};
        run_period(law, s, steps, wave, &motion, found);
        if (period == 1) {
            scale[0] = found[2];
            scale[1] = found[2] * FULL_TURN * s->frequency;
        }
        double left[UNKNOWNS_OF_PERIOD] = {motion.z - x[0], motion.speed - x[1], motion.stroke.omega - x[2]};
        double weights[UNKNOWNS_OF_PERIOD] = {0.0}, at[UNKNOWNS_OF_PERIOD], size = 0.0;
        for (int i = 0; i < UNKNOWNS_OF_PERIOD; i++) {
            at[i] = x[i] / scale[i];
            left[i] /= scale[i];
            size = fmax(size, fabs(left[i]));
        }
        if (size <= s->repeat)
            return period;
        if (period > 1) {
            /* The oldest column last. */
            memmove(of_x + 1, of_x, (UNKNOWNS_OF_PERIOD - 1) * sizeof *of_x);
            memmove(of_left + 1, of_left, (UNKNOWNS_OF_PERIOD - 1) * sizeof *of_left);
            for (int i = 0; i < UNKNOWNS_OF_PERIOD; i++) {
                of_x[0][i] = at[i] - before[i];
                of_left[0][i] = left[i] - left_before[i];
            }
            columns = size > 10.0 * smallest ? 0 : columns < UNKNOWNS_OF_PERIOD ? columns + 1 : columns;
        }
        smallest = fmin(smallest, size);
        memcpy(before, at, sizeof before);
        memcpy(left_before, left, sizeof left_before);
        if (columns > 0 && !best_weights(columns, of_left, left, weights))
            columns = 0;
        for (int i = 0; i < UNKNOWNS_OF_PERIOD; i++) {
            double next = at[i] + left[i];
            for (int k = 0; k < columns; k++)
                next -= weights[k] * (of_x[k][i] + of_left[k][i]);
            x[i] = next * scale[i];
        }
        x[2] = clip(x[2], -1.0, 1.0);
    }
    return 0;
}
