"""Random sequences of FMI calls against the Python-backed FMU: its binary and its slave (tests/helpers/fuzzing.py)."""

from __future__ import annotations

from pathlib import Path

import pytest

from fuzzing import add_up, build_python, run, write_python_sources

SEQUENCES = 2000
FIRST_SEED = 1
# What the fuzzer must find: the file of the resources, what stands there, and what is put in its place.
FAULTS = {
    "absurd parameters": ("core/parameters.py", "*_size_problems(p)]", "]"),
    "an absurd displacement": ("core/instance.py", "abs(value) <= LARGEST_DISPLACEMENT", "abs(value) <= 1e200"),
    "a time that is not finite": ("core/state.py", '"time": _is_finite', '"time": lambda value: True'),
    "a memory that is none": ("core/state.py", '"memory": _is_memory', '"memory": lambda value: True'),
    "an exception": ("core/state.py", "(ValueError, RecursionError)", "UnicodeError"),
    "a trial is not forgotten": ("core/instance.py", "if state.displacement != self._state.displacement:", "if False:"),
}


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fuzz")
    return build_python(write_python_sources(folder / "sources"), folder / "objects")


@pytest.mark.slow
def test_random_sequences_of_calls(program: Path) -> None:
    outcome = run(program, FIRST_SEED, SEQUENCES)
    assert outcome.found == "", outcome.found
    total = add_up([outcome])
    assert total["sequences"] == SEQUENCES
    assert all(
        total["done"][call] > 0 for call in ("DoStep", "GetReal", "SetReal", "SetFMUstate", "DeSerializeFMUstate")
    )
    assert min(total["crafted_taken"], total["crafted_refused"]) > 20


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_are_found(fault: str, tmp_path: Path) -> None:
    name, sound, faulty = FAULTS[fault]
    program = build_python(write_python_sources(tmp_path / "sources"), tmp_path / "objects")
    (path,) = (tmp_path / "sources" / "resources").glob(f"*/{name}")
    text = path.read_text()
    assert sound in text, f"the fault cannot be planted: {name} has changed"
    path.write_text(text.replace(sound, faulty))
    assert "with the seed" in run(program, FIRST_SEED, SEQUENCES).found
