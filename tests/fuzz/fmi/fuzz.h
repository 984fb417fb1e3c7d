/* Random sequences of FMI calls against the sources of an FMU, for the sanitizers to watch and an oracle to judge.
 *
 * A sequence is the life of one instance, from fmi2Instantiate to fmi2FreeInstance; several instances of either type
 * live at once and share states. What a simulator can know of the FMU comes from fuzz_model.h, which fuzzing.py writes
 * from modelDescription.xml; what the standard demands is in oracle.c. Nothing is taken from the headers of the FMU.
 */
#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>
#include <stdint.h>

#include "fmi2Functions.h"
#include "fuzz_model.h"

/* ---- random.c: everything that is random comes from one seed ----------------------------------------------------- */

void random_seed(uint64_t seed);
uint64_t random_bits(void);
int below(int count);     /* 0 .. count - 1 */
int chance(int percent);
int careless(void);       /* whether an argument becomes wrong */
extern int carelessness;  /* how often it does [percent] */
double uniform(double low, double high);
double awkward(void);     /* any double, with a taste for zeros, denormals, huge numbers, infinities and NaN */
size_t count_of_elements(void);
const char *awkward_text(void);

/* ---- host.c: what a host gives to the FMU ------------------------------------------------------------------------ */

/* Stops the program with the seed to repeat it by. */
#define FAIL(...) fail(__FILE__, __LINE__, __VA_ARGS__)
#define CHECK(condition, ...) ((condition) ? (void)0 : FAIL(__VA_ARGS__))
_Noreturn void fail(const char *file, int line, const char *format, ...);

typedef struct {
    int errors, discards, warnings;
} Messages;

/* Since the last call of host_listen. */
extern Messages messages;
/* Blocks given out by the counting allocator and not yet returned: for instances and states, and tables, which
 * instances share. */
extern long blocks, tables;
/* The allocator gives nothing while this is set. */
extern int starving;

/* Expect messages for this environment and instance name; NULL: any name. */
void host_listen(const void *environment, const char *name);
/* Callbacks with or without a logger, with counted memory or that of the C library. */
fmi2CallbackFunctions host_callbacks(void *environment, int logging, int counting);
/* A copy of exactly that size on the heap, so that reading beyond it is noticed; NULL for 0 bytes. */
void *exactly(const void *content, size_t size);
void *allocated(size_t size);

/* ---- oracle.c: what the standard and the documentation say ------------------------------------------------------- */

#define CALLS(CALL) \
    CALL(SetDebugLogging) CALL(SetupExperiment) CALL(EnterInitializationMode) CALL(ExitInitializationMode) \
    CALL(Terminate) CALL(Reset) CALL(GetReal) CALL(GetInteger) CALL(GetBoolean) CALL(GetString) CALL(SetReal) \
    CALL(SetInteger) CALL(SetBoolean) CALL(SetString) CALL(GetFMUstate) CALL(SetFMUstate) CALL(FreeFMUstate) \
    CALL(SerializedFMUstateSize) CALL(SerializeFMUstate) CALL(DeSerializeFMUstate) CALL(GetDirectionalDerivative) \
    CALL(EnterEventMode) CALL(NewDiscreteStates) CALL(EnterContinuousTimeMode) CALL(CompletedIntegratorStep) \
    CALL(SetTime) CALL(SetContinuousStates) CALL(GetDerivatives) CALL(GetEventIndicators) CALL(GetContinuousStates) \
    CALL(GetNominalsOfContinuousStates) CALL(SetRealInputDerivatives) CALL(GetRealOutputDerivatives) CALL(DoStep) \
    CALL(CancelStep) CALL(GetStatus) CALL(GetRealStatus) CALL(GetIntegerStatus) CALL(GetBooleanStatus) \
    CALL(GetStringStatus)
#define NUMBERED(name) CALL_##name,
typedef enum { CALLS(NUMBERED) CALL_COUNT } Call;
#undef NUMBERED

