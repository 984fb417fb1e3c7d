/* What a host may expect by the state machines of FMI and the FMU's documentation. */
#include "fuzz.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DESCRIBED(name, type, causality, tunable, start) {name, type, causality, tunable, start},
const Described described[MODEL_VARIABLES] = {MODEL_TABLE(DESCRIBED)};

unsigned variable(const char *name)
{
    for (unsigned i = 0; i < MODEL_VARIABLES; i++)
        if (strcmp(described[i].name, name) == 0)
            return i;
    FAIL("there is no variable %s", name);
}

/* Columns: model exchange instantiated, in initialization, event and continuous-time mode, terminated; co-simulation
 * instantiated, in initialization mode, between steps, terminated. States that no instance reaches are left out. Where
 * there is a question mark, tables in use differ. */
Answer allowed(const Twin *twin, const char *modes)
{
    static const int exchange[] = {
        [INSTANTIATED] = 0, [INITIALIZATION] = 1, [EVENT] = 2, [CONTINUOUS_TIME] = 3, [TERMINATED] = 4};
    static const int simulation[] = {[INSTANTIATED] = 6, [INITIALIZATION] = 7, [STEP] = 8, [TERMINATED] = 9};
    if (twin->mode == UNKNOWN)
        return UNSURE;
    char mark = modes[(twin->exchange ? exchange : simulation)[twin->mode]];
    return mark == '-' ? NO : mark == '?' ? UNSURE : YES;
}

Twin twin_of(int exchange)
{
    Twin twin = {.exchange = exchange, .mode = INSTANTIATED, .stop_time = INFINITY};
    for (int i = 0; i < MODEL_VARIABLES; i++)
        twin.value[i] = described[i].start;
    return twin;
}

/* ---- parameters of a spring -------------------------------------------------------------------------------------- */

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
        least = isfinite(value) ? fmin(least, value) : -INFINITY;
    }
    double doubt = 0.5 * slope * (high - low) / SAMPLES + 1e-12 * size;
    if (!isfinite(doubt) || !isfinite(least))
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

/* Whether terms of FE or FA, or the forces of a table, are as large over the range as they may be. */
static Answer terms_possible(const Twin *twin, const char *first, int count, double reach, double largest)
{
    Answer answer = YES;
    double power = 1.0;
    for (int i = 0; i < count; i++, power *= reach)
        answer = both(answer, within(-1.0, fabs(twin->value[variable(first) + (unsigned)i]) * power, largest));
    return answer;
}

Answer possible(const Twin *twin)
{
    if (twin->mode == UNKNOWN)
        return UNSURE;
    if (OF_SYSTEM)
        return YES;
    for (int i = 0; i < MODEL_VARIABLES; i++)
        if (described[i].causality == 'p' && !isfinite(twin->value[i]))
            return NO;
    double low = named(twin, "displacement_min"), high = named(twin, "displacement_max");
    double offset = named(twin, "displacement_offset"), kappa = named(twin, "kappa_omega");
    double width = high - low, reach = fmax(high - offset, offset - low);
    Answer answer = MODEL_BRANCHES ? UNSURE : YES; /* of branches no more is known than that they start possible */
    if (named(twin, "kA_0") != 1.0 || !(low <= offset && offset <= high) || fmax(fabs(low), fabs(high)) > 1e9 ||
        width < 1e-12 || width > 1e6 || kappa < 1e-15 || kappa > 1e15)
        return NO;
    if (!MODEL_STATES)
        answer = both(answer, fabs(named(twin, "omega_start")) <= 1.0 && named(twin, "input_resolution") >= 0.0 &&
                                      named(twin, "input_resolution") <= 1e9 ? YES : NO);
    answer = both(answer, named(twin, "sigma") >= 0.5 && named(twin, "sigma") <= 1000.0 ? YES : NO);
    answer = both(answer, named(twin, "n") >= 0.01 && named(twin, "n") <= 100.0 ? YES : NO);
    answer = both(answer, within(1e-9, named(twin, "rho") * width, 1e12));
    answer = both(answer, terms_possible(twin, "kA_0", MODEL_AMPLIFIER, reach, 1e9));
    answer = both(answer, MODEL_KNOTS ? terms_possible(twin, "FE_forces_0", MODEL_KNOTS, 1.0, 1e15)
                                      : terms_possible(twin, "kE_0", MODEL_ELASTIC, reach, 1e15));
    answer = both(answer, knots_rise(twin, low, high));
    return answer == NO ? NO : both(answer, amplifier_positive(twin, low - offset, high - offset));
}

Answer is_smooth(const Twin *twin)
{
    if (MODEL_STATES || twin->mode == INITIALIZATION)
        return YES;
    return twin->mode == UNKNOWN ? UNSURE : named(twin, "input_resolution") > 0.0 ? NO : YES;
}

