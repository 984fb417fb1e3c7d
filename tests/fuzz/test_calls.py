"""Random calls of FMI under the sanitizers: no crash, no leak, no wrong answer (fmi/fuzz.c)."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from fuzz import run as fuzz
from program import ADDRESSES, SANITIZED, program_of, run
from tools import program

pytestmark = pytest.mark.long
SEED = fuzz.seed_of_commit()
OF_SIMULATION = {"DoStep", "GetRealOutputDerivatives", "SetRealInputDerivatives"}
OF_EXCHANGE = {
    "SetTime", "EnterEventMode", "NewDiscreteStates", "EnterContinuousTimeMode", "CompletedIntegratorStep",
    "EvaluateDiscreteStates", "SetContinuousStates", "GetContinuousStates", "GetDerivatives", "GetEventIndicators",
    "GetNominalsOfContinuousStates",
}  # fmt: skip
# What must be found: form, file, what stands there, what is put in its place; and, if it is not both, the version of
# FMI that is built so, while the other one beside it stays sound.
PLANTED = json.loads(Path(__file__).with_name("planted.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the program of each form is built once."""
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize(
    ("form", "flags", "count"),
    [
        *((form, ("-O0", *ADDRESSES[1:]), 300) for form in ("spring", "branches")),
        *(
            pytest.param(form, SANITIZED, 300 if form == "system" else 1200, marks=pytest.mark.slow)
            for form in fuzz.FORMS
        ),
    ],
)
def test_random_lives(form: str, flags: tuple[str, ...], count: int, tmp_path: Path) -> None:
    program("cc", package="gcc libc6-dev")
    found, counts = run(program_of(form, tmp_path, flags), SEED, count)
    assert found == "", found
    # Every call has been made in every way, though some are refused without an instance only.
    never = OF_SIMULATION if form.endswith("states") else OF_EXCHANGE if form in ("branches", "system") else set()
    calls = {call: times for call, times in counts.items() if isinstance(times, list)}
    assert {call for call, (done, _) in calls.items() if done == 0} == never
    assert sum(refused == 0 for _, refused in calls.values()) <= 3
    assert min(times for call, times in counts.items() if call not in calls) > 0


@pytest.mark.slow
@pytest.mark.parametrize(("form", "name", "sound", "faulty", "version"), PLANTED)
def test_planted_faults_are_found(
    form: str, name: str, sound: str, faulty: str, version: str, folders: Path, tmp_path: Path
) -> None:
    program("cc", package="gcc libc6-dev")
    flags = ("-O0", *ADDRESSES[1:], "-Wno-error")
    (folders / form).mkdir(exist_ok=True)
    program_of(form, folders / form, flags)
    folder = Path(shutil.copytree(folders / form, tmp_path / "faulty"))
    (file,) = (folder / "sources").rglob(name)
    assert sound in file.read_text(), f"the fault cannot be planted: {name} has changed"
    file.write_text(file.read_text().replace(sound, faulty))
    for made in folder.glob("objects/*_all*.o"):
        if version in ("", "3" if "3" in made.stem else "2"):
            made.unlink()
    found, _ = run(program_of(form, folder, flags), SEED, 40_000)  # to the first find
    assert "It happens with the seed" in found
