/* Random calls of FMI 2.0 and FMI 3.0 against the sources of an FMU, for the sanitizers to watch.
 *
 * A sequence is the life of a pair: an instance of FMI 2.0 and one of FMI 3.0 of the same spring, or of the same system
 * of bodies on mounts, which are asked for the same. What is judged: the status by the table of calls and modes (calls.c)
 * and by what makes arguments wrong; that both answer alike, statuses, values and serialized states to the bit; that
 * what is refused changes nothing; that a stretch of calls repeated from the same state gives the same bits (states.c);
 * and that memory comes back. Where only one version has a call, the other one takes its state from the bytes.
 *
 * What a simulator can know of the FMU comes from fuzz_model.h, which program.py writes from modelDescription.xml;
 * nothing is taken from the headers of the FMU.
 */
#ifndef FUZZ_H
#define FUZZ_H

#include <stddef.h>
#include <stdint.h>

#include "fmi2Functions.h"
#include "fmi3Functions.h"
#include "fuzz_model.h"

/* ---- host.c: what is random, what a host gives to the FMU, and what is printed ----------------------------------- */

void random_seed(uint64_t seed); /* everything that is random comes from it */
uint64_t random_bits(void);
int below(int count); /* 0 .. count - 1 */
int chance(int percent);
extern int carelessness; /* how often an argument becomes wrong [percent] */
int careless(void);
double uniform(double low, double high);
double awkward(void); /* any double, with a taste for zeros, denormals, huge numbers, infinities and NaN */
const char *awkward_text(void);

/* Stops the program; the seed to repeat it by was printed before. */
#define CHECK(condition, ...) ((condition) ? (void)0 : fail(__FILE__, __LINE__, __VA_ARGS__))
_Noreturn void fail(const char *file, int line, const char *format, ...);
void trace(const char *format, ...);

/* What a version has said since `listen`. */
typedef struct {
    int errors, warnings;
} Said;
extern Said said[2];                                    /* by FMI 2.0 and FMI 3.0 */
void listen(const void *environment, const char *name); /* NULL: any name */
extern long blocks;                                     /* given out and not yet returned, but for tables */
extern long tables;                                     /* which instances share */
extern int starving;                                    /* no memory is given while this is set */
fmi2CallbackFunctions callbacks_of(void *environment, int logging, int counting);
void log_three(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String text);
void *allocated(size_t size);
void *exactly(const void *content, size_t size);    /* a copy on the heap; NULL for 0 bytes */
/* Until the end of a call: so many bytes; so many elements, or NULL for none, and at times if the host is careless. */
void *lent(size_t size);
void *elements(size_t count, size_t size);
extern int loans;
void take_back(int before);

/* ---- pair.c: what is known of an instance, a call of both, and its judgement ------------------------------------- */

typedef enum { INSTANTIATED, INITIALIZATION, EVENT, CONTINUOUS_TIME, STEP, TERMINATED, UNKNOWN } Mode;
typedef enum { NO, UNSURE, YES } Answer;

/* Causalities: i(nput), o(utput), l(ocal) or p(arameter); of the form with states omega is a s(tate), absorbed_energy one
 * that is an O(utput), too, and their derivatives are r(ates). */
typedef struct {
    const char *name;
    char type, causality;
    int tunable;
    double start;
} Described;
extern const Described described[MODEL_VARIABLES];
#define SETTABLE "ipsO"
#define READABLE SETTABLE "olr"

