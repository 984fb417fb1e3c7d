/* What a host may expect by FMI 2.0 (the state machines of sections 3.2.3 and 4.2.4) and the FMU's documentation. */
#include "fuzz.h"

#include <math.h>
#include <string.h>

/* Columns: model exchange instantiated, in initialization, event and continuous-time mode, terminated; co-simulation
 * instantiated, in initialization mode, between steps, terminated. States that no instance reaches are left out. Where
 * there is a question mark, tables in use differ. */
static const char *const TABLE[CALL_COUNT] = {
    [CALL_SetDebugLogging] = "xxxxx xxxx",
    [CALL_SetupExperiment] = "x---- x---",
    [CALL_EnterInitializationMode] = "x---- x---",
    [CALL_ExitInitializationMode] = "-x--- -x--",
    [CALL_Terminate] = "xxxxx xxxx", /* beyond the standard: where nothing is to end, nothing is done */
    [CALL_Reset] = "xxxxx xxxx",
    [CALL_GetReal] = "-xxxx -xxx",
    [CALL_GetInteger] = "-xxxx -xxx",
    [CALL_GetBoolean] = "-xxxx -xxx",
    [CALL_GetString] = "-xxxx -xxx",
    [CALL_SetReal] = "xxxx- xxx-",
    [CALL_SetInteger] = "xxx-- xxx-",
    [CALL_SetBoolean] = "xxx-- xxx-",
    [CALL_SetString] = "xxx-- xxx-",
    [CALL_GetFMUstate] = "xxxxx xxxx",
    [CALL_SetFMUstate] = "xxxxx xxxx",
    [CALL_FreeFMUstate] = "xxxxx xxxx",
    [CALL_SerializedFMUstateSize] = "xxxxx xxxx",
    [CALL_SerializeFMUstate] = "xxxxx xxxx",
    [CALL_DeSerializeFMUstate] = "xxxxx xxxx",
    [CALL_GetDirectionalDerivative] = "-xxxx -xxx",
    [CALL_EnterEventMode] = "--xx- ----",
    [CALL_NewDiscreteStates] = "--x-- ----",
    [CALL_EnterContinuousTimeMode] = "--x-- ----",
    [CALL_CompletedIntegratorStep] = "---x- ----",
    [CALL_SetTime] = "--xx- ----",
    [CALL_SetContinuousStates] = "---x- ----",
    [CALL_GetDerivatives] = "-?xxx ----",
    [CALL_GetEventIndicators] = "-xxxx ----",
    [CALL_GetContinuousStates] = "-xxxx ----",
    [CALL_GetNominalsOfContinuousStates] = "x-xxx ----",
    [CALL_SetRealInputDerivatives] = "----- xxx-",
    [CALL_GetRealOutputDerivatives] = "----- --xx",
    [CALL_DoStep] = "----- --x-",
    [CALL_CancelStep] = "----- ----",
    [CALL_GetStatus] = "----- --xx",
    [CALL_GetRealStatus] = "----- --xx",
    [CALL_GetIntegerStatus] = "----- --xx",
    [CALL_GetBooleanStatus] = "----- --xx",
    [CALL_GetStringStatus] = "----- --xx",
};

#define DESCRIBED(name, type, causality, tunable, start) {name, type, causality, tunable, start},
const Described described[MODEL_VARIABLES] = {MODEL_TABLE(DESCRIBED)};

int variable(const char *name)
{
    for (int i = 0; i < MODEL_VARIABLES; i++)
        if (strcmp(described[i].name, name) == 0)
            return i;
    FAIL("there is no variable %s", name);
}

Answer may_call(const Twin *twin, Call call)
{
    static const int exchange[] = {
        [INSTANTIATED] = 0, [INITIALIZATION] = 1, [EVENT] = 2, [CONTINUOUS_TIME] = 3, [TERMINATED] = 4};
    static const int simulation[] = {[INSTANTIATED] = 6, [INITIALIZATION] = 7, [STEP] = 8, [TERMINATED] = 9};
    const int *columns = twin->type == fmi2ModelExchange ? exchange : simulation;
    if (twin->mode == UNKNOWN)
        return UNSURE;
    switch (TABLE[call][columns[twin->mode]]) {
    case 'x': return YES;
    case '-': return NO;
    default: return UNSURE;
    }
}

Twin twin_of(fmi2Type type)
{
    Twin twin = {.type = type, .mode = INSTANTIATED, .stop_time = INFINITY};
    for (int i = 0; i < MODEL_VARIABLES; i++)
        twin.value[i] = described[i].start;
    return twin;
}

