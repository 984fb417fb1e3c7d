"""Random calls of FMI under the sanitizers: no crash, no leak, no wrong answer (fmi/fuzz.h)."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import run as fuzz
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
# FMI
# that is built so, while the other one beside it stays sound.
FAULTS = [
    ("spring", "fmu_bytes.c", "memcmp(bytes + GUID_AT, fmu_guid().text, FMU_GUID_SIZE) != 0", "0", ""),
    ("spring", "fmu_state.c", "fmu_double_field(cursor, &sensitivity->by_n);", "", ""),
    ("spring", "fmu_snapshots.c", "free(snapshot);", "", "3"),
    ("spring", "fmu_snapshots.c", "snapshot->of != fmu_identity()", "0", "3"),
    ("spring", "fmu_instance.c", "        fmu_release(shared);\n", "        return;\n", "2"),
    ("spring", "fmi2_arguments.h", "< instance->variables", "<= instance->variables", "2"),
    ("spring", "fmi2_life.c", "*text == '%'", "0", "2"),
    ("spring", "spring_problem.c", "|| size_problem(p, text, size)", "|| (0 && size_problem(p, text, size))", ""),
    ("spring", "fmu_derivatives.c", "isfinite(sum)", "1", ""),
    ("spring", "fmu_instance.c", "instance->has_trial = 0;", "", ""),
    ("spring", "fmu_modes.h", "(DoStep, CS_STEP)", "(DoStep, CS_STEP | CS_INITIALIZATION)", ""),
    ("spring", "fmi3_arguments.c", "if (value_count != expected)", "if (0)", "3"),
    ("spring", "fmi3_elements.c", "left <= last - first", "left <= last - first + 1", "3"),
    ("spring", "fmi3_life.c", "*lastSuccessfulTime = instance->state.time;", "*lastSuccessfulTime = 1e9;", "3"),
    ("spring", "fmu_derivatives.c", "sum += *seed++ * (adjoint", "sum += *seed++ * (0", "3"),
    ("table", "fmu_derivatives.c", "        seed = seeds;\n", "", "3"),
    ("table", "fmi3_states.h", "(GetFloat64, ANY_MODE)", "(GetFloat64, INITIALIZATION | INITIALIZED)", "3"),
    ("states", "fmu_model_exchange.c", "first_own + OWN_POWER", "first_own + OWN_OMEGA_RATE", "3"),
    ("real-time", "fmu_instance.c", "    if (held->buffers == NULL)\n", "    if (1)\n", "3"),
    ("system", "system_instance.c", "copy_motion(system, state, &instance->before);", "", ""),
    ("system", "system_state.c", "&memory->energy);", "&(double){0.0});", ""),
    ("system", "system_calls3.c", "return instance->state.time;", "return instance->state.time + 1.0;", "3"),
    ("system", "fmu_calls.c", "    fmu_free(c);", "    (void)c;", "3"),
]  # fmt: skip


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the program of each form is built once."""
    program("cc", package="gcc libc6-dev")
    return tmp_path_factory.mktemp("fuzz")


def check_lives(form: str, folder: Path, flags: tuple[str, ...], count: int) -> None:
    folder.mkdir()
    found, counts = run(program_of(form, folder, flags), SEED, count)
    assert found == "", found
    # Every call has been made in every way.
    never = OF_SIMULATION if form.endswith("states") else OF_EXCHANGE if form in ("branches", "system") else set()
    calls = {call: times for call, times in counts.items() if isinstance(times, list)}
    assert {call for call, (done, *_) in calls.items() if done == 0} == never
    assert sum(refused == 0 for _, _, refused in calls.values()) <= 3  # some only without an instance
    assert min(times for call, times in counts.items() if call not in calls) > 0


def test_some_random_lives(folders: Path) -> None:
    check_lives("spring", folders / "some", ADDRESSES, 300)


@pytest.mark.slow
@pytest.mark.parametrize("form", fuzz.FORMS)
def test_random_lives(form: str, folders: Path) -> None:
    check_lives(form, folders / form, SANITIZED, 300 if form == "system" else 1200)


@pytest.mark.slow
@pytest.mark.parametrize(("form", "name", "sound", "faulty", "version"), FAULTS)
def test_planted_faults_are_found(
    form: str, name: str, sound: str, faulty: str, version: str, folders: Path, tmp_path: Path
) -> None:
    flags = ("-O0", *ADDRESSES[1:], "-Wno-error")
    sound_folder = folders / f"{form} plain"
    sound_folder.mkdir(exist_ok=True)
    program_of(form, sound_folder, flags)
    folder = Path(shutil.copytree(sound_folder, tmp_path / "faulty"))
    (file,) = (folder / "sources").rglob(name)
    assert sound in file.read_text(), f"the fault cannot be planted: {name} has changed"
    file.write_text(file.read_text().replace(sound, faulty))
    for made in folder.glob("objects/*_all*.o"):
        if version in ("", "3" if "3" in made.stem else "2"):
            made.unlink()
    found, _ = run(program_of(form, folder, flags), SEED, 12_000)  # to the first find
    assert "It happens with the seed" in found
