/* What an FMU has of its own, for the files that the FMU of a spring and that of a system share. The file that is compiled
 * includes, before any of these, the header (fmu_instance.h or system_instance.h) that defines
 *
 *     Instance            with `log`, `variables` and `state`
 *     State               with `mode`, `time` and `stop_time`; a copy of it is a snapshot
 *     fmu_type, fmu_variable_name, fmu_identity
 *     fmu_instantiate, fmu_free, fmu_begin, fmu_end_initialization, fmu_step, fmu_step_to, fmu_restore
 *     fmu_read, fmu_read_extrapolating, fmu_require_change, fmu_open_changes, fmu_change, fmu_apply_changes
 *     fmu_indicators, fmu_indicator
 *     fmu_state_fields, fmu_state_problem
 */
#ifndef FMU_INTERFACE_H
#define FMU_INTERFACE_H

/* Types and causalities of variables. */
typedef enum { VARIABLE_REAL, VARIABLE_INTEGER, VARIABLE_BOOLEAN, VARIABLE_STRING } VariableType;

typedef enum { VARIABLE_INPUT, VARIABLE_OUTPUT, VARIABLE_LOCAL, VARIABLE_PARAMETER } VariableCausality;

#endif
