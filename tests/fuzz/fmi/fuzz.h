/* Random calls of FMI 2.0 and FMI 3.0 against the sources of an FMU, for the sanitizers to watch and an oracle to judge.
 *
 * A sequence is the life of a pair: an instance of FMI 2.0 and one of FMI 3.0 of the same spring, or of the same system
 * of bodies on mounts, which are asked for the same. FMI 2.0 is judged by the oracle (oracle.c), and FMI 3.0 by the
 * oracle and FMI 2.0: status, words, values and serialized states are equal to the bit. Where only one version has a
 * call, or allows it, the other one then takes its state from the bytes of the first. What is refused changes nothing.
 *
 * calls.c holds the table: each call with the modes in which it is legal and the function that draws its arguments,
 * says what is allowed, makes it and checks what came back. What a simulator can know of the FMU comes from
 * fuzz_model.h, which fuzzing.py writes from modelDescription.xml; nothing is taken from the headers of the FMU.
 */
#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>
#include <stdint.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"
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
/* Serialized states: from the bytes of one, with parts of another. */
typedef enum { SOUND, BROKEN, CRAFTED } Quality;
typedef struct {
    unsigned char *bytes; /* exactly `size` on the heap */
    size_t size;
    Quality quality;      /* CRAFTED: made-up contents under the right checksum, which only the fields can betray */
} Serialized;
Serialized serialized_from(const unsigned char *bytes, const unsigned char *other, int crafted);

/* ---- host.c: what a host gives to the FMU, and what is printed --------------------------------------------------- */

/* Stops the program with the seed to repeat it by. */
#define FAIL(...) fail(__FILE__, __LINE__, __VA_ARGS__)
#define CHECK(condition, ...) ((condition) ? (void)0 : FAIL(__VA_ARGS__))
_Noreturn void fail(const char *file, int line, const char *format, ...);
/* What is being done, printed if `tracing`. */
extern int tracing;
void trace(const char *format, ...);
void do_runs(const char *first_seed, long sequences, void (*run)(long sequences));

/* What a version has said since `listen`. */
typedef struct {
    int errors, discards, warnings;
    char text[1024];
} Said;
extern Said said[2]; /* by FMI 2.0 and FMI 3.0 */
void listen(const void *environment, const char *name); /* NULL: any name */
/* Blocks given out and not yet returned: for instances and states; and tables, which instances share. */
extern long blocks, tables;
extern int starving; /* no memory is given while this is set */
fmi2CallbackFunctions callbacks_of(void *environment, int logging, int counting);
void log_three(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text);
void *exactly(const void *content, size_t size); /* a copy on the heap; NULL for 0 bytes */
void *allocated(size_t size);

/* ---- oracle.c: what the standards and the documentation say ------------------------------------------------------ */

typedef enum { INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS_TIME, STEP, TERMINATED, UNKNOWN } Mode;
typedef enum { NO, UNSURE, YES } Answer;
static inline Answer both(Answer one, Answer other)
{
    return one < other ? one : other;
}

typedef struct {
    const char *name;
    char type;      /* R, I, B or S */
    char causality; /* i(nput), o(utput), l(ocal) or p(arameter); of the form with states omega is a s(tate),
                     * absorbed_energy one that is an O(utput), too, and their derivatives are r(ates) */
    int tunable;
    double start;
} Described;
extern const Described described[MODEL_VARIABLES];
#define SETTABLE "ipsO"
#define READABLE SETTABLE "olr"

/* Of systems: for co-simulation alone, without derivatives. The usual form with branches is for that alone, too. */
enum {
    OF_SYSTEM = MODEL_AMPLIFIER == 0,
    HAS_EXCHANGE = !OF_SYSTEM && (MODEL_STATES || MODEL_BRANCHES == 0),
    INDICATORS = !MODEL_STATES && !OF_SYSTEM
};

