/* What an FMU has of its own, for the files that the FMU of a spring and that of a system share. The file that is compiled
 * includes, before any of these, the header (fmu_instance.h or system_instance.h) that defines
 *
 *     Instance            with `log`, `variables` and `state`
 *     State               with `mode`, `time` and `stop_time`; a copy of it is a snapshot
 *     fmu_type, fmu_variable_name, fmu_identity
 *     fmu_instantiate, fmu_free, fmu_begin, fmu_end_initialization, fmu_step, fmu_step_to, fmu_restore
 *     fmu_read, fmu_read_extrapolating, fmu_require_change, fmu_open_changes, fmu_change, fmu_apply_changes
 *     fmu_state_fields, fmu_state_problem
 */
#ifndef FMU_INTERFACE_H
#define FMU_INTERFACE_H

/* Types and causalities of variables. */
typedef enum { VARIABLE_REAL, VARIABLE_INTEGER, VARIABLE_BOOLEAN, VARIABLE_STRING } VariableType;

typedef enum { VARIABLE_INPUT, VARIABLE_OUTPUT, VARIABLE_LOCAL, VARIABLE_PARAMETER } VariableCausality;

/* The elements of one variable by their references in FMI 2.0, each of which is a variable there; in FMI 3.0 the time and
 * the event indicator follow them. */
typedef struct {
    unsigned first, count; /* 0: there is no such variable */
} Elements;

#endif
