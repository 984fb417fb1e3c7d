/* One instance as FMI sees it: values set and read, steps, states; the behaviour of core/instance.py, call by call.
 *
 * The response to a displacement that is read before a step commits it is a trial: computed from the committed memory,
 * and kept until it is committed, or reverted by another displacement. A call that returns an error has changed nothing.
 *
 * In the form with states the memory is what inputs and states say, and there is no path to commit.
 */
#ifndef FMI2_INSTANCE_H
#define FMI2_INSTANCE_H

#include "fmi2_api.h"
#include "fmi2_block.h"
#include "fmi2_log.h"
#include "fmi2_state.h"
#include "fmi2_states.h"
#include "fmi2_tables.h"
#include "fmi2_velocity.h"
#include "spring.h"

typedef struct {
    /* What a step needs comes first. */
    unsigned variables; /* their number */
    int has_trial;
    int has_states; /* as settings say */
    SpringMemory trial;   /* after the path from the last commit to the displacement set last, if has_trial */
    const SpringLaw *law; /* of the present parameters: a shared one or the own one; NULL if there is none */
    State state;
    SpringLaw own_law;
    const SharedSpring *shared; /* acquired for the law made last; may be NULL */
    VelocityWatch velocity_watch; /* of the form with states */
    Log log;
    fmi2CallbackFreeMemory free; /* the instance's own memory, which its name follows */
} Instance;

static inline VariableName fmu_variable_name(const Instance *instance, unsigned reference)
{
    return fmu_name(&instance->state.settings, reference);
}

/* Everything as it is after instantiation, in the first mode of model exchange or co-simulation. */
SPRING_LOCAL void fmu_begin(Instance *instance, int mode);

/* Values by reference, which must be of a Real that may be read or set. Reading what is calculated fails while the parameters
 * are not a possible spring. Once the path has begun, parameters that are none are refused; others act from the committed
 * point on, which keeps its omega. */
SPRING_LOCAL fmi2Status fmu_read(
    Instance *instance, const fmi2ValueReference references[], size_t count, double values[]);
SPRING_LOCAL fmi2Status fmu_write(
    Instance *instance, const fmi2ValueReference references[], size_t count, const double values[]);

/* displacement_max - displacement_min [m] */
SPRING_LOCAL double fmu_range(const State *state);

/* Whether the displacement lies outside the identified range. */
SPRING_LOCAL int fmu_extrapolating(const Instance *instance);
static inline fmi2Status fmu_read_extrapolating(const Instance *instance, int *extrapolating)
{
    *extrapolating = fmu_extrapolating(instance);
    return fmi2OK;
}

/* The memory where the path to the displacement set last ends: the committed one or a trial; the law is then present.
 * NULL while the parameters are not a possible spring, or where the memory for its table is missing. */
SPRING_LOCAL const SpringMemory *fmu_reach(Instance *instance);

/* The sensitivity at a memory that fmu_reach has returned. */
SPRING_LOCAL SpringSensitivity fmu_sensitivity(const Instance *instance, const SpringMemory *reached);

/* Starts the path at the displacement that holds, if the parameters are a possible spring. */
SPRING_LOCAL fmi2Status fmu_end_initialization(Instance *instance);

/* Commits the path to the displacement that holds, as of the present time of model exchange. `jumped`: it may have jumped,
 * at an event. */
SPRING_LOCAL fmi2Status fmu_accept(Instance *instance, int jumped);

/* Commits the path through a step of co-simulation, whose time and size are sound. */
SPRING_LOCAL fmi2Status fmu_step(Instance *instance, double time, double size);

/* Takes the instance to a state of this FMU. */
SPRING_LOCAL void fmu_restore(Instance *instance, const State *state);

#endif
