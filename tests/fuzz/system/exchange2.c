/* Calls of FMI 2.0 for model exchange, which the FMU of a system does not have; no pair of tests/fuzz/fmi3 comes to them. */
#include "../fuzz.h"

#define ABSENT(call, parameters) \
    fmi2Status fmi2##call parameters \
    { \
        FAIL("fmi2" #call " is called, which a system does not have"); \
    }

ABSENT(EnterEventMode, (fmi2Component c))
ABSENT(NewDiscreteStates, (fmi2Component c, fmi2EventInfo *info))
ABSENT(EnterContinuousTimeMode, (fmi2Component c))
ABSENT(CompletedIntegratorStep, (fmi2Component c, fmi2Boolean prior, fmi2Boolean *event, fmi2Boolean *end))
ABSENT(SetTime, (fmi2Component c, fmi2Real time))
ABSENT(SetContinuousStates, (fmi2Component c, const fmi2Real x[], size_t count))
ABSENT(GetDerivatives, (fmi2Component c, fmi2Real derivatives[], size_t count))
ABSENT(GetEventIndicators, (fmi2Component c, fmi2Real indicators[], size_t count))
ABSENT(GetContinuousStates, (fmi2Component c, fmi2Real x[], size_t count))
ABSENT(GetNominalsOfContinuousStates, (fmi2Component c, fmi2Real nominals[], size_t count))
