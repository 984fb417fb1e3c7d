"""Random calls of FMI under the sanitizers: no crash, no leak, no wrong answer (tests/helpers/fuzzing.py)."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from fuzzing import FORMS, PLAIN, program_of, run
from seeds import SEED

SEQUENCES = 1200
# No step is ever pending: nothing can be cancelled, and nothing is known of it.
NEVER_DONE = {"CancelStep", "GetStatus", "GetIntegerStatus", "GetStringStatus"}
OF_CO_SIMULATION = {
    "DoStep",
    "GetRealOutputDerivatives",
    "SetRealInputDerivatives",
    "GetRealStatus",
    "GetBooleanStatus",
}
OF_MODEL_EXCHANGE = {
    "SetTime", "EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode", "CompletedIntegratorStep",
    "EvaluateDiscreteStates", "SetContinuousStates", "GetContinuousStates", "GetDerivatives",
    "GetNominalsOfContinuousStates", "GetNumberOfContinuousStates", "GetEventIndicators", "GetNumberOfEventIndicators",
}  # fmt: skip

# What the fuzzer must find, by form: the file, what stands there, what is put in its place; and the version of FMI that
# is built so, while the other one beside it stays sound (0: both).
FAULTS = {
    "a state of another FMU is taken": (
        "spring", 0, "fmu_bytes.c", "memcmp(bytes + GUID_AT, fmu_guid().text, FMU_GUID_SIZE) != 0", "0",
    ),
    "a sensitivity is not serialized": (
        "spring", 0, "fmu_state.c", "fmu_double_field(cursor, &sensitivity->by_n);", "",
    ),
    "a state is not freed": ("spring", 3, "fmu_snapshots.c", "free(snapshot);", ""),
    "a state is not checked": ("spring", 3, "fmu_snapshots.c", "snapshot->of != fmu_identity()", "0"),
    "a table is not released": ("spring", 2, "fmu_instance.c", "        fmu_release(shared);\n", "        return;\n"),
    "a reference too many": ("spring", 2, "fmi2_arguments.h", "< instance->variables", "<= instance->variables"),
    "text of the host as a format": ("spring", 2, "fmi2_life.c", "*text == '%'", "0"),
    "absurd parameters": (
        "spring", 0, "spring_problem.c", "|| size_problem(p, text, size)", "|| (0 && size_problem(p, text, size))",
    ),
    "an absurd displacement": (
        "spring", 0, "spring_limits.h", "LARGEST_DISPLACEMENT = 1e9", "LARGEST_DISPLACEMENT = 1e200",
    ),
    "a rate that is not finite": (
        "spring", 0, "fmu_derivatives.c", "fabs(state->rate) > LARGEST_VELOCITY", "0",
    ),
    "a derivative that is not finite": ("spring", 0, "fmu_derivatives.c", "isfinite(sum)", "1"),
    "a state whose energy is not finite": ("spring", 0, "fmu_sound.h", "fabs(memory->energy) <= LARGEST_SUM", "1"),
    "a trial is not forgotten": ("spring", 0, "fmu_instance.c", "instance->has_trial = 0;", ""),
    "a step before initialization": (
        "spring", 0, "fmu_modes.h", "(DoStep, CS_STEP)", "(DoStep, CS_STEP | CS_INITIALIZATION)",
    ),
    "a number of values is not checked": ("spring", 3, "fmi3_arguments.c", "if (value_count != expected)", "if (0)"),
    "an element too many": ("spring", 3, "fmi3_elements.c", "left <= last - first", "left <= last - first + 1"),
    "an array is set in part": (
        "spring", 3, "fmi3_life.c", "k < elements.count; k++)\n            fmu_change",
        "k < 1; k++)\n            fmu_change",
    ),
    "a value is not checked": (
        "spring", 3, "fmi3_life.c", "return fmu_require_change(instance, element, value);", "return FMU_OK;",
    ),
    "errors can be silenced": (
        "spring", 3, "fmi3_life.c", "(loggingOn ? before | chosen : before & ~chosen) | LOG_ERRORS",
        "loggingOn ? before | chosen : before & ~chosen",
    ),
    "a stop time is forgotten": ("spring", 3, "fmi3_life.c", "instance->state.stop_time = stop;", ""),
    "start values cannot be read": (
        "table", 3, "fmi3_states.h", "(GetFloat64, ANY_MODE)", "(GetFloat64, INITIALIZATION | INITIALIZED)",
    ),
    "the wrong time is reached": ("spring", 3, "fmu_instance.h", "*reached = time + size;", "*reached = time;"),
    "a refused step reaches its end": (
        "spring", 3, "fmi3_life.c", "*lastSuccessfulTime = instance->state.time;",
        "*lastSuccessfulTime = currentCommunicationPoint + communicationStepSize;",
    ),
    "the adjoint is no transpose": (
        "spring", 3, "fmu_derivatives.c", "sum += *seed++ * (adjoint", "sum += *seed++ * (0",
    ),
    "seeds run on": ("table", 3, "fmu_derivatives.c", "        seed = seeds;\n", ""),
    "a rate of a state is another one": (
        "states", 3, "fmu_model_exchange.c", "rates ? first_own + OWN_POWER : SPRING_ABSORBED_ENERGY",
        "rates ? first_own + OWN_OMEGA_RATE : SPRING_ABSORBED_ENERGY",
    ),
    "a table is allocated late": (
        "real-time", 3, "fmu_instance.c",
        "    if (held->buffers == NULL)\n        return fmu_acquire(parameters);",
        "    return fmu_acquire(parameters);",
    ),
    "energy that is left out has a rate": (
        "no-energy", 3, "fmu_derivatives.c", "unknown == SPRING_ABSORBED_ENERGY && settings->no_energy", "0",
    ),
    "a refused step leaves its traces": (
        "system", 0, "system_instance.c", "copy_motion(system, state, &instance->before);", "",
    ),
    "energies are not serialized": ("system", 0, "system_state.c", "&memory->energy);", "&(double){0.0});"),
    "tables are not released": (
        "system", 2, "system_life.c", "        fmu_release(instance->shared[i]);\n", "        ;\n",
    ),
    "a value that is not finite": ("system", 0, "system_instance.c", "if (!isfinite(value))", "if (0)"),
    "the time is off": (
        "system", 3, "system_calls3.c", "return instance->state.time;", "return instance->state.time + 1.0;",
    ),
    "a value is set elsewhere": (
        "system", 3, "fmi3_life.c", "fmu_change(instance, elements.first + k,",
        "fmu_change(instance, fmi3_elements(instance, valueReferences[0]).first,",
    ),
    "what was right is set though another value is wrong": (
        "system", 3, "fmi3_life.c", "*value++) != FMU_OK)\n                return fmi3Error;\n",
        "*value++) != FMU_OK)\n                return fmi3Error;\n            else\n"
        "                fmu_change(instance, elements.first + k, value[-1]);\n",
    ),
    "a step is not judged": ("system", 3, "fmi3_life.c", "return fmu_step_to(", "return fmi3OK * fmu_step_to("),
    "event mode is not refused": ("system", 3, "fmi3_life.c", "if (eventModeUsed)", "if (0)"),
    "an instance is not freed": ("system", 3, "fmu_calls.c", "    fmu_free(c);", "    (void)c;"),
    "a flag is lost": ("spring", 3, "fmi3_life.c", "values[i] = extrapolating != 0;", "values[i] = 0;"),
}  # fmt: skip


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the fuzzer of each form is built once."""
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS)
def test_random_lives(form: str, folders: Path) -> None:
    (folders / form).mkdir(exist_ok=True)
    count = SEQUENCES // (4 if form == "system" else 1)
    outcome = run(program_of(form, folders / form), SEED, count)
    assert outcome.found == "", outcome.found
    total = outcome.statistics
    assert total["sequences"] == count
    # Every call has been made in every way.
    never = set(NEVER_DONE)
    never |= OF_CO_SIMULATION if form.endswith("states") else set()
    never |= OF_MODEL_EXCHANGE if form in ("branches", "system") else set()
    assert {call for call, times in total["done"].items() if times == 0} == never
    assert list(total["refused"].values()).count(0) <= 3  # some only without an instance
    least = ("starved", "joined", "hostile", "compared", "crafted_taken", "crafted_refused")
    assert min(total[name] for name in least) > 10
    assert total["transposed"] > 100 or form == "system"


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_found(fault: str, folders: Path, tmp_path: Path) -> None:
    form, version, name, sound, faulty = FAULTS[fault]
    sound_folder = folders / f"{form} plain"
    sound_folder.mkdir(exist_ok=True)
    flags = (*PLAIN, "-fsanitize=address", "-Wno-format-security", "-Wno-unused", "-Wno-unused-parameter")
    program_of(form, sound_folder, flags)
    folder = Path(shutil.copytree(sound_folder, tmp_path / "faulty"))
    (file,) = (folder / "sources").rglob(name)
    text = file.read_text()
    assert sound in text, f"the fault cannot be planted: {name} has changed"
    file.write_text(text.replace(sound, faulty))
    for made in folder.glob("objects/*_all*.o"):
        if version == 0 or (version == 3) == ("3" in made.stem):
            made.unlink()
    outcome = run(program_of(form, folder, flags), SEED, 10 * SEQUENCES)  # to the first find
    assert "with the seed" in outcome.found
