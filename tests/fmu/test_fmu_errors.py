"""What the Python-backed FMU refuses, how it says so, and that the host survives it."""

from __future__ import annotations

import ast
import json
import math
import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, built, instance, run_python, status_of
from kernel_tools import HERE, build_folder, compiled
from strandspring.core.instance import RefusedCallError
from strandspring.exchange.ssp import ShakenMassValues, write_system
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

# PythonFMU answers every exception so.
FATAL = 4
NOT_FINITE = [math.nan, math.inf, -math.inf]
IMPOSSIBLE = [*NOT_FINITE, 1.001e9]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fmu")


@pytest.fixture(scope="module")
def fmu(folder):
    return built(folder)


@pytest.fixture
def spring(fmu, folder):
    with instance(fmu, folder / "unpacked") as one:
        yield one


def refusals(one):
    """What the messages of PythonFMU say of its own refusals."""
    texts = [text.partition("\n")[2] for text in one.logged(FATAL)]
    assert all(text.startswith(RefusedCallError.__name__) for text in texts)
    return [ast.literal_eval(text.removeprefix(RefusedCallError.__name__)) for text in texts]


@pytest.mark.parametrize("bad", IMPOSSIBLE)
def test_an_impossible_displacement(spring, bad):
    spring.initialize()
    spring.step(0.03)
    spring.set("displacement", 0.035)
    before = spring.get("displacement", "force", "omega")
    assert status_of(spring.set, "displacement", bad) == FATAL
    (said,) = refusals(spring)
    assert said == f"`displacement` must be within +-1e+09 m, got {bad!r}; the previous value is kept."
    assert spring.get("displacement", "force", "omega") == before
    expected = PathSolver(SPRING).force(np.array([0.02, 0.03, 0.01]))[-1]
    assert spring.step(0.01, "force") == [pytest.approx(expected, rel=1e-12)]


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rho", -1.0), ("rho", 0.0), ("rho", 1e-309), ("rho", 1e154), ("kappa_omega", 0.0), ("kappa_omega", 1e154),
        ("sigma", 0.4), ("sigma", -1e308), ("n", 0.0), ("n", 1e3), ("kA_0", 2.0), ("kA_1", -1e3), ("kA_2", 1e300),
        ("kE_2", 1e308), ("displacement_min", 0.06), ("displacement_min", -1e154), ("displacement_max", 0.0),
        ("displacement_offset", 1.0), ("omega_start", 1.0000001), ("omega_start", 1e308),
    ],
)  # fmt: skip
def test_parameters_that_are_not_possible(spring, name, value):
    spring.slave.setupExperiment(startTime=0.0)
    spring.slave.enterInitializationMode()
    good = spring.get(name)[0]
    spring.set("displacement", SPRING.displacement_offset)
    spring.set(name, value)
    for _ in range(3):
        assert status_of(spring.slave.exitInitializationMode) == FATAL
    text = spring.logged(FATAL)[0]
    # FA is judged as a whole: its value over the range is what is wrong.
    assert ("the amplifier FA" if name == "kA_1" else f"`{name}`") in text
    assert "got" in text
    spring.set(name, good)
    spring.slave.exitInitializationMode()
    assert spring.step(0.03, "force") == [
        pytest.approx(PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1], rel=1e-12)
    ]


@pytest.mark.parametrize("bad", NOT_FINITE)
@pytest.mark.parametrize("name", ["rho", "kE_2", "omega_start", "displacement_max"])
def test_parameters_that_are_not_finite(spring, name, bad):
    spring.slave.setupExperiment(startTime=0.0)
    spring.slave.enterInitializationMode()
    good = spring.get(name)
    assert status_of(spring.set, name, bad) == FATAL
    assert refusals(spring) == [f"`{name}` must be finite, got {bad!r}; the previous value is kept."]
    assert spring.get(name) == good


def test_a_fixed_parameter_after_initialization(spring):
    spring.initialize()
    before = spring.step(0.03, "force", "displacement_max")
    assert status_of(spring.set, "displacement_max", 5.0) == FATAL
    assert "`displacement_max` is fixed" in spring.logged(FATAL)[0]
    assert spring.get("force", "displacement_max") == before


def test_values_are_set_all_or_none(spring):
    spring.initialize()
    references = [spring.references[name] for name in ("displacement", "omega_start")]
    assert status_of(spring.slave.setReal, references, [0.04, 0.5]) == FATAL
    assert spring.get("displacement") == [SPRING.displacement_offset]


