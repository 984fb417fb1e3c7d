/* One instance of bodies on mounts as FMI sees it.
 *
 * Variables by value reference: `extrapolating`; the inputs, which are the channels of motion.h; the absolute acceleration of each
 * point in x, y and z; how far each point has moved from rest in x, y and z; the force of each axis of a mount; the displacement of
 * one spring of each axis; absorbed_energy; the parameters, as in Settings.
 *
 * When initialization ends, all bodies are at rest under gravity. A step of co-simulation is cut into equal steps of `step` at
 * most. Inputs hold, or go straight on with their derivatives, over a step of co-simulation, after which they keep the value
 * that they have reached. A call that returns an error has changed nothing. Nothing is allocated after instantiation, except
 * for states that the host asks for. */
#ifndef SYSTEM_INSTANCE_H
#define SYSTEM_INSTANCE_H

#include "../../core/c/fmu_kinds.h"
#include "../../core/c/fmu_life.h"
#include "../../core/c/fmu_log.h"
#include "../../core/c/fmu_modes.h"
#include "../../core/c/fmu_tables.h"
#include "system_block.h"

enum { SYSTEM_EXTRAPOLATING, SYSTEM_FIRST_INPUT };
enum { SYSTEM_PARAMETERS = sizeof(Settings) / sizeof(double) };

/* The first value reference of each group behind the inputs. */
typedef struct {
    unsigned acceleration, sway, force, displacement, energy, parameter;
} Groups;

/* Everything that an instance remembers; `motion` points to the arrays behind it. */
typedef struct {
    int mode; /* one of fmu_modes.h */
    double time, stop_time; /* [s]; stop_time is infinite if there is none */
    Settings settings;
    double inputs[MOTION_CHANNELS], slopes[MOTION_CHANNELS]; /* and their derivatives for the next step */
    int is_interpolated;                                     /* whether these were set */
    int is_at_rest;                                          /* whether the rest of these settings has been found */
    int extrapolating;
    int is_outside[MOTION_AXES]; /* whether a spring was outside its range at the end of the last step */
    double rest_sway[3 * MOTION_POINTS];
    MotionState motion;
    MotionBodyState bodies[MOTION_BODIES];
    MotionReach reach[MOTION_AXES];
    MotionAxisState axes[MOTION_AXES];
} State;

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
    State before; /* the step that is being done */
    int has_accelerations, has_sway;
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

/* Bytes of an instance with its system, and makes it of memory that is zero. Returns 0 if the memory for a table is missing. */
SPRING_LOCAL size_t system_instance_size(void);
SPRING_LOCAL int system_make(Instance *instance);
SPRING_LOCAL void system_release(Instance *instance);

/* Everything as it is after instantiation. */
SPRING_LOCAL void fmu_begin(Instance *instance, int mode);

/* Values by reference, which must be of a Real. What is calculated fails before initialization mode, and while the bodies
 * find no rest. */
SPRING_LOCAL FmuStatus fmu_read(
    Instance *instance, const unsigned references[], size_t count, double values[]);

/* Whether a spring is outside its identified range, or was at the end of a step within the last step of co-simulation. */
SPRING_LOCAL FmuStatus fmu_read_extrapolating(Instance *instance, int *extrapolating);

/* Refuses to set a variable now, or what no input or parameter may be. */
SPRING_LOCAL FmuStatus system_require_change(const Instance *instance, unsigned reference, double value);

/* Whether all parameters are what they may be. */
SPRING_LOCAL int system_are_possible(const Settings *settings);

/* Sets values that may be set. */
SPRING_LOCAL void system_write(
    Instance *instance, const unsigned references[], size_t count, const double values[]);

SPRING_LOCAL VariableCausality system_causality(const Instance *instance, unsigned reference);

SPRING_LOCAL FmuStatus fmu_end_initialization(Instance *instance);

/* A step of co-simulation, whose time and size are sound. */
SPRING_LOCAL FmuStatus system_step(Instance *instance, double time, double size);

/* The part of a state that no motion has, "motion" or "springs", or NULL. */
SPRING_LOCAL const char *system_impossible_motion(const State *state);

/* Takes the instance to a state of this FMU. */
SPRING_LOCAL void fmu_restore(Instance *instance, const State *state);

/* The size of the serialized form, which is the same for all states of one FMU. */
SPRING_LOCAL size_t fmu_state_size(void);

SPRING_LOCAL void fmu_state_write(const State *state, unsigned char *bytes);

/* Reads a state written by the same FMU, and checks that it can be one. Returns 0, or 1 with the reason in `problem`
 * (always terminated) if it is none; *state is then undefined. */
SPRING_LOCAL int fmu_state_read(
    State *state, const unsigned char *bytes, size_t size, char *problem, size_t problem_size);

#endif