typedef enum { INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS_TIME, STEP, TERMINATED, UNKNOWN } Mode;
typedef enum { NO, YES, UNSURE } Answer;

typedef struct {
    const char *name;
    char type;      /* R, I, B or S */
    char causality; /* i(nput), o(utput), l(ocal) or p(arameter); of the form with states omega is a s(tate),
                     * absorbed_energy one that is an O(utput), too, and their derivatives are r(ates) */
    int tunable;
    double start;
} Described;
extern const Described described[MODEL_VARIABLES];
#define READABLE "iolpsOr"
#define SETTABLE "ipsO"
#define OUTPUTS "oO"
#define UNKNOWNS "oOr"

/* What is known of an instance; UNKNOWN after it took a state whose numbers were made up. */
typedef struct {
    fmi2Type type;
    Mode mode;
    double time, stop_time, velocity, acceleration;
    double value[MODEL_VARIABLES]; /* set last: the displacement and the parameters */
    int interpolated;
    int side;        /* of the identified range, where the path ended: -1, 0 or +1 */
    int held;        /* `extrapolating` of continuous-time mode */
    Answer possible; /* whether the parameters are a possible spring, once asked */
    int asked;
    int moved;       /* the displacement follows from input derivatives: known but for rounding */
    double doubt;    /* by how much */
    double committed, committed_doubt; /* where the path ends */
    double rate, rate_doubt;           /* of the displacement at the end of the last step */
} Twin;

int variable(const char *name); /* its value reference */
Twin twin_of(fmi2Type type);
Answer may_call(const Twin *twin, Call call); /* by the state machine */
Answer possible(Twin *twin);

/* Whether the spring has derivatives: not where friction follows no small reversals. */
Answer is_smooth(const Twin *twin);
int side_of(const Twin *twin);
void twin_set(Twin *twin, fmi2ValueReference reference, double value);
/* Whether a step may be done; and what a step that was done changes. */
Answer step_possible(const Twin *twin, double time, double size);
/* Whether outputs have derivatives after the last step, in which the displacement may have jumped. */
Answer rate_possible(const Twin *twin);
void twin_step(Twin *twin, double time, double size);
/* What committing the path to the displacement that holds changes: 1 if it must give a warning. */
int twin_commit(Twin *twin);

/* ---- trial.c: a call, what is predicted, what comes -------------------------------------------------------------- */

typedef struct {
    fmi2Component component; /* NULL while there is no instance */
    char *name;
    Twin twin;
    int logger, errors_logged, warnings_logged;
    long blocks;             /* of memory, held by the instance and its probe */
    long blocks_per_state;   /* that a state of this instance takes; 0 if its memory is not counted */
    fmi2FMUstate probe;      /* memory for looking at its state */
    unsigned char *bytes;    /* its serialized state after the last call */
} Slot;

enum { SLOTS = 4 };
extern Slot slots[SLOTS];

/* A prediction is a set of these; several where it cannot be known. */
enum { MAY_OK = 1 << fmi2OK, MAY_DISCARD = 1 << fmi2Discard, MAY_ERROR = 1 << fmi2Error };

typedef struct {
    Slot *slot;
    Call call;
    fmi2Component component; /* of the slot; at times NULL */
    int may;
    int warnings;            /* that fmi2OK must come with; -1: any number */
    long blocks;             /* of memory that fmi2OK takes */
} Trial;

Trial trial_of(Slot *slot, Call call);
/* Without the condition the call is an error. */
void must(Trial *trial, Answer condition);
/* Without the condition the call is discarded, if nothing else is wrong. */
void or_discard(Trial *trial, Answer condition);
enum { LOOKS, CHANGES }; /* what a call does to the state, at most */
/* Compares what was predicted with what came; whether the call was done. */
int judged(Trial *trial, fmi2Status status, int effect);
/* Serializes the state of an instance. */
void look(Slot *slot);
size_t state_size(void);
/* Memory given out must be that of instances and states, and so much more; and one table for each instance at most. */
void check_blocks(long more);