/* What is known of an instance; UNKNOWN after it took a state whose numbers were made up. */
typedef struct {
    int exchange;
    Mode mode;
    double time, stop_time, velocity, acceleration;
    double value[MODEL_VARIABLES]; /* set last: inputs, states and parameters */
    int interpolated;
    int side;       /* of the identified range, where the path ended: -1, 0 or +1 */
    int held;       /* `extrapolating` of continuous-time mode */
    int moved;      /* inputs follow from their derivatives: known but for rounding */
    double doubt;   /* by how much */
    double committed, committed_doubt; /* where the path ends */
    double rate, rate_doubt;           /* of the displacement at the end of the last step */
} Twin;

unsigned variable(const char *name);
Twin twin_of(int exchange);
Answer allowed(const Twin *twin, const char *modes); /* by the state machine */
Answer possible(const Twin *twin);                   /* whether the parameters are a spring */
Answer may_set(const Twin *twin, size_t count, const unsigned elements[], const double values[]);
Answer is_smooth(const Twin *twin); /* whether the spring has derivatives: friction that ignores small reversals has none */
int side_of(const Twin *twin);
void twin_set(Twin *twin, unsigned element, double value);
Answer step_possible(const Twin *twin, double time, double size);
Answer rate_possible(const Twin *twin); /* of outputs after the last step, in which the displacement may have jumped */
void twin_step(Twin *twin, double time, double size);
int twin_commit(Twin *twin); /* what committing the path to the displacement changes: 1 if it must give a warning */
double usual_displacement(void);
double usual_value(unsigned element);

/* ---- pairs.c: a call of both, what is predicted, what comes ------------------------------------------------------ */

typedef struct {
    fmi2Component two; /* NULL while there is no pair */
    fmi3Instance three;
    char *name;
    Twin twin;
    int logger, errors2, warnings2, warnings3; /* what is logged */
    fmi2FMUstate probe2;                       /* memory for looking at their states */
    fmi3FMUState probe3;
    unsigned char *bytes;                      /* their state after the last call */
} Pair;

enum { PAIRS = 3 };
extern Pair pairs[PAIRS];
extern size_t state_size;

typedef struct Trial Trial;
typedef struct {
    const char *name, *two, *three; /* of the call; NULL where a version has none */
    const char *modes2, *modes3;
    void (*try)(Trial *trial);
} Row;

struct Trial {
    Pair *pair;
    int call;
    fmi2Component two; /* at times NULL */
    fmi3Instance three;
    int has2;          /* whether FMI 2.0 has the call */
    Answer may2, may3; /* whether it is no error */
    Answer kept;       /* whether it is not discarded */
    int words;         /* whether both refuse it in the same ones */
    int warnings;      /* that a call that is done must come with; -1: any number */
    int states;        /* that both allocate if it is done */
    int effect;        /* on the state, at most */
};
enum { CHANGES, LOOKS };
enum { NOT_CALLED = -1, DONE2 = 1, DONE3 = 2 };
#define CALL2(trial, call) ((trial)->has2 ? (int)(call) : NOT_CALLED)

Trial trial_of(Pair *pair, int call);
void must(Trial *trial, Answer condition);
/* Compares the statuses with what was predicted; which of both was done. */
int judged(Trial *trial, int two, int three);
void look(Pair *pair);
/* FMI 3.0 takes the state of FMI 2.0 or the other way. */
void join(Pair *pair, int to_three);
int begin(Pair *pair); /* whether there is a pair now */
void end(Pair *pair);

/* ---- lists.c ----------------------------------------------------------------------------------------------------- */

/* Places of FMI 3.0: arrays are one, the time and the event indicator come last; references are one more. */
enum {
    ARRAYS = (MODEL_ELASTIC > 0) + 2 * (MODEL_KNOTS > 0) + (MODEL_AMPLIFIER > 0),
    PLACES = MODEL_VARIABLES - MODEL_ELASTIC - 2 * MODEL_KNOTS - MODEL_AMPLIFIER + ARRAYS,
    TIME3 = PLACES + 1,
    INDICATOR3 = TIME3 + INDICATORS,
    FIRST_ARRAY3 = 14 /* after parameters that are no coefficients */
};