@pytest.mark.parametrize("name", ["force", "stiffness", "absorbed_energy", "omega"])
def test_what_is_computed_cannot_be_set(spring, name):
    assert status_of(spring.set, name, 1.0) == FATAL
    assert f"`{name}` is calculated" in spring.logged(FATAL)[0]


@pytest.mark.parametrize(
    ("call", "reference", "text"),
    [
        ("getReal", 999, "value reference 999"), ("getReal", 2**32 - 1, "no variable"),
        ("getReal", 4, "`extrapolating`"), ("getInteger", 1, "is Real, not Integer"),
        ("getBoolean", 1, "is Real, not Boolean"), ("getString", 0, "is Real, not String"),
        ("setReal", 999, "value reference 999"), ("setInteger", 0, "is Real, not Integer"),
        ("setBoolean", 4, "is calculated"), ("setString", 0, "is Real, not String"),
    ],
)  # fmt: skip
def test_no_such_variable_or_another_type(spring, call, reference, text):
    value = {"setReal": [1.0], "setInteger": [1], "setBoolean": [True], "setString": ["1"]}.get(call)
    arguments = [[reference]] if value is None else [[reference], value]
    spring.slave.setupExperiment(startTime=0.0)
    spring.slave.enterInitializationMode()
    assert status_of(getattr(spring.slave, call), *arguments) == FATAL
    assert text in spring.logged(FATAL)[0]


@pytest.mark.parametrize("size", [-1e-3, *NOT_FINITE])
def test_steps_backward_and_of_no_finite_size(spring, size):
    spring.initialize()
    before = spring.step(0.03, "force")
    assert status_of(spring.slave.doStep, 1.0, size) == FATAL
    assert repr(size) in spring.logged(FATAL)[0]
    assert spring.get("force") == before


def test_a_step_before_initialization_ends(spring):
    assert status_of(spring.slave.doStep, 0.0, 1e-3) == FATAL
    assert refusals(spring) == ["The step at time 0.0 s was requested before the end of initialization."]


def test_initialization_ends_once(spring):
    spring.initialize()
    spring.step(0.03)
    assert status_of(spring.slave.exitInitializationMode) == FATAL
    assert spring.get("displacement") == [0.03]


def serialized(one) -> dict:
    return json.loads(one.slave.serializeFMUstate(one.slave.getFMUstate()))