/* ---- arguments.c ------------------------------------------------------------------------------------------------- */

typedef struct {
    size_t count;
    fmi2ValueReference *at; /* on the heap; NULL at times */
    int sound;              /* all are of the type asked for */
} References;

/* References to variables of a type and of some causalities, or to others if the host is careless. */
References references(char type, const char *causalities);
int all_have(const References *of, const char *causalities);
int any_is(const References *of, const char *name);
/* An array of that size; at times NULL, and always for no elements. */
void *elements(size_t count, size_t size);
double *usual_values(const References *of);
double usual_displacement(void);
/* The largest size of an input or a state that an instance takes. */
double largest_given(fmi2ValueReference reference);
void must_be_given(Trial *trial, const void *array, size_t count);
void must_be_references(Trial *trial, const References *of);

/* ---- bytes.c: serialized states ---------------------------------------------------------------------------------- */

typedef enum { SOUND, BROKEN, CRAFTED } Quality;

typedef struct {
    unsigned char *bytes; /* exactly `size` on the heap */
    size_t size;
    Quality quality;      /* CRAFTED: made-up contents under the right checksum, which only the fields can betray */
} Serialized;

/* From the bytes of a state, and of another one, which may be of another FMU. */
Serialized serialized_from(const unsigned char *bytes, const unsigned char *other, size_t other_size);
/* Crafted from the bytes of a state, with parts of another one of this FMU unless it is NULL. */
Serialized made_up(const unsigned char *bytes, const unsigned char *part);

/* ---- values.c, modes.c, states.c: each call makes arguments, predicts, calls and compares ------------------------ */

void get_real(Trial *trial);
void set_real(Trial *trial);
void get_others(Trial *trial, char type);
void set_others(Trial *trial, char type);
void directional_derivative(Trial *trial);
void input_derivatives(Trial *trial);
void output_derivatives(Trial *trial);

void try_call(Slot *slot, Call call);
void try_states(Trial *trial);
/* The serialized form of a state that the host holds, or NULL. */
const unsigned char *kept_bytes(void);
long blocks_of_states(void);
void release_states(Slot *slot);
void open_other(const char *library, const char *guid);
void close_other(void);

/* ---- detours.c: after which the instance is where it was --------------------------------------------------------- */

/* A copy of the instance made by its serialized state must go on like it, bit for bit. */
void compare_with_a_copy(Slot *slot);
/* Whatever numbers a state holds whose checksum is right, it is refused or does no harm. */
void live_through_a_made_up_state(Slot *slot);

/* ---- life.c ------------------------------------------------------------------------------------------------------ */

int instantiate(Slot *slot); /* whether there is an instance now */
void free_instance(Slot *slot);
Call next_call(const Slot *slot); /* one that leads on, most often */
void move_on(Slot *slot);         /* some steps of the path */

/* ---- watch.c, main.c --------------------------------------------------------------------------------------------- */

typedef struct {
    long done[CALL_COUNT], discarded[CALL_COUNT], refused[CALL_COUNT];
    long sequences, calls, starved, copies;
    long crafted_taken, crafted_refused; /* serialized states with made-up contents and their right checksum */
} Statistics;
extern Statistics statistics;
extern const char *const call_names[CALL_COUNT];
/* In JSON: how often each call was made, and all of the statistics. */
void print_counts(const char *name, int count, const char *const calls[], const long counts[]);
void print_statistics(void);
/* What is being done, printed if it fails; every call if `tracing`. */
extern int tracing;
void trace(const char *format, ...);
/* Runs until there are so many sequences: the first has the seed, the next one the seed after it. */
void do_runs(const char *first_seed, long sequences, void (*run)(long sequences));

#endif