/* Some variables, at times the same one twice, with arrays among scalars; all on the heap and of exactly this size. */
typedef struct {
    size_t count, size;        /* of variables of FMI 3.0, and of their elements, which are those of FMI 2.0 */
    fmi3ValueReference *three; /* NULL at times */
    unsigned *two;
    double *values2, *values3; /* of the elements of type R; NULL at times */
    int sound;                 /* nothing is NULL, and all are of the type asked for */
} List;

/* Variables of a type and of some causalities, or others if the host is careless. */
List drawn(char type, const char *causalities);
void must_be_sound(Trial *trial, const List *list);
void fill(List *list); /* with usual values */
void free_list(List *list);
int all_have(const List *list, const char *causalities);
int holds(const List *list, const char *name);
void *elements(size_t count, size_t size); /* at times NULL, and always for no elements */
fmi3ValueReference reference3(const char *name);
void check_equal(const double *three, const double *two, size_t count, const char *of);

/* ---- states.c ---------------------------------------------------------------------------------------------------- */

void get_state(Trial *trial);
void set_state(Trial *trial);
void free_state(Trial *trial);
void size_of_state(Trial *trial);
void serialize(Trial *trial);
void deserialize(Trial *trial);
void forget_states(Pair *pair);
/* Whatever numbers a state holds whose checksum is right, it is refused or does no harm; then the pair goes back. */
void live_through_a_made_up_state(Pair *pair);

/* ---- calls.c, hostile.c ------------------------------------------------------------------------------------------ */

/* Calls by their names in FMI 2.0 and FMI 3.0, and where each is legal (oracle.c: `allowed`), by the standards: sections
 * 3.2.3 and 4.2.4 of FMI 2.0; 2.3, 3.2 and 4.2 of FMI 3.0. Beyond them, Terminate does nothing where nothing is to end,
 * and FMI 3.0 answers some calls as FMI 2.0 does. Last the function that tries it. */
