/* The calls of FMI 3.0 about derivatives: by variables, which are sums of partial derivatives over knowns or over
 * unknowns, and by time. */
#include "fmi3_arguments.h"
#include "../fmu/fmu_derivatives.h"

/* A list of variables, as the host gives it. */
typedef struct {
    const fmi3ValueReference *references;
    size_t count;
} List;

/* One by one the elements of a list: begins at 0, ends when `next` returns 0. */
typedef struct {
    const List *list;
    size_t variable;
    unsigned place, element;
} Walk;

static int next(const Instance *instance, Walk *walk)
{
    if (walk->variable == walk->list->count)
        return 0;
    Elements elements = fmi3_elements(instance, walk->list->references[walk->variable]);
    walk->element = elements.first + walk->place;
    if (++walk->place == elements.count) {
        walk->place = 0;
        walk->variable++;
    }
    return 1;
}

/* Neither the time nor the event indicator has derivatives. */
static FmuStatus require_derivable(const Instance *instance, unsigned element)
{
    if (element < instance->variables)
        return FMU_OK;
    return FMU_REFUSE(&instance->log, "There are no derivatives of or with respect to `%s`.",
                      fmi3_name(instance, element).text);
}

/* Whether all these derivatives can be given. */
static FmuStatus require_derivatives(const Instance *instance, const List *unknowns, const List *knowns)
{
    for (Walk unknown = {.list = unknowns}; next(instance, &unknown);)
        if (require_derivable(instance, unknown.element) != FMU_OK ||
            fmu_require_unknown(instance, unknown.element) != FMU_OK)
            return FMU_ERROR;
    for (Walk known = {.list = knowns}; next(instance, &known);) {
        if (require_derivable(instance, known.element) != FMU_OK ||
            fmu_require_known(instance, known.element) != FMU_OK)
            return FMU_ERROR;
        for (Walk unknown = {.list = unknowns}; next(instance, &unknown);)
            if (fmu_require_pair(instance, unknown.element, known.element) != FMU_OK)
                return FMU_ERROR;
    }
    return FMU_OK;
}

/* For each element of `of` the sum over those of `over` of seed times partial derivative; `adjoint`: `over` are the
 * unknowns. */
static FmuStatus sums(Instance *instance, const List *of, const List *over, int adjoint, const double seeds[],
                      double values[])
{
    Gradients at;
    const double *seed = seeds;
    for (Walk seeded = {.list = over}; next(instance, &seeded);)
        if (fmu_require_seed(instance, seeded.element, *seed++) != FMU_OK)
            return FMU_ERROR;
    if (fmu_gradients(instance, &at) != FMU_OK)
        return FMU_ERROR;
    for (Walk one = {.list = of}; next(instance, &one);) {
        double sum = 0.0;
        seed = seeds;
        for (Walk other = {.list = over}; next(instance, &other);)
            sum += *seed++ * (adjoint ? fmu_partial(instance, &at, other.element, one.element)
                                      : fmu_partial(instance, &at, one.element, other.element));
        if (fmu_require_sum(instance, one.element, sum) != FMU_OK)
            return FMU_DISCARD;
        *values++ = sum;
    }
    return FMU_OK;
}

#define DERIVATIVE(call, of, over, adjoint) \
    fmi3Status fmi3##call(fmi3Instance c, const fmi3ValueReference unknowns[], size_t nUnknowns, \
                          const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed, \
                          fmi3Float64 sensitivity[], size_t nSensitivity) \
    { \
        FMU_REQUIRE(c, call); \
        const List unknown_list = {unknowns, nUnknowns}, known_list = {knowns, nKnowns}; \
        if (fmi3_require(instance, "fmi3" #call, (over).references, (over).count, "seed", seed, nSeed, \
                         VARIABLE_REAL) != FMU_OK || \
            fmi3_require(instance, "fmi3" #call, (of).references, (of).count, "sensitivity", sensitivity, \
                         nSensitivity, VARIABLE_REAL) != FMU_OK || \
            require_derivatives(instance, &unknown_list, &known_list) != FMU_OK) \
            return fmi3Error; \
        return sums(instance, &(of), &(over), adjoint, seed, sensitivity); \
    }

DERIVATIVE(GetDirectionalDerivative, unknown_list, known_list, 0)
DERIVATIVE(GetAdjointDerivative, known_list, unknown_list, 1)

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues)
{
    Gradients at;
    FMU_REQUIRE(c, GetOutputDerivatives);
    FMU_REQUIRE_ARRAY(instance, GetOutputDerivatives, orders, nValueReferences);
    FMI3_REQUIRE_VALUES(instance, GetOutputDerivatives, VARIABLE_REAL);
    /* Outputs are no arrays. */
    for (size_t i = 0; i < nValueReferences; i++) {
        unsigned output = fmi3_elements(instance, valueReferences[i]).first;
        if (require_derivable(instance, output) != FMU_OK ||
            fmu_require_rate(instance, output, orders[i]) != FMU_OK)
            return fmi3Error;
    }
    if (nValueReferences == 0)
        return fmi3OK;
    FmuStatus status = fmu_gradients_of_path(instance, &at);
    for (size_t i = 0; i < nValueReferences && status == FMU_OK; i++)
        values[i] = fmu_rate(instance, &at, fmi3_elements(instance, valueReferences[i]).first);
    return status;
}