def damaged_states(one):
    whole = serialized(one)
    text = json.dumps(whole).encode()
    (memory,), elongations, work, at = whole["memory"]
    return [
        b"",
        b"\x80\x04junk",
        b"[]",
        b"[" * 100_000,
        text[:-1],
        text[: len(text) // 2],
        text + b"}",
        *(
            json.dumps(content).encode()
            for content in (
                {**whole, "format": "other"},
                {**whole, "format_version": 1},
                {**whole, "guid": "{%s%n}"},
                {**whole, "more": 1},
                {key: value for key, value in whole.items() if key != "side"},
                {**whole, "displacement": "0.1"},
                {**whole, "displacement": math.nan},
                {**whole, "energy_wanted": 0},
                {**whole, "side": 2},
                {**whole, "settings": [None]},
                {**whole, "memory": [[memory[:-1]], elongations, work, at]},
                {**whole, "memory": [[[memory[0], 1.5, *memory[2:]]], elongations, work, at]},
                {**whole, "memory": [[[math.inf, *memory[1:]]], elongations, work, at]},
                {**whole, "memory": [[], elongations, work, at]},
                {**whole, "memory": [[memory], [0.0, math.inf], work, at]},
                {**whole, "memory": [[memory], elongations, work]},
                {**whole, "memory": [[memory], elongations, work, at[:-1]]},
                {**whole, "memory": [[memory], elongations, work, [math.nan, *at[1:]]]},
                {**whole, "memory": [[memory], elongations, work, [at[0], 0.5, *at[2:]]]},
            )
        ),
    ]


def test_damaged_states_are_refused(spring):
    spring.initialize()
    spring.step(0.03)
    before = spring.step(0.02, "force")
    for state in damaged_states(spring):
        # What reads it knows no instance that could refuse it.
        damaged = spring.slave.deSerializeFMUstate(state)
        assert status_of(spring.slave.setFMUstate, damaged) == FATAL, state[:80]
        spring.slave.freeFMUstate(damaged)
        assert "serialized state" in spring.messages[-1][2]
    assert spring.get("force") == before


def test_states_with_damaged_values_are_refused(spring):
    spring.initialize()
    before = spring.step(0.03, "force")
    whole = serialized(spring)
    for settings in (whole["settings"][:-1], [-1.0] * len(whole["settings"])):
        state = spring.slave.deSerializeFMUstate(json.dumps({**whole, "settings": settings}).encode())
        assert status_of(spring.slave.setFMUstate, state) == FATAL
    assert spring.get("force") == before


def test_the_state_of_another_fmu_is_refused(spring, tmp_path):
    spring.initialize()
    with instance(built(tmp_path, OTHER), tmp_path / "unpacked") as other:
        other.initialize()
        state = other.slave.serializeFMUstate(other.slave.getFMUstate())
        assert status_of(spring.slave.setFMUstate, spring.slave.deSerializeFMUstate(state)) == FATAL
        assert "of another one" in spring.messages[-1][2]
        assert status_of(spring.slave.setFMUstate, other.slave.getFMUstate()) == FATAL


def test_absurd_displacements_do_no_harm(spring):
    spring.initialize()
    for displacement in (1e9, -1e9, 1e6, 0.03):
        spring.step(displacement, "force", "stiffness", "omega", "absorbed_energy")
    state = spring.slave.serializeFMUstate(spring.slave.getFMUstate())
    spring.slave.setFMUstate(spring.slave.deSerializeFMUstate(state))
    assert math.isfinite(spring.get("force")[0])


MANY_FATALS = """
import gc, math, sys
from pathlib import Path
from fmu_tools import instance, status_of
with instance(Path(sys.argv[1]), Path(sys.argv[2])) as one, instance(Path(sys.argv[1]), Path(sys.argv[2])) as two:
    s = one.slave
    def wrong():
        yield s.getReal, [999]
        yield s.setInteger, [0], [1]
        yield s.setReal, [1], [1.0]
        yield s.getString, [0]
        yield s.setFMUstate, s.deSerializeFMUstate(b"x")
        yield s.exitInitializationMode,
    one.set("rho", -1.0)
    for _ in range(20):
        for call in wrong():
            assert status_of(*call) == 4, call
        gc.collect()
    s.reset()
    one.initialize()
    two.initialize()
    for _ in range(20):
        for call in wrong():
            assert status_of(*call) == 4, call
        assert status_of(one.set, "displacement", math.nan) == 4
        gc.collect()
    print(one.step(0.03, "force") == two.step(0.03, "force"))
for _ in range(5):
    with instance(Path(sys.argv[1]), Path(sys.argv[2])) as again:
        again.initialize()
        again.step(0.03, "force")
    gc.collect()
print("alive")
"""


def test_the_host_survives_many_errors(fmu, tmp_path):
    lines = run_python(MANY_FATALS, fmu, tmp_path / "unpacked").split("\n")
    assert lines[0].startswith("True")
    assert lines[1] == "alive"


END = """
import atexit, sys
from pathlib import Path
from fmu_tools import instance
with instance(Path(sys.argv[1]), Path(sys.argv[2])) as one:
    one.slave.terminate()
if sys.argv[3] == "without":
    atexit._clear()
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the binary for Windows frees its state once")
@pytest.mark.parametrize(("care", "status"), [("with", 0), ("without", 86)])
@pytest.mark.parametrize("slave", ["spring", "plant"])
def test_the_end_of_the_process_frees_nothing_twice(fmu, tmp_path, slave, care, status):
    preloaded = compiled(build_folder() / "freed_twice.so", "-O1", "-shared", "-fPIC", HERE / "freed_twice.c")
    system = write_system(tmp_path / "s.ssp", fmu, ModelFile("spring", SPRING), ShakenMassValues(1.0, 0.0, 0.0, 1.0))
    with zipfile.ZipFile(system) as archive:
        file = archive.extract(f"resources/{slave}.fmu", tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", END, file, str(tmp_path / "unpacked"), care],
        capture_output=True, text=True, cwd=HERE, env={**os.environ, "LD_PRELOAD": str(preloaded)}, timeout=120,
        check=False,
    )  # fmt: skip
    assert done.returncode == status, done.stderr
