"""Random lives of FMI 3.0 beside FMI 2.0 under the sanitizers: equal to the bit, and refusals that change nothing."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from fuzzing import COUNTED, FORMS3, SANITIZED, build_pairs, link, run_alone, write_pair_sources
from kernel_tools import compiled

# Of the million that `python tests/helpers/fuzzing.py --form fmi3` does.
SEQUENCES = 1200
FIRST_SEED = 1
# These are legal in every mode, and have no argument that may be wrong but where the host is hostile.
NEVER_REFUSED = {"Terminate", "Reset", "GetBoolean", "GetFMUState", "FreeFMUState"}
# The form with states is for model exchange alone.
OF_CO_SIMULATION = {"DoStep", "GetOutputDerivatives"}
# The usual form of a spring with branches is for co-simulation alone.
OF_MODEL_EXCHANGE = {
    "SetTime", "EnterEventMode", "UpdateDiscreteStates", "EnterContinuousTimeMode", "CompletedIntegratorStep",
    "EvaluateDiscreteStates", "SetContinuousStates", "GetContinuousStates", "GetContinuousStateDerivatives",
    "GetNominalsOfContinuousStates", "GetNumberOfContinuousStates", "GetEventIndicators", "GetNumberOfEventIndicators",
}  # fmt: skip
NUMBERS = {"GetNumberOfContinuousStates", "GetNumberOfEventIndicators"}

# What the fuzzer must find: the form, the file, what stands there, and what is put in its place.
FAULTS = {
    "a number of values is not checked": ("fmi3", "fmi3_arguments.c", "if (value_count != expected)", "if (0)"),
    "a reference too many": ("fmi3", "fmi3_elements.c", "left <= last - first", "left <= last - first + 1"),
    "an array is set in part": (
        "fmi3",
        "fmi3_life.c",
        "k < elements.count; k++)\n            fmu_change",
        "k < 1; k++)\n            fmu_change",
    ),
    "a value is not checked": (
        "fmi3",
        "fmi3_life.c",
        "return fmu_require_change(instance, element, value);",
        "return FMU_OK;",
    ),
    "errors can be silenced": (
        "fmi3",
        "fmi3_life.c",
        "(loggingOn ? before | chosen : before & ~chosen) | LOG_ERRORS",
        "loggingOn ? before | chosen : before & ~chosen",
    ),
    "a stop time is forgotten": ("fmi3", "fmi3_life.c", "instance->state.stop_time = stop;", ""),
    "a step before initialization": (
        "fmi3",
        "fmu_modes.h",
        "(DoStep, CS_STEP)",
        "(DoStep, CS_STEP | CS_INITIALIZATION)",
    ),
    "start values cannot be read": (
        "fmi3-table",
        "fmi3_states.h",
        "(GetFloat64, ANY_MODE)",
        "(GetFloat64, INITIALIZATION | INITIALIZED)",
    ),
    "the wrong time is reached": (
        "fmi3",
        "fmu_instance.h",
        "*reached = time + size;",
        "*reached = time;",
    ),
    "a refused step reaches its end": (
        "fmi3",
        "fmi3_life.c",
        "*lastSuccessfulTime = instance->state.time;",
        "*lastSuccessfulTime = currentCommunicationPoint + communicationStepSize;",
    ),
    "the adjoint is no transpose": ("fmi3", "fmu_derivatives.c", "sum += *seed++ * (adjoint", "sum += *seed++ * (0"),
    "seeds run on": ("fmi3-table", "fmu_derivatives.c", "        seed = seeds;\n", ""),
    "a rate of a state is another one": (
        "fmi3-states",
        "fmu_model_exchange.c",
        "rates ? first_own + OWN_POWER : SPRING_ABSORBED_ENERGY",
        "rates ? first_own + OWN_OMEGA_RATE : SPRING_ABSORBED_ENERGY",
    ),
    "a state of another FMU is taken": ("fmi3", "fmu_snapshots.c", "snapshot->of != fmu_identity()", "0"),
    "a state is not freed": ("fmi3", "fmu_snapshots.c", "free(snapshot);", ""),
    "a trial is not forgotten": ("fmi3", "fmu_instance.c", "instance->has_trial = 0;", ""),
    "a table is allocated late": (
        "fmi3-real-time",
        "fmu_instance.c",
        "    if (held->buffers == NULL)\n        return fmu_acquire(parameters);",
        "    return fmu_acquire(parameters);",
    ),
    "energy that is left out has a rate": (
        "fmi3-no-energy",
        "fmu_derivatives.c",
        "unknown == SPRING_ABSORBED_ENERGY && settings->no_energy",
        "0",
    ),
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder with sources and objects for each form that has been asked for."""
    folder = tmp_path_factory.mktemp("fuzz3")
    return {form: folder / form for form in FORMS3}


def program_of(form: str, folders: dict[str, Path]) -> Path:
    """The fuzzer of a form, built once."""
    folder = folders[form]
    if not folder.exists():
        folder.mkdir()
        build_pairs(write_pair_sources(folder / "sources", *FORMS3[form]), folder / "objects")
    return folder / "objects" / "fuzz"


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMS3)
def test_random_lives_of_both_versions(form: str, folders: dict[str, Path]) -> None:
    outcome = run_alone(program_of(form, folders), FIRST_SEED, SEQUENCES)
    assert outcome.found == "", outcome.found
    total = outcome.statistics
    assert total["sequences"] == SEQUENCES
    calls = set(total["done"])
    assert len(calls) == 31
    with_states = form.endswith("states")
    never = OF_CO_SIMULATION if with_states else OF_MODEL_EXCHANGE if form == "fmi3-branches" else set()
    assert {call for call in calls if total["done"][call] == 0} == never
    assert {call for call in calls if total["refused"][call] == 0} == NEVER_REFUSED | (
        NUMBERS if with_states else set()
    )
    assert min(total["hostile"], total["compared"]) > 5000
    assert min(total["damaged"], total["transposed"]) > 100


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_found(fault: str, folders: dict[str, Path], tmp_path: Path) -> None:
    form, name, sound, faulty = FAULTS[fault]
    program = program_of(form, folders)
    folder = Path(shutil.copytree(folders[form] / "sources", tmp_path / "sources"))
    (file,) = folder.rglob(name)
    text = file.read_text()
    assert sound in text, f"the fault cannot be planted: {name} has changed"
    file.write_text(text.replace(sound, faulty))
    objects = {path.stem: path for path in program.parent.glob("*.o")}
    # FMI 2.0 stays sound beside it.
    flags = (*SANITIZED, *COUNTED, "-Wno-unused", "-Wno-unused-parameter")
    objects["fmi3_all"] = compiled(tmp_path / "faulty.o", *flags, "-c", folder / "fmi3_all.c")
    outcome = run_alone(link(list(objects.values()), tmp_path / "fuzz"), FIRST_SEED, 8 * SEQUENCES)  # to the first find
    assert "with the seed" in outcome.found