/* ---- values that are set ----------------------------------------------------------------------------------------- */

/* The largest size of a value. */
static double largest_given(unsigned element)
{
    char causality = described[element].causality;
    return causality == 'p' || OF_SYSTEM ? DBL_MAX : causality == 'i' ? 1e9 : 1e100;
}

/* Parameters of a system have limits of their own. */
static Answer within_system(const Twin *twin, unsigned element, double value)
{
    const char *name = described[element].name;
    double low = strcmp(name, "step") == 0 ? 1e-12 : strcmp(name, "omega_start") == 0 ? -1.0 : -1e4;
    double high = strcmp(name, "step") == 0 ? MODEL_LARGEST_STEP : -low;
    return !(value >= low && value <= high) ? NO : twin->mode == UNKNOWN ? UNSURE : YES;
}

Answer may_set(const Twin *twin, size_t count, const unsigned elements[], const double values[])
{
    int early = twin->mode == INSTANTIATED || twin->mode == INITIALIZATION, tunes = 0;
    int closed = OF_SYSTEM || (twin->mode == CONTINUOUS_TIME && !MODEL_STATES);
    Twin tuned = *twin;
    Answer answer = YES;
    for (size_t i = 0; i < count; i++)
        twin_set(&tuned, elements[i], values[i]); /* of those that are set twice the last value counts */
    for (size_t i = 0; i < count; i++) {
        const Described *of = &described[elements[i]];
        double before = twin->value[elements[i]];
        int parameter = of->causality == 'p', is_last = memcmp(&tuned.value[elements[i]], &values[i], 8) == 0;
        if (strchr(SETTABLE, of->causality) == NULL || !(fabs(values[i]) <= largest_given(elements[i])))
            return NO;
        if (OF_SYSTEM && parameter && (early || twin->mode == UNKNOWN))
            answer = both(answer, within_system(twin, elements[i], values[i]));
        if (parameter && twin->mode == UNKNOWN)
            answer = both(answer, UNSURE);
        else if (parameter && !early && (closed || !of->tunable) && memcmp(&before, &values[i], 8) != 0)
            answer = both(answer, is_last && before != values[i] ? NO : UNSURE); /* any may be set to what it is */
        tunes |= parameter;
    }
    return early || !tunes || OF_SYSTEM ? answer : both(answer, possible(&tuned));
}

double usual_displacement(void)
{
    if (OF_SYSTEM)
        return uniform(-0.05, 0.05);
    double low = described[variable("displacement_min")].start, high = described[variable("displacement_max")].start;
    return low + (high - low) * (chance(90) ? uniform(0.0, 1.0) : uniform(-1.0, 2.0));
}

/* As far as a spring or its motion can go, where nothing may overflow. */
static double extreme_value(unsigned element)
{
    static const struct {
        const char *name;
        double least, most;
    } ends[] = {{"kappa_omega", 1e-15, 1e15}, {"sigma", 0.5, 1000.0}, {"n", 0.01, 100.0},
                {"input_resolution", 5e-324, 1e9}, {"FE_forces_", -1e15, 1e15}};
    double low = described[variable("displacement_min")].start, high = described[variable("displacement_max")].start;
    double offset = described[variable("displacement_offset")].start, sign = chance(50) ? 1.0 : -1.0;
    double reach = 1.01 * fmax(high - offset, offset - low);
    const char *name = described[element].name;
    if (described[element].causality != 'p')
        return sign * largest_given(element);
    if (strcmp(name, "rho") == 0)
        return sign > 0.0 ? 0.99e12 / (high - low) : 1.01e-9 / (high - low);
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
        if (strncmp(name, ends[i].name, strlen(ends[i].name)) == 0)
            return sign > 0.0 ? ends[i].most : ends[i].least;
    if (strncmp(name, "kE_", 3) == 0)
        return sign * 0.99e15 / pow(reach, atoi(name + 3));
    return strncmp(name, "kA_", 3) == 0 && atoi(name + 3) > 0 ? sign * 0.99e9 / pow(reach, atoi(name + 3))
                                                              : described[element].start;
}

static double usual_of_system(unsigned element)
{
    const char *name = described[element].name;
    if (strcmp(name, "omega_start") == 0)
        return chance(50) ? below(3) - 1.0 : uniform(-1.1, 1.1);
    if (strncmp(name, "gravity_", 8) == 0)
        return chance(80) ? described[element].start * uniform(0.5, 1.5) : uniform(-30.0, 30.0);
    return uniform(-1.0, 1.0) * (strncmp(name, "load_", 5) == 0 ? 1e3 : 1e2);
}

