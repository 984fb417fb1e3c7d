/* Messages by the logger of FMI 2.0. */
#ifndef FMI2_LOG_H
#define FMI2_LOG_H

#include "fmi2_api.h"
#include "../fmi/fmu_log.h"

/* Where messages go; the name is not copied. */
SPRING_LOCAL Log fmi2_log(fmi2String name, const fmi2CallbackFunctions *functions);

#endif