/* ---- parameters -------------------------------------------------------------------------------------------------- */

static double named(const Twin *twin, const char *name)
{
    return twin->value[variable(name)];
}

/* Whether FA = sum(kA[i]*x^i) is positive from low to high; sampled, and sure where its slope cannot hide a zero. */
static Answer amplifier_positive(const Twin *twin, double low, double high)
{
    enum { SAMPLES = 400 };
    const double *kA = &twin->value[variable("kA_0")];
    double reach = fmax(fabs(low), fabs(high)), slope = 0.0, size = 0.0, least = INFINITY;
    for (int i = 0; i < MODEL_AMPLIFIER; i++) {
        slope += i * fabs(kA[i]) * pow(reach, i - 1.0);
        size += fabs(kA[i]) * pow(reach, i);
    }
    for (int k = 0; k <= SAMPLES; k++) {
        double x = low + (high - low) * k / SAMPLES, value = 0.0;
        for (int i = MODEL_AMPLIFIER - 1; i >= 0; i--)
            value = value * x + kA[i];
        if (!isfinite(value))
            return UNSURE;
        least = fmin(least, value);
    }
    double doubt = 0.5 * slope * (high - low) / SAMPLES + 1e-12 * size;
    if (!isfinite(doubt))
        return UNSURE;
    return least > doubt + 1e-9 ? YES : least < -1e-12 * size ? NO : UNSURE;
}

/* Whether the knots of FE rise from one end of the range to the other; unsure of their least distance, a thousandth. */
static Answer knots_rise(const Twin *twin, double low, double high)
{
    if (MODEL_KNOTS == 0)
        return YES;
    const double *knots = &twin->value[variable("FE_knots_0")];
    double least = INFINITY;
    for (int i = 1; i < MODEL_KNOTS; i++)
        least = fmin(least, (knots[i] - knots[i - 1]) / (high - low));
    if (knots[0] != low || knots[MODEL_KNOTS - 1] != high || least < 0.999e-3)
        return NO;
    return least > 1.001e-3 ? YES : UNSURE;
}

/* Whether a size is within limits, but for rounding. */
static Answer within(double low, double value, double high)
{
    static const double ROUNDING = 1e-9;
    if (value >= low * (1.0 + ROUNDING) && value <= high * (1.0 - ROUNDING))
        return YES;
    return value < low * (1.0 - ROUNDING) || value > high * (1.0 + ROUNDING) ? NO : UNSURE;
}

static Answer both(Answer first, Answer second)
{
    return first == NO || second == NO ? NO : first == YES && second == YES ? YES : UNSURE;
}

/* Whether terms of FE or FA, or the forces of a table, are as large over the range as they may be. */
static Answer terms_possible(const Twin *twin, const char *first, int count, double reach, double largest)
{
    Answer answer = YES;
    double power = 1.0;
    for (int i = 0; i < count; i++, power *= reach)
        answer = both(answer, within(-1.0, fabs(twin->value[variable(first) + i]) * power, largest));
    return answer;
}

/* Whether all is of a size that a spring can have. */
static Answer size_possible(const Twin *twin, double low, double high, double offset)
{
    double width = high - low, reach = fmax(high - offset, offset - low), kappa = named(twin, "kappa_omega");
    if (fabs(low) > 1e9 || fabs(high) > 1e9 || fabs(offset) > 1e9 || width < 1e-12 || width > 1e6 || kappa < 1e-15 ||
        kappa > 1e15)
        return NO;
    Answer answer = within(1e-9, named(twin, "rho") * width, 1e12);
    answer = both(answer, terms_possible(twin, "kA_0", MODEL_AMPLIFIER, reach, 1e9));
    if (MODEL_KNOTS)
        return both(answer, terms_possible(twin, "FE_forces_0", MODEL_KNOTS, 1.0, 1e15));
    return both(answer, terms_possible(twin, "kE_0", MODEL_ELASTIC, reach, 1e15));
}

