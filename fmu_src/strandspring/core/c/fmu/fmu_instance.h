/* One instance as FMI sees it: values set and read, steps, states; the behaviour of core/instance.py, call by call.
 *
 * The response to a displacement that is read before a step commits it is a trial: computed from the committed memory,
 * and kept until it is committed, or reverted by another displacement. A call that returns an error has changed
 * nothing.
 *
 * In the form with states the memory is what inputs and states say, and there is no path to commit.
 */
#ifndef FMU_INSTANCE_H
#define FMU_INSTANCE_H

#include "../fmi/fmu_life.h"
#include "../fmi/fmu_log.h"
#include "../fmi/fmu_modes.h"
#include "fmu_state.h"
#include "../fmi/fmu_tables.h"
#include "../spring/spring.h"

#include <math.h>

/* Values that the host gives in one call, which all take effect or none. */
typedef struct {
    double displacement, velocity, omega, energy;
    int has_parameters, has_added;
    double second_omega, elongation[SPRING_MAXWELLS]; /* if has_added */
    Settings settings; /* if so */
} Changes;

/* The law of a mechanism as an instance holds it. */
typedef struct {
    const SpringLaw *law; /* of the present parameters: a shared one or its own; NULL if there is none */
    const SharedSpring *shared; /* that of the start values; NULL if they are no spring, or no path is remembered */
    SharedSpring *own; /* for other values; NULL if there is no such mechanism */
} HeldLaw;

typedef struct {
    /* What a step needs comes first. */
    unsigned variables; /* their number in FMI 2.0, where each coefficient is one: references of elements go up to it */
    int has_trial;
    int has_states; /* as settings say */
    SpringMemory trial;   /* after the path from the last commit to the displacement set last, if has_trial */
    SpringMemory shown;   /* with input_resolution: the same at that displacement, where the friction is not */
    int has_added; /* whether there is a second mechanism or a branch */
    HeldLaw first, second; /* of the first mechanism, and of the second, if there is one */
    State state;
    SpringAddedMemory added_trial; /* which belongs to the trial, as of a jump */
    SpringDecay decays[SPRING_MAXWELLS]; /* of the branches over `duration` [s]; no part of the state */
    double duration;
    Changes changes;
    VelocityWatch velocity_watch; /* of the form with states */
    Log log;
    Memory memory; /* the host's functions for the instance's own memory, which its name follows */
} Instance;

/* A new instance, in the first mode of model exchange or co-simulation; NULL, after a message, if there can be none. */
SPRING_LOCAL Instance *fmu_instantiate(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory, int mode);

/* NULL is allowed. */
SPRING_LOCAL void fmu_free(Instance *instance);

static inline VariableName fmu_variable_name(const Instance *instance, unsigned reference)
{
    (void)instance;
    return fmu_name(reference);
}

/* Everything as it is after instantiation, in the first mode of model exchange or co-simulation. */
SPRING_LOCAL void fmu_begin(Instance *instance, int mode);

/* Values by reference, which must be of a Real. Reading what is calculated fails while the parameters are not a
 * possible spring. */
SPRING_LOCAL FmuStatus fmu_read(Instance *instance, const unsigned references[], size_t count, double values[]);

/* Whether a variable may be set now, and to this value. In the form with states it may be wherever no path depends on
 * it. */
SPRING_COLD FmuStatus fmu_require_other_change(const Instance *instance, unsigned reference, double value);
static inline FmuStatus fmu_require_change(const Instance *instance, unsigned reference, double value)
{
    /* The usual case in a few instructions. */
    return reference == SPRING_DISPLACEMENT && fabs(value) <= LARGEST_DISPLACEMENT
               ? FMU_OK
               : fmu_require_other_change(instance, reference, value);
}

/* Sets values that may be: opened, each given, applied. Once the path has begun, parameters that are no spring are
 * refused; others act from the committed point on, which keeps its omega. */
SPRING_LOCAL void fmu_open_changes(Instance *instance);
SPRING_LOCAL void fmu_change(Instance *instance, unsigned reference, double value);
SPRING_LOCAL FmuStatus fmu_apply_changes(Instance *instance);

/* displacement_max - displacement_min [m] */
SPRING_LOCAL double fmu_range(const State *state);

/* Whether the displacement lies outside the identified range. */
SPRING_LOCAL int fmu_extrapolating(const Instance *instance);
static inline FmuStatus fmu_read_extrapolating(const Instance *instance, int *extrapolating)
{
    *extrapolating = fmu_extrapolating(instance);
    return FMU_OK;
}

/* Prepares the law of the present parameters, unless it is there. */
SPRING_LOCAL FmuStatus fmu_require_law(Instance *instance);

/* The memory where the path to the displacement set last ends: the committed one or a trial; the law is then present.
 * NULL while the parameters are not a possible spring, or where the memory for its table is missing. */
SPRING_LOCAL const SpringMemory *fmu_reach(Instance *instance);

/* The memory of a second mechanism and of branches that belongs to what fmu_reach has returned. */
static inline const SpringAddedMemory *fmu_added_at(const Instance *instance, const SpringMemory *reached)
{
    return reached == &instance->state.memory ? &instance->state.added : &instance->added_trial;
}

/* The sensitivity at a memory that fmu_reach has returned. */
SPRING_LOCAL SpringSensitivity fmu_sensitivity(const Instance *instance, const SpringMemory *reached);

/* Starts the path at the displacement that holds, if the parameters are a possible spring. */
SPRING_LOCAL FmuStatus fmu_end_initialization(Instance *instance);

/* Commits the path to the displacement that holds, as of the present time of model exchange. `jumped`: it may have
 * jumped, at an event. */
SPRING_LOCAL FmuStatus fmu_accept(Instance *instance, int jumped);

/* Commits the path through a step of co-simulation, whose time and size are sound: straight to the displacement set
 * last or, if derivatives have been set, the parabola that begins there. */
SPRING_APART FmuStatus fmu_step(Instance *instance, double time, double size);

/* The same where no derivatives can be set; `reached` becomes the time that it reaches, unless it is refused. The step
 * comes last, so that it needs no more stack. */
static inline FmuStatus fmu_step_to(Instance *instance, double time, double size, double *reached)
{
    if (fmu_require_law(instance) != FMU_OK)
        return FMU_ERROR;
    *reached = time + size;
    return fmu_step(instance, time, size);
}

/* Of model exchange: how many event indicators there are, 0 or 1, and its value; how many continuous states there are. */
static inline size_t fmu_indicators(const Instance *instance)
{
    return instance->has_states || instance->state.settings.added.branches > 0 ? 0 : 1;
}

static inline double fmu_indicator(const Instance *instance)
{
    const State *state = &instance->state;
    return fmu_watch_indicator(&state->watch, state->time, state->displacement, fmu_range(state));
}

enum { MOST_STATES = 2 + 1 + SPRING_MAXWELLS };

static inline size_t fmu_states(const Instance *instance)
{
    const SpringAdded *added = &instance->state.settings.added;
    return instance->has_states ? 2 + (size_t)(added->mechanisms + added->branches) : 0;
}

/* Takes the instance to a state of this FMU. */
SPRING_LOCAL void fmu_restore(Instance *instance, const State *state);

#endif
