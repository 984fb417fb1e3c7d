"""`simulate_fmu`: the spring's answers to a displacement, row by row at the same time."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from fmu_tools import SPRING, built, wandering_path
from springs import TABLE
from strandspring import Spring, simulate_fmu
from strandspring.core.parameters import SpringParameters
from strandspring.cosimulation import CosimulationError, FmuSpring
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.model.modelfile import ModelFile

# The same closed form in C and in Python, stroke by stroke: rounding of the mathematics libraries.
RTOL = 1e-12
# Wandering paths leave the identified range on purpose.
leaves_the_range = pytest.mark.filterwarnings("ignore:`displacement` must be within the identified range")


def native(folder: Path, spring: SpringParameters = SPRING, **form: Any) -> Path:
    form.setdefault("arrays", form.get("fmi") == 3)
    return build_native_fmu(ModelFile("spring", spring), folder, chosen_platforms("host"), zero=0.0, **form)


@pytest.fixture(scope="module", params=["native", "native by FMI 3.0", "python"])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    if request.param == "native":
        return request.getfixturevalue("native_fmu")
    if request.param == "native by FMI 3.0":
        return native(tmp_path_factory.mktemp("fmi3"), fmi=3)
    return built(tmp_path_factory.mktemp("python"))


@leaves_the_range
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


def test_rows_outside_the_identified_range_are_counted_in_a_warning(fmu: Path) -> None:
    low, high = SPRING.displacement_min, SPRING.displacement_max
    simulate_fmu(fmu, [low, 1.001 * high, low])  # warnings are errors here
    with pytest.warns(UserWarning, match=r"identified range.* at index 1: in 2 of 4 rows the force is extrapolated"):
        motion = simulate_fmu(fmu, [low, 2.0 * high - low, high, 2.0 * low - high])
    np.testing.assert_allclose(motion.force, Spring(SPRING).response(motion.displacement), rtol=1e-9)


@leaves_the_range
def test_time_does_not_matter_and_may_be_left_out(fmu: Path) -> None:
    path = wandering_path(SPRING, 60, seed=2).tolist()
    slow, default = simulate_fmu(fmu, path, 10.0 * np.arange(len(path))), simulate_fmu(fmu, path)
    np.testing.assert_array_equal(slow.force, default.force)
    np.testing.assert_allclose(default.time, 1e-3 * np.arange(len(path)), rtol=1e-15)


@leaves_the_range
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


@pytest.mark.parametrize("spring", [SPRING, TABLE], ids=["polynomial", "table"])
@leaves_the_range
def test_fmi_3_gives_the_bits_of_fmi_2(spring: SpringParameters, tmp_path: Path) -> None:
    path, changes = wandering_path(spring, 300, seed=11), {"rho": 1.2 * spring.rho, "omega_start": -0.4}
    arrays = {"kA": (1.0, *(0.9 * value for value in spring.kA[1:]))}
    arrays["FE_forces" if spring.FE_forces else "kE"] = [1.1 * v for v in spring.FE_forces or spring.kE]
    elements = {f"{name}_{i}": value for name, values in arrays.items() for i, value in enumerate(values)}
    time = 3.0 + np.cumsum(np.random.default_rng(8).uniform(1e-4, 1e-2, path.size))
    before, after = native(tmp_path, spring), native(tmp_path, spring, fmi=3)
    for by_elements, by_arrays in (({}, {}), (changes | elements, changes | arrays)):
        found = simulate_fmu(after, path, time, by_arrays)
        for name, expected in vars(simulate_fmu(before, path, time, by_elements)).items():
            np.testing.assert_array_equal(getattr(found, name), expected, err_msg=name)


@pytest.mark.parametrize(
    ("fmi", "parameters", "sentence"),
    [
        (3, {"kE": [1.0, 2.0]}, "`kE` must be an array of 4 numbers, got the shape (2,)"),
        (3, {"kE": 1.0}, "`kE` must be an array of 4 numbers, got the shape ()"),
        (
            3,
            {"kE_1": 1.0},
            "has no parameter `kE_1`; it is an element of the array `kE`: give that with",
        ),
        (2, {"kE": [1.0, 2.0, 3.0, 4.0]}, "its elements are parameters: give `kE_0` and so on"),
        (2, {"rho": [1.0]}, "`rho` must be a number, got the shape (1,)"),
        (3, {"rho": "stiff"}, "`rho` must be a number, got 'stiff'"),
        (3, {"kA": [2.0, 1.0, 1.0]}, "fmi3ExitInitializationMode failed. `kA_0` must be 1"),
        (3, {"rho": np.nan}, "fmi3SetFloat64 failed. `rho` must be finite, got nan"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(
    fmi: int, parameters: dict[str, Any], sentence: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    fmu = native(tmp_path, fmi=fmi)
    with pytest.raises(CosimulationError) as refused:
        simulate_fmu(fmu, [0.02, 0.03], parameters=parameters)
    assert sentence in str(refused.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("fmi", [2, 3])
def test_other_forms_are_refused_with_their_option(fmi: int, tmp_path: Path) -> None:
    with pytest.raises(CosimulationError, match=r"has no co-simulation: build it without `states=True`"):
        simulate_fmu(native(tmp_path, fmi=fmi, with_states=True), [0.02])
    lean = native(tmp_path, fmi=fmi, real_time=True, no_energy=True)
    with pytest.raises(CosimulationError, match=r"has no output `absorbed_energy`: build it without `no_energy=True`"):
        simulate_fmu(lean, [0.02])


def test_a_spring_answers_alike_in_both_versions_of_fmi(tmp_path: Path) -> None:
    answers = []
    for fmi in (2, 3):
        with FmuSpring(native(tmp_path, fmi=fmi)) as spring:
            found = [spring.start(0.02, 2.0), spring.trial(0.03)]
            with spring.rollback():
                found.append(spring.commit(2.0, 0.1, 0.025))
            found += [spring.trial(0.03), spring.commit(2.0, 0.1, 0.2)]
            answers.append([found, list(spring.messages)])
    assert answers[0] == answers[1]
    (found, messages), _ = answers
    assert found[1] == found[3]
    assert "identified range" in messages[0]  # one excursion


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
