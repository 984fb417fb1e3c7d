/* For speed.py: times of steps of FMUs by FMI 3.0 (displacement set, step done, outputs read), and a loop of pow. */
#include "fmi3FunctionTypes.h"

#include <math.h>
#include <time.h>

typedef struct {
    fmi3SetFloat64TYPE *set;
    fmi3DoStepTYPE *step;
    fmi3GetFloat64TYPE *get;
    const fmi3ValueReference *input, *outputs;
    size_t output_count;
} Calls;

void powers(int count, const double *x, double *result);
double in_turn(const Calls *calls, fmi3Instance *instances, int many, int count, const double *displacement);

void powers(int count, const double *x, double *result)
{
    for (int i = 0; i < count; i++)
        result[i] = pow(x[i], 0.5001);
}

static double nanoseconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

static int step(const Calls *calls, fmi3Instance instance, int k, const double *displacement)
{
    double values[8], last;
    bool event, terminate, early;
    int set = calls->set(instance, calls->input, 1, &displacement[k], 1);
    int stepped = calls->step(instance, 1e-3 * k, 1e-3, true, &event, &terminate, &early, &last);
    int got = calls->get(instance, calls->outputs, calls->output_count, values, calls->output_count);
    return set | stepped | got;
}

/* Nanoseconds a step of instances that move in turn along one path; negative if a call fails. */
double in_turn(const Calls *calls, fmi3Instance *instances, int many, int count, const double *displacement)
{
    int status = 0;
    double start = nanoseconds();
    for (int k = 0; k < count; k++)
        for (int i = 0; i < many; i++)
            status |= step(calls, instances[i], k, displacement);
    return status ? -1.0 : (nanoseconds() - start) / count / many;
}
