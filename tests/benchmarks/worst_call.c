/* Times single steps of an FMU of FMI 3.0 for worst_call.py: displacement set, step done, all outputs read. */
#include "fmi3FunctionTypes.h"
#include "ticks.h"

typedef struct {
    fmi3SetFloat64TYPE *set;
    fmi3DoStepTYPE *step;
    fmi3GetFloat64TYPE *get;
    fmi3Instance instance;
    const fmi3ValueReference *input, *outputs;
    size_t output_count;
} Calls;

int worst_calls(const Calls *calls, double start_time, int count, const double *displacement, unsigned *ticks);

/* Once along a path: ticks[k] becomes the fewer of what it was and what step k took, less those of measuring. Returns
 * the worst status. */
int worst_calls(const Calls *calls, double start_time, int count, const double *displacement, unsigned *ticks)
{
    unsigned long long empty = ticks_of_nothing();
    int worst = fmi3OK;
    double time = start_time;
    for (int k = 0; k < count; k++, time += 1e-3) {
        double values[8], last;
        bool event, terminate, early;
        unsigned long long start = ticks_now();
        int set = calls->set(calls->instance, calls->input, 1, &displacement[k], 1);
        int stepped = calls->step(calls->instance, time, 1e-3, true, &event, &terminate, &early, &last);
        int got = calls->get(calls->instance, calls->outputs, calls->output_count, values, calls->output_count);
        unsigned long long taken = ticks_now() - start;
        taken = taken > empty ? taken - empty : 0;
        if (taken < ticks[k])
            ticks[k] = (unsigned)taken;
        worst = set > worst ? set : worst;
        worst = stepped > worst ? stepped : worst;
        worst = got > worst ? got : worst;
    }
    return worst;
}
