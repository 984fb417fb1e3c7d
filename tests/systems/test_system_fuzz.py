"""Random sequences of FMI calls against the FMU of a system, under sanitizers (tests/fuzz/system/systems.c)."""

from __future__ import annotations

from pathlib import Path

import pytest

from fuzzing import PLAIN, add_up, build_system, run_alone, write_system_sources

FIRST_SEED, SEQUENCES = 40_000, 600
# What a stepping instance cannot do.
NEVER_DONE = {"GetStatus", "GetIntegerStatus", "GetStringStatus"}

# What the fuzzer must find: the file, what stands there, and what is put in its place.
FAULTS = {
    "a refused step leaves its traces": ("system_instance.c", "copy_motion(system, state, &instance->before);", ""),
    "energies are not serialized": ("system_state.c", "&memory->energy);", "&(double){0.0});"),
    "a table is not released": ("system_calls.c", "    system_release(instance);", ""),
    "a value that is not finite": ("system_instance.c", "if (!isfinite(value))", "if (0)"),
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
    path = sources / "system_fmu" / "c" / file
    content = path.read_text()
    assert text in content
    path.write_text(content.replace(text, other))
    program = build_system(sources, tmp_path / "objects", (*PLAIN, "-Wno-unused"))
    assert run_alone(program, FIRST_SEED, SEQUENCES).found != ""
