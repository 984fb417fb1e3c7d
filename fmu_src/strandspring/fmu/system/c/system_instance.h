/* One instance of bodies on mounts as FMI sees it.
 *
 * Variables by value reference: `extrapolating`; the inputs, which are the channels of motion.h; the absolute
 * acceleration of each point in x, y and z; how far each point has moved from rest in x, y and z; the force of each
 * axis of a mount; the displacement of one spring of each axis; how far each body has turned from rest; the force of
 * all mounts on the base in x, y and z; absorbed_energy; the parameters, as in SystemSettings.
 *
 * When initialization ends, all bodies are at rest under gravity. A step of co-simulation is cut into equal steps of
 * `step` at most. Inputs hold, or go straight on with their derivatives, over a step of co-simulation, after which they
 * keep the value that they have reached. A call that returns an error has changed nothing. Nothing is allocated after
 * instantiation, except for states that the host asks for. */
#ifndef SYSTEM_INSTANCE_H
#define SYSTEM_INSTANCE_H

#include "../../../core/c/fmi/fmu_interface.h"
#include "../../../core/c/fmi/fmu_life.h"
#include "../../../core/c/fmi/fmu_log.h"
#include "../../../core/c/fmi/fmu_modes.h"
#include "../../../core/c/fmi/fmu_tables.h"
#include "system_state.h"

enum { SYSTEM_EXTRAPOLATING, SYSTEM_FIRST_INPUT };

/* The first value reference of each group behind the inputs. */
typedef struct {
    unsigned acceleration, sway, force, displacement, tilt, reaction, energy, parameter;
} Groups;

/* An axis that has left its range within a step, and where it was then. */
typedef struct {
    unsigned axis;
    double displacement;
} Excursion;

typedef struct {
    unsigned variables; /* their number */
    Groups first;
    MotionSystem system;
    State state;
    union {
        State before; /* the step that is being done */
        double of_rest[MOTION_REST]; /* workspace of motion_rest */
    };
    int has_points; /* whether they are as the state is */
    double accelerations[3 * MOTION_POINTS], sway[3 * MOTION_POINTS];
    Excursion excursions[MOTION_AXES];
    SpringLaw *laws;
    const SharedSpring **shared; /* whose tables the laws use */
    size_t springs;
    Log log;
    Memory memory; /* the host's functions for the instance's own memory, which the system and its name follow */
} Instance;

static inline VariableType fmu_type(unsigned reference)
{
    return reference == SYSTEM_EXTRAPOLATING ? VARIABLE_BOOLEAN : VARIABLE_REAL;
}

static inline VariableName fmu_variable_name(const Instance *instance, unsigned reference)
{
    (void)instance;
    return system_name(reference);
}

/* A new instance for co-simulation, as fmu_new_instance makes its memory; NULL, after a message, if there can be
 * none. */
SPRING_LOCAL Instance *fmu_instantiate(
    Log *log, const char *name, const char *guid, const char *guid_name, const Memory *memory, int mode);

/* NULL is allowed. */
SPRING_LOCAL void fmu_free(Instance *instance);

/* Everything as it is after instantiation. */
SPRING_LOCAL void fmu_begin(Instance *instance, int mode);

/* Values by reference, which must be of a Real. What is calculated fails before initialization mode, and while the
 * bodies find no rest. */
SPRING_LOCAL FmuStatus fmu_read(
    Instance *instance, const unsigned references[], size_t count, double values[]);

/* Whether a spring is outside its identified range, or was at the end of a step within the last step of
 * co-simulation. */
SPRING_LOCAL FmuStatus fmu_read_extrapolating(Instance *instance, int *extrapolating);

/* Refuses to set a variable now, or what no input or parameter may be. */
SPRING_LOCAL FmuStatus fmu_require_change(const Instance *instance, unsigned reference, double value);

/* Sets values that may be set, one by one. */
static inline void fmu_open_changes(const Instance *instance)
{
    (void)instance;
}
SPRING_LOCAL void fmu_change(Instance *instance, unsigned reference, double value);
static inline FmuStatus fmu_apply_changes(const Instance *instance)
{
    (void)instance;
    return FMU_OK;
}

SPRING_LOCAL VariableCausality system_causality(const Instance *instance, unsigned reference);

SPRING_LOCAL FmuStatus fmu_end_initialization(Instance *instance);

/* A step of co-simulation, whose time and size are sound. */
SPRING_LOCAL FmuStatus fmu_step(Instance *instance, double time, double size);

/* The same; `reached` becomes the time that it reaches, unless it is refused. */
static inline FmuStatus fmu_step_to(Instance *instance, double time, double size, double *reached)
{
    FmuStatus status = fmu_step(instance, time, size);
    *reached = instance->state.time;
    return status;
}

/* There is no event indicator. */
static inline size_t fmu_indicators(const Instance *instance)
{
    (void)instance;
    return 0;
}
static inline double fmu_indicator(const Instance *instance)
{
    (void)instance;
    return 0.0;
}

/* Takes the instance to a state of this FMU. */
SPRING_LOCAL void fmu_restore(Instance *instance, const State *state);

#endif
