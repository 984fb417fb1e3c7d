"""Random sequences of FMI calls against the FMU of a system, under sanitizers.

By tests/fuzz/fmi/system/systems.c that of FMI 2.0, by tests/fuzz/fmi/fmi3 that of FMI 3.0 beside it.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from fuzzing import (
    PLAIN,
    add_up,
    build_system,
    build_system_pairs,
    run_alone,
    write_system_pair_sources,
    write_system_sources,
)

FIRST_SEED, SEQUENCES = 40_000, 600
# What a stepping instance cannot do.
NEVER_DONE = {"GetStatus", "GetIntegerStatus", "GetStringStatus"}

# What the fuzzer must find: the file, what stands there, and what is put in its place.
FAULTS = {
    "a refused step leaves its traces": ("system_instance.c", "copy_motion(system, state, &instance->before);", ""),
    "energies are not serialized": ("system_state.c", "&memory->energy);", "&(double){0.0});"),
    "a table is not released": ("system_life.c", "        fmu_release(instance->shared[i]);\n", "        ;\n"),
    "a value that is not finite": ("system_instance.c", "if (!isfinite(value))", "if (0)"),
}

# The same where FMI 3.0 stands beside FMI 2.0, which stays sound.
LIFE3, CALLS3 = "core/c/fmi3/fmi3_life.c", "fmu/system/c/system_calls3.c"
INSTANCE = "fmu/system/c/system_instance.h"
FAULTS3 = {
    "the time is off": (CALLS3, "return instance->state.time;", "return instance->state.time + 1.0;"),
    "a value is not checked": (LIFE3, "return fmu_require_change(instance, element, value);", "return FMU_OK;"),
    "a value is set elsewhere": (
        LIFE3,
        "fmu_change(instance, elements.first + k,",
        "fmu_change(instance, fmi3_elements(instance, valueReferences[0]).first,",
    ),
    "what was right is set though another value is wrong": (
        LIFE3,
        "*value++) != FMU_OK)\n                return fmi3Error;\n",
        "*value++) != FMU_OK)\n                return fmi3Error;\n            else\n"
        "                fmu_change(instance, elements.first + k, value[-1]);\n",
    ),
    "a step is not judged": (LIFE3, "return fmu_step_to(", "return fmi3OK * fmu_step_to("),
    "the wrong time is reached": (INSTANCE, "*reached = instance->state.time", "*reached = time"),
    "a refused step reaches its end": (INSTANCE, "*reached = instance->state.time", "*reached = time + size"),
    "event mode is not refused": (LIFE3, "if (eventModeUsed)", "if (0)"),
    "an instance is not freed": ("core/c/fmi/fmu_calls.c", "    fmu_free(c);", "    (void)c;"),
    "a flag is lost": (LIFE3, "values[i] = extrapolating != 0;", "values[i] = 0;"),
}
# Legal in model exchange alone.
OF_EXCHANGE = {
    *("EnterEventMode", "EvaluateDiscreteStates", "UpdateDiscreteStates", "EnterContinuousTimeMode"),
    *("CompletedIntegratorStep", "SetTime", "SetContinuousStates", "GetContinuousStates", "GetEventIndicators"),
    *("GetContinuousStateDerivatives", "GetNominalsOfContinuousStates", "GetNumberOfContinuousStates"),
    "GetNumberOfEventIndicators",
}


@pytest.mark.slow
def test_random_sequences_of_calls(tmp_path: Path) -> None:
    program = build_system(write_system_sources(tmp_path / "sources"), tmp_path / "objects")
    outcome = run_alone(program, FIRST_SEED, SEQUENCES)
    assert outcome.found == "", outcome.found
    total = add_up([outcome])
    print(f"seed {FIRST_SEED}: {total['sequences']} sequences, {total['calls']} calls")
    assert total["sequences"] == SEQUENCES
    made = {call for call in total["done"] if total["done"][call] + total["refused"][call] > 0}
    assert {call for call in made if total["done"][call] == 0} == NEVER_DONE
    assert min(total["copies"], total["crafted_taken"]) > 20
    assert min(total["starved"], total["crafted_refused"]) > 0


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_the_fuzzer_finds(fault: str, tmp_path: Path) -> None:
    sources = write_system_sources(tmp_path / "sources")
    file, text, other = FAULTS[fault]
    path = sources / "fmu" / "system" / "c" / file
    content = path.read_text()
    assert text in content
    path.write_text(content.replace(text, other))
    program = build_system(sources, tmp_path / "objects", (*PLAIN, "-Wno-unused"))
    assert run_alone(program, FIRST_SEED, SEQUENCES).found != ""


@pytest.mark.slow
def test_random_lives_of_both_versions(tmp_path: Path) -> None:
    program = build_system_pairs(write_system_pair_sources(tmp_path / "sources"), tmp_path / "objects")
    outcome = run_alone(program, FIRST_SEED, SEQUENCES)
    assert outcome.found == "", outcome.found
    total = outcome.statistics
    assert total["sequences"] == SEQUENCES
    # The adjoint is asked for where the other is refused.
    assert {call for call, count in total["done"].items() if count == 0} == {*OF_EXCHANGE, "GetAdjointDerivative"}
    assert min(total["hostile"], total["compared"]) > 3000
    assert total["damaged"] > 50


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS3)
def test_the_fuzzer_finds_in_fmi_3(fault: str, tmp_path: Path) -> None:
    sources = write_system_pair_sources(tmp_path / "sources")
    file, text, other = FAULTS3[fault]
    path = sources / file
    content = path.read_text()
    assert content.count(text) == 1
    path.write_text(content.replace(text, other))
    program = build_system_pairs(sources, tmp_path / "objects", (*PLAIN, "-Wno-unused", "-Wno-unused-parameter"))
    assert "with the seed" in run_alone(program, FIRST_SEED, SEQUENCES).found