double usual_value(unsigned element)
{
    const char *name = element < MODEL_VARIABLES ? described[element].name : "";
    /* Never so small that a step of co-simulation takes long. */
    if (strcmp(name, "step") == 0)
        return MODEL_LARGEST_STEP * pow(10.0, uniform(-2.0, 0.2));
    if (element >= MODEL_VARIABLES || careless())
        return awkward();
    if (OF_SYSTEM)
        return usual_of_system(element);
    if (chance(2))
        return extreme_value(element);
    if (element == variable("displacement"))
        return usual_displacement();
    if (described[element].causality != 'p')
        return uniform(-1.0, 1.0) * (MODEL_STATES ? 1.2 : 1.0);
    double start = described[element].start;
    /* Other values would hardly ever be possible: knots go from one end of the range to the other. */
    int fixed = strcmp(name, "kA_0") == 0 || strncmp(name, "FE_knots", 8) == 0 ||
                (MODEL_KNOTS && strncmp(name, "displacement_m", 14) == 0);
    if (chance(50) || fixed)
        return start;
    if (strcmp(name, "input_resolution") == 0)
        return described[variable("displacement_max")].start * pow(10.0, uniform(-4.0, 0.0));
    if (start == 0.0)
        return chance(20) ? copysign(1.0, uniform(-1.0, 1.0)) : uniform(-1.0, 1.0);
    return start * (chance(80) ? uniform(0.9, 1.1) : pow(10.0, uniform(-1.9, 1.9)));
}

/* ---- the path ---------------------------------------------------------------------------------------------------- */

int side_of(const Twin *twin)
{
    if (OF_SYSTEM)
        return 0;
    double displacement = named(twin, "displacement");
    return (displacement > named(twin, "displacement_max")) - (displacement < named(twin, "displacement_min"));
}

void twin_set(Twin *twin, unsigned element, double value)
{
    twin->value[element] = value;
    if (!OF_SYSTEM && described[element].causality == 'i') {
        twin->moved = 0;
        twin->doubt = 0.0;
    }
}

int twin_commit(Twin *twin)
{
    int before = twin->side;
    if (OF_SYSTEM)
        return 0;
    twin->side = side_of(twin);
    twin->committed = named(twin, "displacement");
    twin->committed_doubt = twin->doubt;
    return twin->side != 0 && twin->side != before;
}

/* Whether a path through a step stays where displacements may be, and no faster than they may; unsure where rounding
 * has a say. */
static Answer path_possible(const Twin *twin, double size)
{
    long double x = named(twin, "displacement"), v = twin->velocity, a = twin->acceleration, turn = -v / a;
    long double end_of_path = fabsl(x + size * (v + 0.5L * a * size));
    long double tip = 0.0L < turn && turn < size ? fabsl(x + 0.5L * v * turn) : 0.0L;
    long double farthest = fmaxl(fmaxl(end_of_path, tip), fabsl(v + a * size));
    return farthest < 0.999e9L ? YES : farthest > 1.001e9L ? NO : UNSURE;
}

Answer step_possible(const Twin *twin, double time, double size)
{
    double after = time + size, stop = twin->stop_time, reach = fmax(fabs(after), fabs(stop));
    if (twin->mode == UNKNOWN)
        return UNSURE;
    if (!isfinite(time) || !(size >= 0.0) || !isfinite(after) ||
        (OF_SYSTEM && size > 1.001e8 * named(twin, "step")))
        return NO;
    if (isfinite(stop) && after > stop + 1e-6 * reach)
        return NO;
    if (OF_SYSTEM)
        return UNSURE; /* it may diverge */
    if (twin->interpolated && path_possible(twin, size) != YES)
        return path_possible(twin, size);
    return after > stop ? UNSURE : YES; /* times that a host adds up are never exact */
}

Answer rate_possible(const Twin *twin)
{
    double rate = fabs(twin->rate), doubt = twin->rate_doubt + 1e-3 * rate;
    return twin->mode == UNKNOWN ? UNSURE : rate + doubt <= 1e9 ? YES : rate - doubt > 1e9 ? NO : UNSURE;
}

void twin_step(Twin *twin, double time, double size)
{
    static const double ROUNDING = 1e-9;
    twin->time = time + size;
    if (OF_SYSTEM)
        return;
    double *x = &twin->value[variable("displacement")], v = twin->velocity, a = twin->acceleration;
    if (twin->interpolated) {
        twin->rate = v + a * size;
        twin->rate_doubt = ROUNDING * (fabs(v) + fabs(a) * size);
        twin->doubt += ROUNDING * (1.0 + fabs(*x) + size * (fabs(v) + fabs(a) * size));
        *x += size * (v + 0.5 * size * a);
        twin->moved = 1;
    } else if (size > 0.0) {
        twin->rate = (*x - twin->committed) / size;
        twin->rate_doubt = (twin->doubt + twin->committed_doubt) / size;
    }
    twin->interpolated = 0;
    twin->velocity = twin->acceleration = 0.0;
}