enum {
    OF_SYSTEM = MODEL_AMPLIFIER == 0, /* for co-simulation alone, as is the usual form with branches */
    HAS_EXCHANGE = !OF_SYSTEM && (MODEL_STATES || MODEL_BRANCHES == 0),
    INDICATORS = !MODEL_STATES && !OF_SYSTEM,
    /* References of FMI 3.0: arrays are one each; the time and the event indicator come last. */
    ARRAYS = (MODEL_ELASTIC > 0) + 2 * (MODEL_KNOTS > 0) + (MODEL_AMPLIFIER > 0),
    PLACES = MODEL_VARIABLES - MODEL_ELASTIC - 2 * MODEL_KNOTS - MODEL_AMPLIFIER + ARRAYS,
    TIME3 = PLACES + 1,
    INDICATOR3 = TIME3 + INDICATORS,
    FIRST_ARRAY3 = 14 /* after parameters that are no coefficients */
};

typedef struct {
    int exchange;
    Mode mode; /* UNKNOWN after a state whose numbers were made up */
    double time, stop_time;
    double value[MODEL_VARIABLES]; /* set last */
    int moved;                     /* inputs follow from their derivatives, so that their values are not known */
    int interpolated;              /* or will, in the next step */
    Answer sound;                  /* whether the parameters are a spring */
} Twin;

typedef struct {
    fmi2Component two; /* NULL while there is no pair */
    fmi3Instance three;
    char *name;
    Twin twin;
    int logger;          /* whether it hears messages */
    fmi2FMUstate probe2; /* memory for looking at their states */
    fmi3FMUState probe3;
    unsigned char *bytes; /* their state after the last call */
} Pair;

enum { PAIRS = 3 };
extern Pair pairs[PAIRS];
extern size_t state_size;
extern uint64_t heard; /* a hash of all that came back */

typedef struct {
    Pair *pair;
    fmi2Component two; /* at times NULL */
    fmi3Instance three;
    Answer may2, may3, kept;  /* whether it is no error, and not discarded */
    int call, states, looks;  /* states that both allocate if it is done; whether it changes nothing */
} Trial;
enum { NOT_CALLED = -1, DONE2 = 1, DONE3 = 2 };

int begin(Pair *pair); /* whether there is a pair now */
void end(Pair *pair);
Twin twin_of(int exchange);
Trial trial_of(Pair *pair, int call);
void must(Trial *trial, Answer condition);
/* Compares the statuses with what the table says and the versions with each other; which of both was done. */
int judged(Trial *trial, int two, int three);
void look(Pair *pair);
void check_equal(const double *three, const double *two, size_t count, const char *of);

/* Some variables, at times the same one twice, with arrays among scalars; all on the heap and of exactly this size. */
typedef struct {
    size_t count, size;        /* of variables of FMI 3.0, and of their elements, which are those of FMI 2.0 */
    fmi3ValueReference *three; /* NULL at times */
    unsigned *two;
    double *values2, *values3; /* NULL at times */
    int sound;                 /* nothing is NULL, and all are of the type asked for */
} List;
/* Variables of a type and of some causalities, or others if the host is careless, with values to set. */
List drawn(char type, const char *causalities);
int all_have(const List *list, const char *causalities);
int holds(const List *list, const char *name);
double usual_value(unsigned element);
Answer may_set(Twin *twin, const List *list); /* and sets it in the twin */

/* ---- calls.c ----------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *two, *three; /* names of the call; NULL where a version has none */
    const char *modes2, *modes3;
    void (*try)(Trial *trial);
} Row;
extern const Row rows[];
extern const int call_count;
extern long counts[][3]; /* of each call: done, discarded, refused */
void try_call(Pair *pair, int call);
void try_any(Pair *pair, int only_values); /* one that leads on, most often */

/* ---- states.c, hostile.c ----------------------------------------------------------------------------------------- */

void get_state(Trial *trial), set_state(Trial *trial), free_state(Trial *trial);
void serialize(Trial *trial), deserialize(Trial *trial);
void forget_states(Pair *pair);
void repeat(Pair *pair);                       /* a stretch of calls, twice from one state */
void be_hostile(Pair *pair);                   /* calls of FMI 3.0 that must be refused in every mode */
extern long made_up[2], repeated, hostile;     /* how often; states of made-up numbers, taken and refused */

#endif
