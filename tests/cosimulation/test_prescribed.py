"""`simulate_fmu`: the spring's answers to a displacement, row by row at the same time."""

from __future__ import annotations

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from fmu_tools import SPRING, built, wandering_path
from strandspring import Spring, simulate_fmu
from strandspring.cosimulation import CosimulationError

# The same closed form in C and in Python, stroke by stroke: rounding of the mathematics libraries.
RTOL = 1e-12


@pytest.fixture(scope="module", params=["native", "python"])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    if request.param == "native":
        return request.getfixturevalue("native_fmu")
    return built(tmp_path_factory.mktemp("python"))


def test_every_row_is_the_model_at_that_displacement(fmu: Path) -> None:
    path = wandering_path(SPRING, 400, seed=8)
    time = 3.0 + np.cumsum(np.random.default_rng(8).uniform(1e-4, 1e-2, path.size))
    motion, spring = simulate_fmu(fmu, path, time), Spring(SPRING)
    np.testing.assert_array_equal(motion.time, time)
    np.testing.assert_array_equal(motion.displacement, path)
    for found, expected in (
        (motion.force, spring.response(path)),
        (motion.stiffness, spring.stiffness(path)),
        (motion.absorbed_energy, spring.absorbed_energy(path)),
    ):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=RTOL * np.abs(expected).max())


def test_time_does_not_matter_and_may_be_left_out(fmu: Path) -> None:
    path = wandering_path(SPRING, 60, seed=2).tolist()
    slow, default = simulate_fmu(fmu, path, 10.0 * np.arange(len(path))), simulate_fmu(fmu, path)
    np.testing.assert_array_equal(slow.force, default.force)
    np.testing.assert_allclose(default.time, 1e-3 * np.arange(len(path)), rtol=1e-15)


def test_fmpys_rows_are_one_step_late(fmu: Path) -> None:
    # The trap that simulate_fmu is there for, with FMPy's function of the same name.
    path = wandering_path(SPRING, 60, seed=3)
    time = 2.0**-10 * np.arange(path.size)
    table = np.rec.fromarrays([time, path], names="time,displacement")
    late = fmpy.simulate_fmu(
        str(fmu), fmi_type="CoSimulation", stop_time=time[-1], output_interval=time[1], input=table,
        output=["displacement", "force"],
    )  # fmt: skip
    np.testing.assert_array_equal(late["force"][1:], simulate_fmu(fmu, path).force[:-1])


def test_parameters_replace_those_of_the_model(fmu: Path) -> None:
    path = [0.02, 0.03, 0.015]
    changed = simulate_fmu(fmu, path, parameters={"omega_start": 0.3})
    np.testing.assert_allclose(changed.force, Spring(SPRING).response(path, 0.3), rtol=RTOL)


@pytest.mark.parametrize(
    ("displacement", "time", "sentence"),
    [
        ([0.0, np.nan], None, "`displacement` must be finite [m], got nan at index 1"),
        ([], None, "K >= 1, got shape (0,)"),
        ([0.0, 0.01], [0.0, 1.0, 2.0], "`time` must have the shape (2,) of `displacement`, got (3,)"),
        ([0.0, 0.01], [0.0, np.inf], "`time` must be finite [s]"),
        ([0.0, 0.01, 0.02], [0.0, 1.0, 1.0], "`time` must rise [s], got 1.0 after 1.0 at index 2"),
    ],
)
def test_what_cannot_be_a_path_is_refused(
    native_fmu: Path, displacement: list[float], time: list[float] | None, sentence: str
) -> None:
    with pytest.raises(ValueError, match="must") as refused:
        simulate_fmu(native_fmu, displacement, time)
    assert sentence in str(refused.value)


def test_what_is_not_a_spring_fmu_is_refused(native_fmu: Path) -> None:
    with pytest.raises(CosimulationError, match="cannot be read as an FMU"):
        simulate_fmu(__file__, [0.0])
    with pytest.raises(CosimulationError, match="has no parameter `stiffness`"):
        simulate_fmu(native_fmu, [0.0], parameters={"stiffness": 1.0})


def test_the_fmus_page_says_how_tools_sample_the_displacement(fmu: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        page = archive.read("documentation/index.html").decode("utf-8")
    assert "one step late" in page
    assert f'strandspring.simulate_fmu("{fmu.name}", displacement)' in page
