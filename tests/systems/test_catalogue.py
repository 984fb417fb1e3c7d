"""Mounts from a catalogue: their loops have the stated stiffness and damping, and what is not stated is said."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from strandspring import SpringParameters, isolate_system, simulate
from strandspring.errors import MountedSystemError
from strandspring.examples.system_models import SYSTEMS
from strandspring.kernel.path import PathSolver
from strandspring.loops.loop import steady_loop
from strandspring.model.modelfile import ModelFile
from strandspring.vibration.bodies.parts import Tolerance, scaled
from strandspring.vibration.catalogue.catalogue_spring import CatalogueValues, spring_from_catalogue
from strandspring.vibration.description.named_files import HeldFiles
from strandspring.vibration.description.system_file import SystemFile, system_of_content

LINEAR = {"stiffness": "45 N/mm", "loss_factor": 0.3, "amplitude": "5 mm", "stroke": "20 mm"}
POINTS = [["2 mm", "90 N"], ["5 mm", "200 N"], ["10 mm", "310 N"], ["15 mm", "500 N"], ["20 mm", "1000 N"]]
CURVE = {"curve": POINTS, "symmetric": True, "loss_factor": 0.3, "amplitude": "5 mm", "stroke": "20 mm"}
ONE_SIDED = {"curve": POINTS, "amplitude": "4 mm", "about": "9 mm", "stroke": ["0 mm", "20 mm"]}


def content(catalogue: Any, mass: str = "8 kg", **of_axis: Any) -> dict[str, Any]:
    """A mass on one mount along z, which it compresses by its weight."""
    return {
        "format": "strandspring-system",
        "format_version": 1,
        "name": "mass",
        "body": [{"name": "mass", "mass": mass, "motion": {"axis": "z"}}],
        "mount_type": {"rope": {"axes": [{"direction": "-z", "catalogue": catalogue, **of_axis}]}},
        "mount": [{"name": "foot", "type": "rope", "place": ["0 m", "0 m", "0 m"]}],
        "case": [
            {
                "name": "shock",
                "pulse": "half-sine",
                "peak": "2 g",
                "duration": "11 ms",
                "direction": "+z",
                "simulate": "0.2 s",
            }
        ],
    }


def described(table: Mapping[str, Any]) -> SystemFile:
    return system_of_content(table, HeldFiles({}, {}))


def spring_of(catalogue: Mapping[str, Any]) -> SpringParameters:
    ((_, system),) = described(content(catalogue)).candidates
    return system.mounts[0].axes[0].spring


def without(table: Mapping[str, Any], *keys: str) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key not in keys}


def elastic_force(spring: SpringParameters) -> Callable[[Any], Any]:
    """FE of the parameters by SciPy."""
    if spring.FE_knots:
        return CubicSpline(spring.FE_knots, spring.FE_forces, bc_type="not-a-knot")
    return np.polynomial.Polynomial(spring.kE)


def integrated_loop(spring: SpringParameters, about: float, amplitude: float) -> tuple[float, float, float]:
    """Secant stiffness, loss factor and width in the middle of the fifth loop, by the ODE of paper eq. (11)."""
    elastic, amplifier = elastic_force(spring), np.polynomial.Polynomial(spring.kA)

    def slopes(way: float, state: Any, start: float, sense: float) -> list[float]:
        omega, x = state[0], start + sense * way
        bracket = spring.sigma * np.sign(sense) * np.sign(omega) - spring.sigma + 1.0
        force = elastic(x) + spring.kappa_omega * omega * amplifier(x)
        return [sense * spring.rho * (1.0 - bracket * abs(omega) ** spring.n), sense * force]

    low, high, omega = about - amplitude, about + amplitude, 0.0
    for _ in range(5):
        ends, middles, work = [], [], 0.0
        for start, sense in ((low, 1.0), (high, -1.0)):
            stroke = solve_ivp(
                slopes, (0.0, 2.0 * amplitude), [omega, 0.0], "DOP853", t_eval=[amplitude, 2.0 * amplitude],
                args=(start, sense), rtol=1e-11, atol=1e-13, max_step=0.02 * amplitude,
            )  # fmt: skip
            middles.append(elastic(about) + spring.kappa_omega * stroke.y[0, 0])
            omega, stroke_work = stroke.y[:, 1]
            work += stroke_work
            ends.append(elastic(start + 2.0 * sense * amplitude) + spring.kappa_omega * omega)
    secant = (ends[0] - ends[1]) / (2.0 * amplitude)
    return secant, work / (math.pi * secant * amplitude**2), middles[0] - middles[1]


@pytest.mark.parametrize(
    ("catalogue", "secant", "loss", "width"),
    [
        (LINEAR, 45e3, 0.3, None),
        ({**without(LINEAR, "loss_factor"), "damping_ratio": "15 %"}, 45e3, 0.3, None),
        ({**LINEAR, "vibration_stiffness": "80 N/mm"}, 45e3, 0.3, None),
        ({**without(LINEAR, "loss_factor"), "loop_width": "60 N"}, 45e3, None, 60.0),
        ({**without(LINEAR, "loss_factor"), "loop_width": "20 %"}, 45e3, None, 0.2 * 45e3 * 0.010),
        ({**LINEAR, "about": "3 mm", "stroke": ["-2 mm", "0.5 in"]}, 45e3, 0.3, None),
        (CURVE, None, 0.3, None),
        ({**without(CURVE, "loss_factor"), "loop_width": "0.06 kN"}, None, None, 60.0),
        ({**CURVE, "vibration_stiffness": "200 N/mm"}, None, 0.3, None),
        ({**ONE_SIDED, "damping_ratio": 0.1}, None, 0.2, None),
    ],
)
def test_the_loop_at_the_stated_amplitude_is_the_stated_one(
    catalogue: dict[str, Any], secant: float | None, loss: float | None, width: float | None
) -> None:
    spring = spring_of(catalogue)
    about, amplitude = (1e-3 * float(catalogue.get(key, "0 mm").split()[0]) for key in ("about", "amplitude"))
    found = integrated_loop(spring, about, amplitude)
    for value, stated in zip(found, (secant, loss, width), strict=True):
        if stated is not None:
            assert value == pytest.approx(stated, rel=1e-7)  # what five cycles of integration leave


@pytest.mark.parametrize("catalogue", [CURVE, {**ONE_SIDED, "loop_width": "30 N"}])
def test_a_static_curve_runs_through_its_points_and_rises(catalogue: dict[str, Any]) -> None:
    spring = spring_of(catalogue)
    stated = [(1e-3 * float(x.split()[0]), float(force.split()[0])) for x, force in [("0 mm", "0 N"), *POINTS]]
    if catalogue is CURVE:
        stated += [(-x, -force) for x, force in stated]
    deflections, forces = np.array(sorted(set(stated))).T
    middle, _, _ = PathSolver(spring).force_with_partials(deflections, np.zeros_like(deflections))
    np.testing.assert_allclose(middle, forces, rtol=1e-12, atol=1e-10)
    places = np.linspace(deflections[0], deflections[-1], 4001)
    assert (np.diff(elastic_force(spring)(places)) > 0.0).all()
    assert (spring.displacement_min, spring.displacement_max) == (deflections[0], 0.02)


def test_small_vibration_has_the_stated_stiffness() -> None:
    for catalogue, stiffness in ((LINEAR, 80.0), (LINEAR, 300.0), (CURVE, 200.0)):
        spring = spring_of({**catalogue, "vibration_stiffness": f"{stiffness} N/mm"})
        figures = steady_loop(PathSolver(spring), -1e-8, 1e-8).figures
        assert figures.secant_stiffness == pytest.approx(1e3 * stiffness, rel=1e-4)  # of a loop of +-0.01 um


def test_friction_builds_up_over_a_fifth_of_the_amplitude_unless_stated() -> None:
    spring = spring_of(LINEAR)
    assert (spring.n, spring.sigma, spring.kA) == (1.0, 0.5, (1.0,))
    assert spring.rho == pytest.approx(1.0 / (0.2 * 0.005), rel=1e-12)


@settings(max_examples=200, deadline=None)
@given(
    st.floats(-2, 9), st.floats(-6, 0), st.floats(1e-4, 3), st.none() | st.floats(-0.5, 3), st.floats(1, 50),
    st.booleans(),
)  # fmt: skip
def test_values_make_a_spring_of_that_loop_or_are_refused(
    stiffness: float, amplitude: float, loss: float, ratio: float | None, reach: float, is_share: bool
) -> None:
    K, A = 10**stiffness, 10**amplitude
    values = CatalogueValues(
        A, (-reach * A, reach * A), K, vibration_stiffness=None if ratio is None else K * 10**ratio,
        **{"loop_share" if is_share else "loss_factor": loss},
    )  # fmt: skip
    try:
        spring = spring_from_catalogue(values)
    except MountedSystemError as problem:
        refusal = str(problem)
    else:
        refusal = ""
    if refusal:
        assert refusal.startswith(("`vibration_stiffness` must", "the damping must"))
        return
    assert spring.kE[1] > 0.0
    figures = steady_loop(PathSolver(spring), -A, A).figures
    assert figures.secant_stiffness == pytest.approx(K, rel=1e-9)
    if not is_share:
        assert figures.loss_factor == pytest.approx(loss, rel=1e-6)  # energy is a small difference at small rho*A


@pytest.mark.parametrize(
    ("catalogue", "message"),
    [
        ({**LINEAR, "stiffness": 45000}, "catalogue.stiffness: must be a stiffness with its unit, such as"),
        ({**LINEAR, "stiffness": "45 N"}, "catalogue.stiffness: must be a stiffness .* which is a force"),
        ({**LINEAR, "stiffness": "-45 N/mm"}, "catalogue.stiffness: must be a stiffness > 0"),
        ({**LINEAR, "amplitude": 0.005}, "catalogue.amplitude: must be a length with its unit"),
        ({**LINEAR, "amplitude": "30 mm"}, "catalogue: `amplitude` must leave the loop within the stroke of -20 to 20"),
        ({**LINEAR, "stroke": 0.02}, "catalogue.stroke: must be a length with its unit"),
        ({**LINEAR, "stroke": ["2 mm", "20 mm"]}, "catalogue: `stroke` must hold 0 mm"),
        ({**LINEAR, "stroke": "-20 mm"}, "catalogue.stroke: must be > 0 mm"),
        ({**LINEAR, "loss_factor": "0.3 N"}, "catalogue.loss_factor: must be a share"),
        ({**LINEAR, "loss_factor": 30}, "catalogue.loss_factor: must be a share > 0 and below 10"),
        ({**LINEAR, "loss_factor": 1.0}, "catalogue: the damping must be less: .* a loss factor up to 0.955"),
        ({**LINEAR, "damping_ratio": 0.1}, "catalogue: must have either `loss_factor` or `damping_ratio`"),
        ({**LINEAR, "loop_width": "30 N"}, "catalogue: must have one of `loss_factor`, .* `loop_width`"),
        (without(LINEAR, "loss_factor"), "catalogue: must have one of `loss_factor`"),
        ({**without(LINEAR, "loss_factor"), "loop_width": 30}, "catalogue.loop_width: must be a force with its unit"),
        ({**LINEAR, "curve": POINTS}, "catalogue: must have either `stiffness` or `curve`"),
        (without(LINEAR, "stiffness"), "catalogue: must have either `stiffness` or `curve`"),
        (without(LINEAR, "amplitude"), "catalogue.amplitude: is missing"),
        ({**LINEAR, "vibration_stiffness": "46 N/mm"}, "`vibration_stiffness` must be within 65.78 to .* got 46 N/mm"),
        ({**LINEAR, "stiffness": "1e30 N/mm"}, "catalogue: these values make no spring .* correct them"),
        ({**CURVE, "symmetric": False}, "catalogue: `stroke` must lie within `curve`, 0 to 20 mm"),
        ({**CURVE, "curve": [[0.002, 90], [0.02, 900]]}, "catalogue.curve: must be a length with its unit"),
        ({**CURVE, "curve": [["2 mm", "90 N"], ["20 mm", 900]]}, "catalogue.curve: must be a force with its unit"),
        ({**CURVE, "curve": [["20 mm", "900 N"]]}, "catalogue.curve: must have 2 to 25 points, got 1"),
        ({**CURVE, "curve": [["20 mm", "900 N", "1 N"]]}, "catalogue.curve: must be a list of points"),
        ({**CURVE, "curve": [["9 mm", "90 N"], ["20 mm", "80 N"]]}, "`curve` must have forces that rise"),
        ({**CURVE, "curve": [["-9 mm", "-90 N"], ["20 mm", "80 N"]]}, "`curve` must have deflections of one sign"),
        ({**CURVE, "curve": [["9 mm", "90 N"], ["9.001 mm", "91 N"], ["20 mm", "92 N"]]}, "0.1% of the stroke apart"),
        ({**CURVE, "curve": [["1 mm", "900 N"], ["1.1 mm", "901 N"], ["20 mm", "905 N"]]}, "bends too sharply near"),
        ({**CURVE, "curve": [[f"{k} mm", f"{k} N"] for k in range(1, 21)]}, "at most 25 points over the stroke, .* 41"),
        ({**LINEAR, "speed": "1 m/s"}, "catalogue: 'speed' is not a key here"),
    ],
)  # fmt: skip
def test_what_makes_no_spring_is_refused(catalogue: dict[str, Any], message: str) -> None:
    with pytest.raises(MountedSystemError, match=rf"^mount_type\.rope\.axes\[1\]\..*{message}"):
        spring_of(catalogue)


def test_an_axis_has_a_model_or_a_catalogue() -> None:
    files = HeldFiles({"rope.json": ModelFile("rope", spring_of(LINEAR))}, {})
    for of_axis in ({}, {"model": "rope.json", "catalogue": LINEAR}):
        table = content(LINEAR)
        table["mount_type"]["rope"]["axes"] = [{"direction": "-z", **of_axis}]
        with pytest.raises(MountedSystemError, match=r"axes\[1\]: must have either `model`, .* or `catalogue`"):
            system_of_content(table, files)
    with pytest.raises(MountedSystemError, match="rated_load: must be a force with its unit"):
        described(content(LINEAR, rated_load=300))


def test_verdicts_say_what_no_catalogue_states() -> None:
    source = {**LINEAR, "source": "WR8, page 3"}
    answers = {
        rated: simulate(described(content(source, rated_load=rated))).candidates[0] for rated in ("78 N", "79 N")
    }
    texts = {rated: "\n".join(answer.cautions) for rated, answer in answers.items()}
    for text in texts.values():
        assert "No loops stand behind catalogue values of WR8, page 3: away from" in text
        assert "-z is stated at +-5 mm" in text
    assert "foot under 78.45 N of 78 N" in texts["78 N"]  # 8 kg of 9.80665 N
    assert "rated" not in texts["79 N"]
    ((_, system),) = described(content(LINEAR)).candidates
    assert system.mounts[0].axes[0].model == "catalogue values of rope, -z"


def test_a_swing_far_from_the_stated_amplitude_is_a_caution() -> None:
    def caution(peak: str) -> str:
        table = content(LINEAR)
        table["case"][0]["peak"] = peak
        (answer,) = simulate(described(table)).answers
        low, high = answer.runs[0].figures.displacement_low[0], answer.runs[0].figures.displacement_high[0]
        assert (abs(math.log(0.5 * (high - low) / 0.005)) > math.log(2.0)) == (peak != "8 g")
        return "\n".join(sentence.text for sentence in answer.cautions if sentence.kind.value == "catalogue")

    assert "foot by +-" in caution("1 g")
    assert caution("8 g") == ""


def test_beyond_the_stated_stroke_all_is_extrapolated() -> None:
    table = content({**LINEAR, "stroke": "6 mm"})
    table["case"][0]["peak"] = "30 g"
    assert [answer.verdict.value for answer in simulate(described(table)).answers] == ["outside"]


def test_tolerance_of_a_mount_type() -> None:
    table = content(LINEAR)
    table["mount_type"]["rope"]["tolerance"] = {"stiffness": "15 %", "friction": 0.2, "batch": True}
    ((_, system),) = described(table).candidates
    assert (system.mounts[0].tolerance, system.mounts[0].type_name) == (Tolerance(0.15, 0.2, True), "rope")
    assert described(content(LINEAR)).candidates[0][1].mounts[0].tolerance is None
    for wrong in ({"stiffness": 15}, {"friction": "100 %"}, {"stiffness": "-1 %"}, {"stiffness": "15 N"}):
        table["mount_type"]["rope"]["tolerance"] = wrong
        with pytest.raises(MountedSystemError, match=r"^mount_type\.rope\.tolerance\.\w+: must be a share >= 0"):
            described(table)


@pytest.mark.parametrize("catalogue", [LINEAR, CURVE])
def test_scaled_springs_have_scaled_forces(catalogue: dict[str, Any]) -> None:
    spring = spring_of(catalogue)
    places = np.linspace(spring.displacement_min, spring.displacement_max, 7)
    forces = {
        (which, omega): PathSolver(each).force_with_partials(places, np.full(7, omega))[0]
        for which, each in (("as it is", spring), ("scaled", scaled(spring, 1.1, 0.7)))
        for omega in (0.0, 1.0)
    }
    np.testing.assert_allclose(forces["scaled", 0.0], 1.1 * forces["as it is", 0.0], rtol=1e-12, atol=1e-9)
    friction = forces["as it is", 1.0] - forces["as it is", 0.0]
    np.testing.assert_allclose(forces["scaled", 1.0] - forces["scaled", 0.0], 0.7 * friction, rtol=1e-12, atol=1e-9)


def test_the_example_of_catalogue_mounts() -> None:
    found = simulate(SYSTEMS / "avionics_tray.toml", cases=["engine"])
    assert [answer.verdict.value for answer in found.answers] == ["pass", "pass"]
    for candidate in found.candidates:
        assert sum("No loops stand behind" in sentence for sentence in candidate.cautions) == 1
    steady = isolate_system(SYSTEMS / "avionics_tray.toml", directions=["z"], points=5)
    assert steady.summary().count("No loops stand behind") == 2
