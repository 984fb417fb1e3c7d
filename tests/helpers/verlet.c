/* Velocity Verlet on the kernel's spring, from static equilibrium until periods
 * repeat. Includes the kernel, so that both are compiled alike. */
#include "kernel.c"

enum { STEPS = 512, AGREE = 3 };

/* The system and its excitation. */
typedef struct {
    double parallel, series, mass, damping, static_load, strength, frequency; /* strength*cos(2 pi frequency t) [N] */
    double start;  /* displacement of the mount at rest [m] */
    double repeat; /* of the motion, within which three periods in a row must repeat */
} Shaking;

/* found: cosine and sine of the first harmonic of the mount's displacement, and half its stroke, over the last period
 * [m]. Returns the number of periods, 0 if `most` are not enough. */
int verlet(const SpringLaw *law, const Shaking *s, int most, double *found)
{
    double h = 1.0 / (s->frequency * STEPS), half = 0.5 * h / s->mass, per_series = 1.0 / s->series;
    double after_damping = 1.0 / (1.0 + half * s->damping), before_damping = 1.0 - half * s->damping;
    double wave[STEPS][2];
    for (int i = 0; i < STEPS; i++) {
        wave[i][0] = cos(FULL_TURN * i / STEPS);
        wave[i][1] = sin(FULL_TURN * i / STEPS);
    }
    SpringMemory stroke = spring_start(s->start * per_series, 0.0);
    double z = s->start, speed = 0.0, last_cosine = 0.0, last_sine = 0.0;
    double push = s->static_load + s->strength - s->parallel * spring_force(law, &stroke);
    for (int period = 1, agreed = 0; period <= most; period++) {
        double a = 0.0, b = 0.0, low = z, high = z;
        for (int i = 0; i < STEPS; i++) {
            a += z * wave[i][0];
            b += z * wave[i][1];
            double speed_between = before_damping * speed + half * push;
            z += h * speed_between;
            /* As in whole paths: no energy is carried along. */
            spring_commit(law, &stroke, NULL, z * per_series);
            push = s->static_load + s->strength * wave[(i + 1) % STEPS][0] - s->parallel * spring_force(law, &stroke);
            speed = (speed_between + half * push) * after_damping;
            low = z < low ? z : low;
            high = z > high ? z : high;
        }
        a *= 2.0 / STEPS;
        b *= 2.0 / STEPS;
        agreed = hypot(a - last_cosine, b - last_sine) <= s->repeat * hypot(a, b) ? agreed + 1 : 0;
        last_cosine = a;
        last_sine = b;
        if (agreed == AGREE) {
            found[0] = a;
            found[1] = b;
            found[2] = 0.5 * (high - low);
            return period;
        }
    }
    return 0;
}
