/* Calls of FMI 2.0 for model exchange, which the FMU of a system does not have; no pair of tests/fuzz/fmi/fmi3 comes to
 * them. */
#include "../fuzz.h"

#define ABSENT(call) FAIL("fmi2" #call " is called, which a system does not have")

#define WITHOUT_ARGUMENTS(call) \
    fmi2Status fmi2##call(fmi2Component c) \
    { \
        (void)c; \
        ABSENT(call); \
    }
#define WITH_ONE(call, Type) \
    fmi2Status fmi2##call(fmi2Component c, Type one) \
    { \
        (void)c; \
        (void)one; \
        ABSENT(call); \
    }
#define WITH_VALUES(call, Type) \
    fmi2Status fmi2##call(fmi2Component c, Type values[], size_t count) \
    { \
        (void)c; \
        (void)values; \
        (void)count; \
        ABSENT(call); \
    }

WITHOUT_ARGUMENTS(EnterEventMode)
WITHOUT_ARGUMENTS(EnterContinuousTimeMode)
WITH_ONE(NewDiscreteStates, fmi2EventInfo *)
WITH_ONE(SetTime, fmi2Real)
WITH_VALUES(SetContinuousStates, const fmi2Real)
WITH_VALUES(GetDerivatives, fmi2Real)
WITH_VALUES(GetEventIndicators, fmi2Real)
WITH_VALUES(GetContinuousStates, fmi2Real)
WITH_VALUES(GetNominalsOfContinuousStates, fmi2Real)

fmi2Status fmi2CompletedIntegratorStep(
    fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint, fmi2Boolean *enterEventMode, fmi2Boolean *terminate)
{
    (void)c;
    (void)noSetFMUStatePriorToCurrentPoint;
    (void)enterEventMode;
    (void)terminate;
    ABSENT(CompletedIntegratorStep);
}
