/* Random lives of pairs: an instance of FMI 3.0 beside one of FMI 2.0 of the same spring, or of the same system of
 * bodies on mounts, which does the same.
 *
 * After every call the serialized states of both, and all that they return, are equal to the bit; what is refused by
 * one is refused by both in the same words, but where the versions differ. In between come calls to FMI 3.0 alone that
 * must be refused: an error, one message, and no byte of the state changed. Which call is legal in which mode is said
 * in legal.c after the standard, not after the headers of the FMU.
 */
#ifndef PAIRS_H
#define PAIRS_H

#include "../fuzz.h"

#include "fmi3Functions.h"

/* ---- legal.c ----------------------------------------------------------------------------------------------------- */

/* In the order of the modes: model exchange instantiated, in initialization, event and continuous-time mode,
 * terminated; co-simulation instantiated, in initialization mode, in step mode, terminated. x: the standard allows the
 * call (sections 2.3, 3.2 and 4.2 of FMI 3.0.2); o: it does not list it there, but this FMU answers as in FMI 2.0;
 * -: refused. */
#define FMI3_CALLS(CALL) \
    CALL(EnterInitializationMode, "x---- x---") \
    CALL(ExitInitializationMode, "-x--- -x--") \
    CALL(Terminate, "ooxxo ooxo") \
    CALL(Reset, "xxxxx xxxx") \
    CALL(SetDebugLogging, "xxxxx xxxx") \
    CALL(GetFloat64, "xxxxx xxxx") \
    CALL(GetBoolean, "xxxxx xxxx") \
    CALL(SetFloat64, "xxxx- xxx-") \
    CALL(SetBoolean, "xxx-- xxx-") \
    CALL(GetFMUState, "xxxxx xxxx") \
    CALL(SetFMUState, "xxxxx xxxx") \
    CALL(FreeFMUState, "xxxxx xxxx") \
    CALL(SerializeFMUState, "xxxxx xxxx") \
    CALL(DeserializeFMUState, "xxxxx xxxx") \
    CALL(GetDirectionalDerivative, "-xxxx -xxx") \
    CALL(GetAdjointDerivative, "-xxxx -xxx") \
    CALL(EnterEventMode, "--ox- ----") \
    CALL(EvaluateDiscreteStates, "--x-- ----") \
    CALL(UpdateDiscreteStates, "--x-- ----") \
    CALL(EnterContinuousTimeMode, "--x-- ----") \
    CALL(CompletedIntegratorStep, "---x- ----") \
    CALL(SetTime, "--ox- ----") \
    CALL(SetContinuousStates, "---x- ----") \
    CALL(GetContinuousStates, "-xxxx ----") \
    CALL(GetContinuousStateDerivatives, "-xxxx ----") \
    CALL(GetNominalsOfContinuousStates, "-xxxx ----") \
    CALL(GetEventIndicators, "-xxxx ----") \
    CALL(GetNumberOfContinuousStates, "xoxoo ----") \
    CALL(GetNumberOfEventIndicators, "xoxoo ----") \
    CALL(GetOutputDerivatives, "----- --xx") \
    CALL(DoStep, "----- --x-")
#define NUMBERED3(name, modes) CALL3_##name,
typedef enum { FMI3_CALLS(NUMBERED3) CALL3_COUNT } Call3;
#undef NUMBERED3
extern const char *const call3_names[CALL3_COUNT];

typedef struct {
    fmi2Component two; /* NULL while there are no instances */
    fmi3Instance three;
    int exchange, logger, warns; /* whether for model exchange; whether FMI 3.0 has a logger, and tells warnings */
    Mode mode;
    double time;
    fmi2FMUstate probe2;
    fmi3FMUState probe3;
    unsigned char *bytes; /* the state after the last call */
} Pair;

enum { PAIRS = 3 };
extern Pair pairs[PAIRS];

int is_legal(const Pair *pair, Call3 call);

/* ---- variables by their places in FMI 3.0: arrays are one; the time and the event indicator come last --------- */

enum {
    OF_SYSTEM = MODEL_AMPLIFIER == 0, /* of bodies on mounts: for co-simulation alone, without derivatives */
    INDICATORS = !MODEL_STATES && !OF_SYSTEM,
    ARRAYS = (MODEL_ELASTIC > 0) + 2 * (MODEL_KNOTS > 0) + (MODEL_AMPLIFIER > 0),
    REFERENCES = MODEL_VARIABLES - MODEL_ELASTIC - 2 * MODEL_KNOTS - MODEL_AMPLIFIER + ARRAYS + 1 + INDICATORS,
    TIME = MODEL_VARIABLES, /* elements: references of FMI 2.0, then these */
    INDICATOR,
    ABSORBED_ENERGY = 3,
    EXTRAPOLATING = OF_SYSTEM ? 0 : 4,
    /* In FMI 3.0 references count from 1, and a place is one less. Of a system its first input and outputs stand for
     * those of a spring. */
    DISPLACEMENT3 = OF_SYSTEM ? 2 : 1,
    FORCE3 = OF_SYSTEM ? 2 + MODEL_INPUTS : 2,
    STIFFNESS3,
    ENERGY3,
    EXTRAPOLATING3 = EXTRAPOLATING + 1,
    FIRST_ARRAY3 = 14, /* after parameters that are no coefficients */
};

#ifndef MODEL_LARGEST_STEP
#define MODEL_LARGEST_STEP 0.0 /* of systems [s] */
#endif

/* Some variables, at times the same one twice, with arrays among scalars, and their elements; all on the heap and of
 * exactly this size. */
typedef struct {
    size_t count, size;
    fmi3ValueReference *references;
    unsigned *elements;
    double *values;
} List;

/* i(nputs), o(utputs), l(ocals), p(arameters) and so on as in fuzz.h, t(ime), e(vent indicator). */
char kind_of(unsigned element);
List some_variables(const char *kinds);
void fill_usually(List *list);
void free_list(List *list);
int holds(const List *list, unsigned element);

/* ---- judge.c ----------------------------------------------------------------------------------------------------- */

/* Expect messages for this pair. */
void listen(Pair *pair);
/* Judges a call of both: the status of FMI 3.0 and the one expected, that of FMI 2.0 where it can do the same;
 * `same_words`: the messages, too. Whether it was done. */
int settled(Pair *pair, Call3 call, int status, int expected, int same_words);
/* A call to FMI 3.0 alone that must be refused. */
void refused(Pair *pair, const char *call, fmi3Status status);
/* The next one refused for another reason than its mode must give this name. */
void must_name(const char *name);
void look_at(Pair *pair);
void check_equal(const double *three, const double *two, size_t count, const char *of);
int begin_pair(Pair *pair); /* whether there is a pair now */
void end_pair(Pair *pair);

typedef struct {
    long done[CALL3_COUNT], refused[CALL3_COUNT], hostile, compared, damaged, discarded, transposed;
} Statistics3;
extern Statistics3 statistics3;

/* ---- alike.c, states3.c, hostile.c ------------------------------------------------------------------------------- */

void call_both(Pair *pair, Call3 call);
void move_pair(Pair *pair); /* some steps of the path */
void call_states(Pair *pair, Call3 call);
fmi3FMUState state_of_other_type(const Pair *pair); /* or NULL */
void forget_states(Pair *pair);
void be_hostile(Pair *pair);

#endif