static Answer asked(const Twin *twin)
{
    for (int i = 0; i < MODEL_VARIABLES; i++)
        if (described[i].causality == 'p' && !isfinite(twin->value[i]))
            return NO;
    double low = named(twin, "displacement_min"), high = named(twin, "displacement_max");
    double offset = named(twin, "displacement_offset"), sigma = named(twin, "sigma"), n = named(twin, "n");
    if (!MODEL_STATES && !(0.0 <= named(twin, "input_resolution") && named(twin, "input_resolution") <= 1e9))
        return NO;
    if ((!MODEL_STATES && fabs(named(twin, "omega_start")) > 1.0) || named(twin, "kA_0") != 1.0 ||
        named(twin, "kappa_omega") <= 0.0 || named(twin, "rho") <= 0.0 || sigma < 0.5 || sigma > 1000.0 || n < 0.01 ||
        n > 100.0)
        return NO;
    if (low >= high || offset < low || offset > high)
        return NO;
    Answer answer = both(size_possible(twin, low, high, offset), knots_rise(twin, low, high));
    return answer == NO ? NO : both(answer, amplifier_positive(twin, low - offset, high - offset));
}

Answer possible(Twin *twin)
{
    if (twin->mode == UNKNOWN)
        return UNSURE;
    if (!twin->asked)
        twin->possible = asked(twin);
    twin->asked = 1;
    return twin->possible;
}

Answer is_smooth(const Twin *twin)
{
    if (MODEL_STATES || twin->mode == INITIALIZATION)
        return YES;
    return twin->mode == UNKNOWN ? UNSURE : named(twin, "input_resolution") > 0.0 ? NO : YES;
}

/* ---- the path ---------------------------------------------------------------------------------------------------- */

int side_of(const Twin *twin)
{
    double displacement = named(twin, "displacement");
    return (displacement > named(twin, "displacement_max")) - (displacement < named(twin, "displacement_min"));
}

void twin_set(Twin *twin, fmi2ValueReference reference, double value)
{
    twin->value[reference] = value;
    if (described[reference].causality == 'p') {
        twin->asked = 0;
    } else if (strcmp(described[reference].name, "displacement") == 0) {
        twin->moved = 0;
        twin->doubt = 0.0;
    }
}

int twin_commit(Twin *twin)
{
    int before = twin->side;
    twin->side = side_of(twin);
    twin->committed = named(twin, "displacement");
    twin->committed_doubt = twin->doubt;
    return twin->side != 0 && twin->side != before;
}

static double end_of_step(const Twin *twin, double size)
{
    return named(twin, "displacement") + size * (twin->velocity + 0.5 * size * twin->acceleration);
}

/* Whether a path through a step stays where displacements may be, and no faster than they may; unsure where rounding
 * has a say. */
static Answer path_possible(const Twin *twin, double size)
{
    long double x = named(twin, "displacement"), v = twin->velocity, a = twin->acceleration, turn = -v / a;
    long double end = fabsl(x + size * (v + 0.5L * a * size));
    long double tip = 0.0L < turn && turn < size ? fabsl(x + 0.5L * v * turn) : 0.0L;
    long double farthest = fmaxl(fmaxl(end, tip), fabsl(v + a * size));
    return farthest < 0.999e9L ? YES : farthest > 1.001e9L ? NO : UNSURE;
}

Answer step_possible(const Twin *twin, double time, double size)
{
    double end = time + size, reach = fmax(fabs(end), fabs(twin->stop_time));
    if (!isfinite(time) || !isfinite(size) || size < 0.0 || !isfinite(end))
        return NO;
    if (isfinite(twin->stop_time) && end > twin->stop_time + 1e-6 * reach)
        return NO;
    if (twin->interpolated && path_possible(twin, size) != YES)
        return path_possible(twin, size);
    return end > twin->stop_time ? UNSURE : YES; /* times that a host adds up are never exact */
}

Answer rate_possible(const Twin *twin)
{
    double rate = fabs(twin->rate), doubt = twin->rate_doubt + 1e-3 * rate;
    return rate + doubt <= 1e9 ? YES : rate - doubt > 1e9 ? NO : UNSURE;
}

void twin_step(Twin *twin, double time, double size)
{
    static const double ROUNDING = 1e-9;
    double x = named(twin, "displacement"), v = twin->velocity, a = twin->acceleration;
    twin->time = time + size;
    if (twin->interpolated) {
        twin->rate = v + a * size;
        twin->rate_doubt = ROUNDING * (fabs(v) + fabs(a) * size);
        twin->value[variable("displacement")] = end_of_step(twin, size);
        twin->doubt += ROUNDING * (1.0 + fabs(x) + size * (fabs(v) + fabs(a) * size));
        twin->moved = 1;
    } else if (size > 0.0) {
        twin->rate = (x - twin->committed) / size;
        twin->rate_doubt = (twin->doubt + twin->committed_doubt) / size;
    }
    twin->interpolated = 0;
    twin->velocity = twin->acceleration = 0.0;
}
