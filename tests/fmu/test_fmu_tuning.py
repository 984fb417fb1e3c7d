"""Tunable parameters: from the next commit on, with omega carried on; the same on both back ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmu_tools import SPRING, Instance, built, instance, status_of, wandering_path
from springs import TABLE
from strandspring import SpringParameters
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

BUILDERS: dict[str, Callable[[Path, SpringParameters], Path]] = {
    "python": built,
    "native": lambda folder, spring: build_native_fmu(ModelFile("spring", spring), folder, zero=0.0),
}
OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")
# Each with the field of the parameters that it changes.
CHANGES = {
    "kappa_omega": {"kappa_omega": 1.3 * SPRING.kappa_omega},
    "rho": {"rho": 0.6 * SPRING.rho},
    "sigma": {"sigma": 2.0},
    "n": {"n": 1.4},
    "kE": {"kE": (SPRING.kE[0] + 5.0, 0.9 * SPRING.kE[1], *SPRING.kE[2:])},
    "kA": {"kA": (1.0, 1.1 * SPRING.kA[1], *SPRING.kA[2:])},
    "all": {"kappa_omega": 1.3 * SPRING.kappa_omega, "rho": 0.6 * SPRING.rho, "sigma": 2.0, "n": 1.4},
}


@pytest.fixture(params=BUILDERS)
def builder(request: pytest.FixtureRequest) -> Callable[[Path, SpringParameters], Path]:
    return BUILDERS[request.param]


def flat(changes: dict[str, object]) -> dict[str, float]:
    """Values by the FMU's names."""
    values: dict[str, float] = {}
    for name, value in changes.items():
        values |= {f"{name}_{i}": v for i, v in enumerate(value)} if isinstance(value, tuple) else {name: value}
    return values


def tune(one: Instance, **values: float) -> int:
    return status_of(one.slave.setReal, [one.references[name] for name in values], list(values.values()))


def expected(before: SpringParameters, after: SpringParameters, path: np.ndarray, change: int) -> np.ndarray:
    """Force, stiffness, absorbed energy and omega along a path on which the parameters change at a sample."""
    first, second = PathSolver(before), PathSolver(after)
    start = first.omega(path[: change + 1])[-1]
    parts = []
    for solver, piece, omega in ((first, path[: change + 1], 0.0), (second, path[change:], start)):
        parts.append(
            [law(piece, omega) for law in (solver.force, solver.stiffness, solver.absorbed_energy, solver.omega)]
        )
    early, late = parts
    late[2] = late[2] + early[2][-1]
    return np.array([np.concatenate([a[1:], b[1:]]) for a, b in zip(early, late, strict=True)]).T


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("change", [20, 40, 77])
def test_a_change_acts_from_the_committed_point_on(
    builder: Callable[..., Path], changes: dict[str, object], change: int, tmp_path: Path
) -> None:
    path = wandering_path(SPRING, 120, seed=3)
    with instance(builder(tmp_path, SPRING), tmp_path / "unpacked") as one:
        one.initialize()
        found = []
        for k, displacement in enumerate(path[1:], start=1):
            if k == change + 1:
                assert tune(one, **flat(changes)) == 0
            found.append(one.step(float(displacement), *OUTPUTS))
    wanted = expected(SPRING, replace(SPRING, **changes), path, change)
    # A table of another n or sigma inverts omega to 1e-12.
    assert np.max(np.abs(found - wanted) / np.abs(wanted).max(axis=0)) <= 1e-10


def test_values_as_they_are_change_no_bit(builder: Callable[..., Path], tmp_path: Path) -> None:
    """Fixed ones among them, which OpenModelica sets between steps before its version of August 2026."""
    path = wandering_path(SPRING, 60, seed=4)
    fmu = builder(tmp_path, SPRING)
    runs = []
    for touched in (False, True):
        with instance(fmu, tmp_path / "unpacked") as one:
            one.initialize()
            names = [v.name for v in one.description.modelVariables if v.causality == "parameter"]
            values = dict(zip(names, one.get(*names), strict=True))
            runs.append([])
            for displacement in path[1:]:
                if touched:
                    assert tune(one, **values) == 0
                runs[-1].append(one.step(float(displacement), *OUTPUTS))
    assert runs[0] == runs[1]


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"rho": -1.0}, "`rho` must be > 0 [1/m], got -1.0"),
        ({"kappa_omega": 50.0, "sigma": 0.4}, "`sigma` must be within [0.5, 1000], got 0.4"),
        ({"n": float("nan")}, "`n` must be finite, got nan"),
        ({"kA_0": 2.0}, "`kA_0` is fixed after initialization"),
        ({"kA_1": -1e3}, "the amplifier FA (coefficients `kA`) must be > 0"),
        ({"displacement": 0.04, "omega_start": 0.5}, "`omega_start` is fixed after initialization"),
        ({"rho": 50.0, "displacement_max": 0.06}, "`displacement_max` is fixed after initialization"),
    ],
)
def test_an_impossible_set_leaves_everything_as_it_was(
    builder: Callable[..., Path], values: dict[str, float], text: str, tmp_path: Path
) -> None:
    with instance(builder(tmp_path, SPRING), tmp_path / "unpacked") as one:
        one.initialize()
        before = one.step(0.03, *OUTPUTS, *values)
        state = one.slave.serializeFMUstate(one.slave.getFMUstate())
        assert tune(one, **values) > 1
        assert any(text in message for _, _, message in one.messages), one.messages
        assert one.get(*OUTPUTS, *values) == before
        assert one.slave.serializeFMUstate(one.slave.getFMUstate()) == state
        assert one.step(0.01, "force") == pytest.approx(PathSolver(SPRING).force(np.array([0.02, 0.03, 0.01]))[-1:])


def test_forces_of_a_table_are_tunable(builder: Callable[..., Path], tmp_path: Path) -> None:
    stiffer = replace(TABLE, FE_forces=tuple(1.2 * force for force in TABLE.FE_forces))
    path = np.linspace(TABLE.displacement_offset, TABLE.displacement_max, 9)
    with instance(builder(tmp_path, TABLE), tmp_path / "unpacked") as one:
        one.initialize()
        one.step(float(path[4]), "force")
        assert tune(one, **flat({"FE_forces": stiffer.FE_forces})) == 0
        found = one.step(float(path[-1]), *OUTPUTS)
    np.testing.assert_allclose(found, expected(TABLE, stiffer, path, 4)[-1], rtol=1e-9)


def test_a_saved_state_keeps_the_parameters(builder: Callable[..., Path], tmp_path: Path) -> None:
    with instance(builder(tmp_path, SPRING), tmp_path / "unpacked") as one:
        one.initialize()
        one.step(0.03)
        tune(one, rho=50.0, n=1.0)
        state = one.slave.getFMUstate()
        wanted = one.step(0.04, *OUTPUTS)
        tune(one, rho=80.0, n=0.5)
        one.step(0.01)
        one.slave.setFMUstate(state)
        assert one.get("rho", "n") == [50.0, 1.0]
        assert one.step(0.04, *OUTPUTS) == wanted
        one.slave.freeFMUstate(state)
