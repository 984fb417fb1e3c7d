#include "fmi2_variables.h"

#include <string.h>

SpringParameters fmu_spring_parameters(const double settings[SPRING_PARAMETERS])
{
    SpringParameters p = {
        .elastic = SPRING_ELASTIC,
        .amplifier = SPRING_AMPLIFIER,
        .kappa_omega = settings[SPRING_KAPPA_OMEGA - SPRING_FIRST_PARAMETER],
        .rho = settings[SPRING_RHO - SPRING_FIRST_PARAMETER],
        .sigma = settings[SPRING_SIGMA - SPRING_FIRST_PARAMETER],
        .n = settings[SPRING_N - SPRING_FIRST_PARAMETER],
        .displacement_offset = settings[SPRING_DISPLACEMENT_OFFSET - SPRING_FIRST_PARAMETER],
        .displacement_min = settings[SPRING_DISPLACEMENT_MIN - SPRING_FIRST_PARAMETER],
        .displacement_max = settings[SPRING_DISPLACEMENT_MAX - SPRING_FIRST_PARAMETER],
    };
    memcpy(p.kE, settings + (SPRING_KE - SPRING_FIRST_PARAMETER), SPRING_ELASTIC * sizeof *settings);
    memcpy(p.kA, settings + (SPRING_KA - SPRING_FIRST_PARAMETER), SPRING_AMPLIFIER * sizeof *settings);
    return p;
}

double fmu_derivative_by(const SpringGradient *gradient, unsigned parameter)
{
    switch (parameter) {
    case SPRING_KAPPA_OMEGA: return gradient->by_kappa_omega;
    case SPRING_RHO: return gradient->by_rho;
    case SPRING_SIGMA: return gradient->by_sigma;
    case SPRING_N: return gradient->by_n;
    case SPRING_DISPLACEMENT_OFFSET: return gradient->by_displacement_offset;
    case SPRING_DISPLACEMENT_MIN: return gradient->by_displacement_min;
    case SPRING_DISPLACEMENT_MAX: return gradient->by_displacement_max;
    case SPRING_OMEGA_START: return gradient->by_omega_start;
    default:
        return parameter < SPRING_KA ? gradient->by_kE[parameter - SPRING_KE] : gradient->by_kA[parameter - SPRING_KA];
    }
}