#define CALLS(BOTH, TWO, THREE) \
    BOTH(SetDebugLogging, SetDebugLogging, "xxxxx xxxx", "xxxxx xxxx", set_debug_logging) \
    TWO(SetupExperiment, "x---- x---", setup_experiment) \
    BOTH(EnterInitializationMode, EnterInitializationMode, "x---- x---", "x---- x---", enter_initialization) \
    BOTH(ExitInitializationMode, ExitInitializationMode, "-x--- -x--", "-x--- -x--", exit_initialization) \
    BOTH(Terminate, Terminate, "xxxxx xxxx", "xxxxx xxxx", terminate) \
    BOTH(Reset, Reset, "xxxxx xxxx", "xxxxx xxxx", reset) \
    BOTH(GetReal, GetFloat64, "-xxxx -xxx", "xxxxx xxxx", get_real) \
    BOTH(SetReal, SetFloat64, "xxxx- xxx-", "xxxx- xxx-", set_real) \
    BOTH(GetBoolean, GetBoolean, "-xxxx -xxx", "xxxxx xxxx", get_boolean) \
    BOTH(SetBoolean, SetBoolean, "xxx-- xxx-", "xxx-- xxx-", set_boolean) \
    TWO(GetInteger, "-xxxx -xxx", other_types) \
    TWO(GetString, "-xxxx -xxx", other_types) \
    TWO(SetInteger, "xxx-- xxx-", other_types) \
    TWO(SetString, "xxx-- xxx-", other_types) \
    BOTH(GetFMUstate, GetFMUState, "xxxxx xxxx", "xxxxx xxxx", get_state) \
    BOTH(SetFMUstate, SetFMUState, "xxxxx xxxx", "xxxxx xxxx", set_state) \
    BOTH(FreeFMUstate, FreeFMUState, "xxxxx xxxx", "xxxxx xxxx", free_state) \
    BOTH(SerializedFMUstateSize, SerializedFMUStateSize, "xxxxx xxxx", "xxxxx xxxx", size_of_state) \
    BOTH(SerializeFMUstate, SerializeFMUState, "xxxxx xxxx", "xxxxx xxxx", serialize) \
    BOTH(DeSerializeFMUstate, DeserializeFMUState, "xxxxx xxxx", "xxxxx xxxx", deserialize) \
    BOTH(GetDirectionalDerivative, GetDirectionalDerivative, "-xxxx -xxx", "-xxxx -xxx", directional_derivative) \
    BOTH(EnterEventMode, EnterEventMode, "--xx- ----", "--xx- ----", enter_event) \
    THREE(EvaluateDiscreteStates, "--x-- ----", evaluate_discrete_states) \
    BOTH(NewDiscreteStates, UpdateDiscreteStates, "--x-- ----", "--x-- ----", new_discrete_states) \
    BOTH(EnterContinuousTimeMode, EnterContinuousTimeMode, "--x-- ----", "--x-- ----", enter_continuous_time) \
    BOTH(CompletedIntegratorStep, CompletedIntegratorStep, "---x- ----", "---x- ----", completed_integrator_step) \
    BOTH(SetTime, SetTime, "--xx- ----", "--xx- ----", set_time) \
    BOTH(SetContinuousStates, SetContinuousStates, "---x- ----", "---x- ----", continuous) \
    BOTH(GetContinuousStates, GetContinuousStates, "-xxxx ----", "-xxxx ----", continuous) \
    BOTH(GetDerivatives, GetContinuousStateDerivatives, "-?xxx ----", "-xxxx ----", continuous) \
    BOTH(GetEventIndicators, GetEventIndicators, "-xxxx ----", "-xxxx ----", continuous) \
    BOTH(GetNominalsOfContinuousStates, GetNominalsOfContinuousStates, "x-xxx ----", "-xxxx ----", continuous) \
    THREE(GetNumberOfContinuousStates, "xxxxx ----", get_number) \
    THREE(GetNumberOfEventIndicators, "xxxxx ----", get_number) \
    THREE(GetFloat64, "xxxxx xxxx", own_variables) \
    TWO(SetRealInputDerivatives, "----- xxx-", input_derivatives) \
    BOTH(GetRealOutputDerivatives, GetOutputDerivatives, "----- --xx", "----- --xx", output_derivatives) \
    BOTH(DoStep, DoStep, "----- --x-", "----- --x-", do_step) \
    TWO(CancelStep, "----- ----", cancel_step) \
    TWO(GetStatus, "----- --xx", status_of_step) \
    TWO(GetRealStatus, "----- --xx", status_of_step) \
    TWO(GetIntegerStatus, "----- --xx", status_of_step) \
    TWO(GetBooleanStatus, "----- --xx", status_of_step) \
    TWO(GetStringStatus, "----- --xx", status_of_step)
#define NUMBERED(name, ...) CALL_##name,
enum { CALLS(NUMBERED, NUMBERED, NUMBERED) CALL_COUNT };
#undef NUMBERED

extern const Row rows[CALL_COUNT];
int next_call(const Pair *pair); /* one that leads on, most often */
void try_call(Pair *pair, int call);
void move_on(Pair *pair);        /* some steps of the path */
void be_hostile(Pair *pair);     /* calls of FMI 3.0 that must be refused in every mode */

typedef struct {
    long done[CALL_COUNT], discarded[CALL_COUNT], refused[CALL_COUNT];
    long sequences, calls, starved, joined, hostile, compared, transposed, crafted_taken, crafted_refused;
} Statistics;
extern Statistics statistics;

#endif
