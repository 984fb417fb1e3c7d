"""Random sequences of FMI calls under the sanitizers: no crash, no leak, no wrong status (tests/helpers/fuzzing.py)."""

from __future__ import annotations

import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from fuzzing import COUNTED, SANITIZED, add_up, build, link, run, write_sources
from kernel_tools import compiled
from springs import TABLE

# Of the million that `python tests/helpers/fuzzing.py` does: some 20 s of one core.
SEQUENCES = 4000
FIRST_SEED = 1
# No step is ever pending: nothing can be cancelled, and nothing is known of it.
NEVER_DONE = {"CancelStep", "GetStatus", "GetIntegerStatus", "GetStringStatus"}
# Derivatives are discarded where they overflow, or after a jump.
DISCARDED = {
    *("GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus"),
    *("GetDirectionalDerivative", "GetRealOutputDerivatives"),
}

# What the fuzzer must find: the file, what stands there, and what is put in its place.
FAULTS = {
    "a state of another FMU is taken": (
        "fmu_bytes.c",
        "memcmp(bytes + GUID_AT, fmu_guid().text, FMU_GUID_SIZE) != 0",
        "0",
    ),
    "a sensitivity is not serialized": ("fmu_state.c", "fmu_double_field(cursor, &sensitivity->by_n);", ""),
    "a state is not freed": ("fmu_snapshots.c", "free(snapshot);", ""),
    "a table is not released": ("fmu_instance.c", "        fmu_release(shared);\n", "        return;\n"),
    "a reference too many": ("fmi2_arguments.h", "< instance->variables", "<= instance->variables"),
    "text of the host as a format": ("fmi2_life.c", "*text == '%'", "0"),
    "absurd parameters": (
        "spring_problem.c",
        "|| size_problem(p, text, size)",
        "|| (0 && size_problem(p, text, size))",
    ),
    "an absurd displacement": ("spring_limits.h", "LARGEST_DISPLACEMENT = 1e9", "LARGEST_DISPLACEMENT = 1e200"),
    "a rate that is not finite": ("fmu_derivatives.c", "fabs(state->rate) > LARGEST_VELOCITY", "0"),
    "a derivative that is not finite": ("fmu_derivatives.c", "isfinite(sum)", "1"),
    "a state whose energy is not finite": ("fmu_sound.h", "fabs(memory->energy) <= LARGEST_SUM", "1"),
    "a trial is not forgotten": ("fmu_instance.c", "instance->has_trial = 0;", ""),
    "a step before initialization": ("fmu_modes.h", "(DoStep, CS_STEP)", "(DoStep, CS_STEP | CS_INITIALIZATION)"),
}


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_sources(tmp_path_factory.mktemp("fuzz") / "sources")


@pytest.fixture(scope="module")
def program(sources: Path) -> Path:
    return build(sources, sources.parent / "objects")


@pytest.mark.slow
def test_random_sequences_of_calls(program: Path) -> None:
    jobs = min(4, os.cpu_count() or 1)
    share = SEQUENCES // jobs
    with ThreadPoolExecutor(jobs) as pool:
        outcomes = list(pool.map(lambda k: run(program, FIRST_SEED + 10_000 * k, share), range(jobs)))
    for outcome in outcomes:
        assert outcome.found == "", outcome.found
    total = add_up(outcomes)
    print(f"{total['sequences']} sequences, {total['calls']} calls")
    assert total["sequences"] == share * jobs
    # Every call has been made in every way.
    calls = set(total["done"])
    assert len(calls) == 40
    assert {call for call in calls if total["done"][call] == 0} == NEVER_DONE
    assert {call for call in calls if total["discarded"][call] > 0} == DISCARDED
    assert all(total["refused"][call] > 0 for call in calls)
    assert min(total["starved"], total["copies"], total["crafted_taken"], total["crafted_refused"]) > 100


@pytest.mark.slow
def test_random_sequences_of_calls_of_a_table(tmp_path: Path) -> None:
    """FE by its forces at knots: a quarter of the sequences."""
    outcome = run(build(write_sources(tmp_path / "sources", TABLE), tmp_path / "objects"), FIRST_SEED, SEQUENCES // 4)
    assert outcome.found == "", outcome.found
    assert add_up([outcome])["sequences"] == SEQUENCES // 4


@pytest.mark.slow
def test_random_sequences_of_calls_of_the_form_with_states(tmp_path: Path) -> None:
    sources = write_sources(tmp_path / "sources", with_states=True)
    outcome = run(build(sources, tmp_path / "objects"), FIRST_SEED, SEQUENCES // 4)
    assert outcome.found == "", outcome.found
    total = add_up([outcome])
    assert total["sequences"] == SEQUENCES // 4
    of_states = ("SetContinuousStates", "GetContinuousStates", "GetDerivatives", "GetNominalsOfContinuousStates")
    assert all(total["done"][call] > 0 and total["refused"][call] > 0 for call in of_states)
    assert min(total["crafted_taken"], total["crafted_refused"]) > 100


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_found(fault: str, sources: Path, program: Path, tmp_path: Path) -> None:
    name, sound, faulty = FAULTS[fault]
    folder = Path(shutil.copytree(sources, tmp_path / "sources"))
    (file,) = folder.rglob(name)
    text = file.read_text()
    assert sound in text, f"the fault cannot be planted: {name} has changed"
    file.write_text(text.replace(sound, faulty))
    objects = {path.stem: path for path in program.parent.glob("*.o")}
    objects["fmi2_all"] = compiled(
        tmp_path / "faulty.o", *SANITIZED, *COUNTED, "-Wno-format-security", "-Wno-unused", "-c", folder / "fmi2_all.c"
    )
    outcome = run(link(list(objects.values()), tmp_path / "fuzz"), FIRST_SEED, SEQUENCES)
    assert "with the seed" in outcome.found
