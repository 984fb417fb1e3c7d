"""FMUs whose FE is a table: both back ends against the model."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from fmu_tools import Instance, built, check_fmu, instance, wandering_path
from kernel_tools import Kernel
from native_tools import ERROR, Native, library
from springs import TABLE
from strandspring.fmu.checks.check import described_spring
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

BUILDERS: dict[str, Callable[[Path], Path]] = {
    "python": lambda folder: built(folder, TABLE),
    "native": lambda folder: build_native_fmu(ModelFile("spring", TABLE), folder, zero=0.0),
}


@pytest.fixture(params=BUILDERS)
def fmu(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return BUILDERS[request.param](tmp_path)


@pytest.fixture
def spring(fmu: Path, tmp_path: Path) -> Iterator[Instance]:
    with instance(fmu, tmp_path / "unpacked") as one:
        yield one


def close(found: object, expected: object) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_it_is_a_valid_fmu_that_holds_and_shows_the_table(fmu: Path) -> None:
    assert check_fmu(fmu).problems == ()
    description = fmpy.read_model_description(str(fmu))
    assert described_spring(description) == TABLE
    listed = {v.name: v for v in description.modelVariables}
    assert "kE_0" not in listed
    for name, variability, unit in (("FE_knots", "fixed", "m"), ("FE_forces", "tunable", "N")):
        for i in range(10):
            variable = listed[f"{name}_{i}"]
            assert (variable.causality, variable.variability, variable.unit) == ("parameter", variability, unit)
    with zipfile.ZipFile(fmu) as archive:
        page = archive.read("documentation/index.html").decode()
    assert "cubic spline through FE_forces" in page
    assert "kE_i" not in page
    assert page.count("<tr><td>FE_forces_") == 10


@pytest.mark.parametrize("omega_start", [0.0, -0.6])
def test_outputs_are_those_of_the_model(spring: Instance, omega_start: float) -> None:
    path = wandering_path(TABLE, 400, seed=1)
    spring.initialize(displacement=path[0], omega_start=omega_start)
    names = "force", "stiffness", "absorbed_energy", "omega"
    found = [spring.get(*names), *(spring.step(displacement, *names) for displacement in path[1:])]
    model = PathSolver(TABLE)
    along = (model.force, model.stiffness, model.absorbed_energy, model.omega)
    for column, expected in zip(np.array(found).T, along, strict=True):
        close(column, expected(path, omega_start))


def test_forces_can_be_set_and_the_state_keeps_them(spring: Instance) -> None:
    forces = tuple(1.5 * force - 3.0 for force in TABLE.FE_forces)
    spring.initialize(**{f"FE_forces_{i}": force for i, force in enumerate(forces)})
    path = np.array([TABLE.displacement_offset, 0.06, 0.033, 0.075])
    spring.step(path[1])
    state = spring.slave.serializeFMUstate(spring.slave.getFMUstate())
    spring.slave.reset()
    spring.slave.setFMUstate(spring.slave.deSerializeFMUstate(state))
    found = [spring.step(displacement, "force")[0] for displacement in path[2:]]
    close(found, PathSolver(replace(TABLE, FE_forces=forces)).force(path)[2:])


IMPOSSIBLE = {
    "FE_knots_3": (
        0.03,
        "`FE_knots_3` must lie above `FE_knots_2` by 4e-05 m or more, 0.001 of the range",
    ),
    "displacement_max": (0.08, "`FE_knots_9` must be `displacement_max`, 0.08 m, got 0.07."),
    "FE_forces_2": (1e154, "`FE_forces_2` must be within +-1e+15 N, got 1e+154."),
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_an_impossible_table_is_refused(name: str, tmp_path: Path) -> None:
    value, sentence = IMPOSSIBLE[name]
    with Native(library(TABLE)) as one:
        one.enter_initialization()
        one.set(**{name: value})
        assert one.ExitInitializationMode() == ERROR
        assert one.said.startswith(sentence)
    with instance(built(tmp_path, TABLE), tmp_path / "unpacked") as python:
        with pytest.raises(FMICallException):
            python.initialize(**{name: value})
        assert any(sentence in message for _, _, message in python.messages), python.messages


def test_directional_derivatives_by_the_table_are_those_of_the_kernel() -> None:
    path = np.array([TABLE.displacement_offset, 0.06, 0.041, 0.0415])
    of_force, of_stiffness = (gradients[-1] for gradients in Kernel(TABLE).gradients(path))
    with Native(library(TABLE)) as one:
        one.initialize(displacement=path[0])
        for displacement in path[1:]:
            one.step(displacement)
        for i in range(10):
            for name in ("FE_knots", "FE_forces"):
                found = one.derivatives(("force", "stiffness"), **{f"{name}_{i}": 1.0})
                close(found, np.array([getattr(gradient, name)[i] for gradient in (of_force, of_stiffness)]))


def test_where_a_path_starts_moving_it_moves_the_place_only() -> None:
    """In initialization mode omega is given: the derivative by displacement is that of FE and FA alone."""
    at = 0.0587
    with Native(library(TABLE)) as one:
        one.enter_initialization()
        one.set(displacement=at, omega_start=0.4)
        found = one.derivatives(("force",), displacement=1.0)[0]
    _, by_displacement, _ = PathSolver(TABLE).force_with_partials(np.array([at]), np.array([0.4]))
    close([found], by_displacement)
