/* The calls of FMI 2.0 for model exchange that FMI 3.0 has otherwise. */
#define FMI_GET_RATES GetDerivatives
#include "../fmu/fmu_model_exchange.c"

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *eventInfo)
{
    FMU_REQUIRE(c, NewDiscreteStates);
    FMU_REQUIRE_ARRAY(instance, NewDiscreteStates, eventInfo, 1);
    *eventInfo = (fmi2EventInfo){.newDiscreteStatesNeeded = fmi2False};
    return fmi2OK;
}
