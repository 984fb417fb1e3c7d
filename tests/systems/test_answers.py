"""Verdicts, figures, cautions and spreads of candidates under load cases."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mounted_examples import CORNERS, box, elastic, hysteretic, one_mass, three_axes, unit
from strandspring.examples import systems
from strandspring.model import modelfile
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MotionKind, Mount, MountAxis, Point, RigidBody, Stops, Vector
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.simulation import run_case
from strandspring.vibration.description.system_file import load_system_file
from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.pulses import HalfSine
from strandspring.vibration.signals.random_signal import RandomVibration
from strandspring.vibration.signals.shock_spectra import RequiredSpectrum, shock_spectrum
from strandspring.vibration.signals.shock_synthesis import synthesized_shock
from strandspring.vibration.verdicts.answers import CaseAnswer, answer_candidate, answer_case
from strandspring.vibration.verdicts.case_cautions import CautionKind
from strandspring.vibration.verdicts.drawn_springs import Drawn
from strandspring.vibration.verdicts.draws import Unknowns, ranges, tolerance_factor
from strandspring.vibration.verdicts.figures import CaseFigures
from strandspring.vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind, Limits, judged

X: Vector = (1.0, 0.0, 0.0)
DOWN: Vector = (0.0, 0.0, -1.0)
FREE = Limits()


def shaken(
    signal: Signal, direction: Vector = X, duration: float = 0.3, settling: float = 0.0, kind: str = "pulse"
) -> LoadCase:
    return LoadCase("case", kind, duration, (LoadChannel(ChannelKind.BASE_ACCELERATION, signal, direction),), settling)


def kinds(answer: CaseAnswer) -> set[CautionKind]:
    return {caution.kind for caution in answer.cautions}


# Verdicts


@pytest.mark.parametrize(
    ("low", "high", "limit", "is_outside", "verdict"),
    [
        (0.8, 0.9, 1.0, False, CaseVerdict.PASSES),
        (0.8, 0.9, None, False, CaseVerdict.NO_LIMITS),
        (1.01, 1.1, 1.0, False, CaseVerdict.FAILS),
        (0.8, 1.01, 1.0, False, CaseVerdict.UNDECIDED),
        (0.4, 0.5, 1.0, True, CaseVerdict.OUTSIDE),
        (1.4, 1.5, 1.0, True, CaseVerdict.OUTSIDE),
    ],
)
def test_a_verdict_follows_from_ranges_and_limits(
    low: float, high: float, limit: float | None, is_outside: bool, verdict: CaseVerdict
) -> None:
    figure = Figure(FigureKind.SWAY, "point", 0.5 * (low + high), 0.0, low, high, limit)
    assert judged([figure], is_outside, limit is not None) is verdict
    assert figure.margin == (None if limit is None else pytest.approx(1.0 - high / limit))


def test_a_spring_beyond_its_range_is_outside_and_never_passes() -> None:
    system = one_mass(MountAxis(hysteretic(0.6, 60.0, half=0.01), (0.0, 0.0, 1.0), 0.0), 5.0)
    strong = shaken(HalfSine(1000.0, 0.01), (0.0, 0.0, 1.0))
    answer = answer_case("one", system, strong, FREE)
    assert answer.verdict is CaseVerdict.OUTSIDE
    assert CautionKind.OUTSIDE in kinds(answer)
    worst = answer.worst(FigureKind.STROKE)
    assert worst is not None
    assert worst.value > 1.0
    weak = answer_case(
        "one", system, replace(strong, channels=shaken(HalfSine(100.0, 0.01), (0, 0, 1.0)).channels), FREE
    )
    assert weak.verdict is CaseVerdict.NO_LIMITS
    assert CautionKind.OUTSIDE not in kinds(weak)


def test_stroke_is_the_share_of_the_way_from_rest_on_the_side_where_more_is_used() -> None:
    # A linear spring of 1000 N/m under 1 kg rests 9.8 mm down and swings on both sides of that.
    axis = MountAxis(elastic(0.0, 1000.0, half=0.05), DOWN, 0.0)
    system = replace(one_mass(axis), gravity=(0.0, 0.0, -9.80665))
    answer = answer_case("one", system, shaken(HalfSine(50.0, 0.02), (0.0, 0.0, 1.0)), FREE)
    use, run = answer.uses[0], answer.runs[0]
    assert run.start.displacement[0] == pytest.approx(9.80665e-3, rel=1e-9)
    down = (run.figures.displacement_high[0] - 9.80665e-3) / (0.05 - 9.80665e-3)
    up = (9.80665e-3 - run.figures.displacement_low[0]) / (0.05 + 9.80665e-3)
    assert use.share[0] == pytest.approx(max(down, up), rel=1e-9)


def test_extremes_of_a_spring_that_hardly_moves_stay_at_rest() -> None:
    """They begin at rest and not at the zero of the record."""
    axis = MountAxis(elastic(0.0, 1000.0, half=0.05), DOWN, 0.02)
    system = replace(one_mass(axis), gravity=(0.0, 0.0, -9.80665))
    case = shaken(HalfSine(1e-6, 0.02), (0.0, 0.0, 1.0), settling=0.1)
    answer = answer_case("one", system, case, FREE)
    for run in answer.runs:
        rest_at = run.start.displacement[0]
        assert run.figures.displacement_low[0] == pytest.approx(rest_at, abs=1e-8)
        assert run.figures.displacement_high[0] == pytest.approx(rest_at, abs=1e-8)


def test_bottoming_is_told_with_the_force_of_the_stop() -> None:
    axis = MountAxis(elastic(0.0, 1000.0, half=0.05), DOWN, 0.0, stops=Stops(-np.inf, 0.012, 2e4))
    system = replace(one_mass(axis), gravity=(0.0, 0.0, -9.80665))
    answer = answer_case("one", system, shaken(HalfSine(50.0, 0.02), (0.0, 0.0, 1.0)), FREE)
    assert CautionKind.STOPS in kinds(answer)
    for use in answer.uses:
        assert use.stop_force[0] == pytest.approx(2e4 * use.stop_deflection[0], rel=1e-12)
        assert use.stop_deflection[0] == pytest.approx(use.highest[0] - 0.012, rel=1e-12)


def test_axes_that_swing_together_are_told() -> None:
    alone, together = (
        answer_case("box", guided_box(), shaken(HalfSine(150.0, 0.011), direction), FREE)
        for direction in (X, unit(1.0, 1.0, 0.0))
    )
    assert CautionKind.COUPLED not in kinds(alone)
    assert CautionKind.COUPLED in kinds(together)


def guided_box() -> MountedSystem:
    """The box, moving in a plane without turning visibly, so that a shock along x moves the axes along x only."""
    heavy = ((1e3, 0.0, 0.0), (0.0, 1e3, 0.0), (0.0, 0.0, 1e3))
    return replace(box(), bodies=(replace(box().bodies[0], inertia=heavy, motion=MotionKind.PLANE),))


def test_what_cannot_rest_or_be_run_is_refused_in_a_sentence() -> None:
    system = replace(one_mass(MountAxis(hysteretic(0.6, 60.0), DOWN, 0.0), 1000.0), gravity=(0.0, 0.0, -9.80665))
    assert answer_candidate("heavy", system, {}, Unknowns()).refusal
    answer = answer_case("heavy", system, shaken(HalfSine(50.0, 0.02)), FREE)
    assert (answer.verdict, answer.figures) == (CaseVerdict.REFUSED, ())
    assert "identified range" in answer.refusal or "cannot rest" in answer.refusal


def test_a_range_holds_draws_of_omega_by_axis_that_three_omegas_miss() -> None:
    """Of a rack of six mounts, of which some figure exceeds that of omega 0, 1 and -1 for all springs in many draws."""
    places = [(x, y, -0.12) for x in (-0.2, 0.0, 0.2) for y in (-0.1, 0.1)]
    mounts = tuple(Mount(f"mount {k}", 0, place, three_axes()) for k, place in enumerate(places))
    system = replace(box(), mounts=mounts)
    case = shaken(HalfSine(100.0, 0.011), (1.0, 0.0, 0.0))
    answer, known = answer_case("rack", system, case, FREE), CaseFigures(system, case)
    step, generator = answer.runs[0].step, np.random.default_rng(7)
    alike = [rest(system, share) for share in (0.0, 1.0, -1.0)]
    drawn = [rest(system, omega=generator.uniform(-1.0, 1.0, 18)) for _ in range(60)]
    drawn += [rest(system, omega=np.sign(generator.uniform(-1.0, 1.0, 18))) for _ in range(60)]
    bound = np.max([known.of_run(run_case(system, case, start, step)) for start in alike], axis=0)
    values = np.array([known.of_run(run_case(system, case, start, step)) for start in drawn])
    assert np.mean(values > 1.01 * bound, axis=0).max() > 0.2
    low, high = (np.array([getattr(figure, end) for figure in answer.figures]) for end in ("low", "high"))
    # The ranges promise 5 % with 99 % confidence.
    assert np.mean((values < low) | (values > high), axis=0).max() <= 0.05


def test_the_tolerance_factor_is_that_of_tables() -> None:
    # Odeh and Owen, one-sided factors for 95 % content and 99 % confidence.
    assert tolerance_factor(50, 49, 0.95) == pytest.approx(2.269, abs=2e-3)
    assert tolerance_factor(20, 19, 0.95) == pytest.approx(2.807, abs=2e-2)


def test_a_range_from_all_combinations_is_theirs() -> None:
    values = np.array([[1.0], [2.0], [4.0]])
    assert [end.item() for end in ranges(values, [False] * 3, True)] == [1.0, 4.0]
    low, high = ranges(values, [False] * 3, False)
    assert low[0] < 1.0
    assert high[0] > 4.0


def test_a_range_holds_friction_that_acts_together_and_that_does_not() -> None:
    system, case = guided_box(), shaken(HalfSine(150.0, 0.011), unit(1.0, 1.0, 0.0))
    answer, known = answer_case("box", system, case, FREE), CaseFigures(system, case)
    assert CautionKind.COUPLED in kinds(answer)
    low, high = (np.array([getattr(figure, end) for figure in answer.figures]) for end in ("low", "high"))
    generator, step, means = np.random.default_rng(3), answer.runs[0].step, []
    for one in (system, replace(system, coupled=True)):
        axes = len(one.axes)
        starts = [rest(one, omega=generator.uniform(-1.0, 1.0, axes)) for _ in range(60)]
        values = np.array([known.of_run(run_case(one, case, start, step)) for start in starts])
        assert np.mean((values < low) | (values > high), axis=0).max() <= 0.05
        means.append(values.mean(axis=0))
    assert means[1][0] < 0.995 * means[0][0]  # acceleration
    assert means[1][2] > 1.01 * means[0][2]  # sway


def test_forces_that_are_only_rounding_have_no_sign() -> None:
    """Without it the pose of a symmetric system would hang on the last digit."""
    symmetric = replace(box(), bodies=(replace(box().bodies[0], inertia=((0.2, 0, 0), (0, 0.3, 0), (0, 0, 0.4))),))
    for share in (1.0, -1.0):
        omega = rest(symmetric, share).omega.reshape(len(CORNERS), 3)
        assert (omega == share).all(axis=0)[1:].all()


# Histories and spectra


def test_spectra_are_of_the_base_and_the_points() -> None:
    pulse = HalfSine(150.0, 0.011)
    answer = answer_case("box", box(), shaken(pulse), FREE, with_courses=True)
    courses = answer.courses
    assert courses is not None
    time = courses.histories.time
    exact = shock_spectrum(pulse.at(time), courses.interval, courses.base_shock[0].frequency, 0.05)
    # Averages over an interval of 50 us lower the spectrum of a pulse of 11 ms by less than 1e-5.
    np.testing.assert_allclose(courses.base_shock[0].maximax, exact.maximax, rtol=1e-4)
    assert courses.shock[0][0].frequency[-1] == pytest.approx(2000.0)
    # Far above its content a spectrum is the largest acceleration.
    for k in range(2):
        largest = courses.run.figures.acceleration_components[k]
        found = [float(spectrum.maximax[-1]) for spectrum in courses.shock[k]]
        np.testing.assert_allclose(found, largest, rtol=0.01)


def test_power_spectra_hold_the_root_mean_squares() -> None:
    vibration = RandomVibration(LevelTable(((10.0, 4.0), (100.0, 4.0))), 4.0, 3)
    case = shaken(vibration, (0.0, 0.0, 1.0), 4.0, 0.5, "random")
    answer = answer_case("box", box(), case, FREE, with_courses=True)
    assert answer.courses is not None
    found = np.array([[one.root_mean_square for one in each] for each in answer.courses.power])
    expected = answer.courses.run.figures.rms_acceleration
    # Steps follow the motion of the box, but the spectrum of the base reaches its highest frequency.
    base = answer.courses.base_power[2]
    top = (base.frequency > 60.0) & (base.frequency < 95.0)
    assert np.mean(base.density[top]) == pytest.approx(4.0, rel=0.2)
    # Welch's windows weigh the ends of the history less.
    np.testing.assert_allclose(found[:, 2], expected[:, 2], rtol=0.05)


# Draws


@pytest.fixture(scope="module")
def recoil() -> tuple[CaseAnswer, Drawn]:
    file = load_system_file(Path(systems.__path__[0]) / "gun_cradle.toml")
    name, system = file.candidates[0]
    return answer_case(name, system, file.cases[0], file.limits), Drawn.from_models(system, file.models)


def test_a_draw_is_the_case_with_the_drawn_springs(recoil: tuple[CaseAnswer, Drawn]) -> None:
    answer, drawn = recoil
    found = Unknowns(drawn, seed=5).run(answer.system, answer.case, 1e-4, 3)
    system = drawn.system(answer.system, 5, 3)
    assert system != answer.system
    assert found.system == system
    assert np.abs(found.run.start.omega).tolist() == [1.0, 1.0]
    alone = run_case(system, answer.case, rest(system, omega=found.run.start.omega), 1e-4)
    np.testing.assert_array_equal(found.run.figures.acceleration, alone.figures.acceleration)


def test_ranges_hold_the_uncertainty_of_the_springs(recoil: tuple[CaseAnswer, Drawn]) -> None:
    answer, drawn = recoil
    file = load_system_file(Path(systems.__path__[0]) / "gun_cradle.toml")
    known, unknown = (
        answer_case("gun", answer.system, answer.case, file.limits, Unknowns(springs, rest_omega=0.0))
        for springs in (Drawn({}, ()), drawn)
    )
    assert (known.draws, unknown.draws) == (0, 64)
    for figure, wider in zip(known.figures, unknown.figures, strict=True):
        assert figure.low <= figure.value <= figure.high
        assert wider.high - wider.low >= figure.high - figure.low
    assert unknown.figures[0].high > known.figures[0].high


def test_random_vibration_is_of_several_realisations() -> None:
    vibration = RandomVibration(LevelTable(((10.0, 4.0), (100.0, 4.0))), 4.0, 3)
    case = shaken(vibration, (0.0, 0.0, 1.0), 4.0, 0.5, "random")
    answer = answer_case("box", box(), case, FREE, Unknowns(rest_omega=0.0))
    assert answer.draws == 16
    peaks = np.array([run.figures.acceleration[0] for run in answer.runs[1:]])
    assert len(set(peaks.tolist())) == 16
    uncoupled = np.arange(16) % 3 != 1
    assert answer.figures[0].value == pytest.approx(peaks[uncoupled].mean(), rel=1e-12)


def test_a_seed_draws_realisations_of_its_own() -> None:
    """Of random vibration and of shocks by their spectrum, with springs and omega at rest known."""
    random = shaken(RandomVibration(LevelTable(((10.0, 4.0), (100.0, 4.0))), 2.0, 3), kind="random")
    shock = shaken(synthesized_shock(RequiredSpectrum(LevelTable(((20.0, 100.0), (200.0, 400.0)))), 0.3), kind="srs")
    system = one_mass(MountAxis(elastic(0.0, 1.0e4), X, 0.0))
    for case in (random, shock):
        peaks = [
            {float(run.figures.acceleration[0]) for run in answer_case("one", system, case, FREE, unknowns).runs[1:]}
            for unknowns in (Unknowns(draws=16, seed=seed, rest_omega=0.0) for seed in (0, 0, 1))
        ]
        assert peaks[0] == peaks[1]
        assert not peaks[0] & peaks[2]
        assert len(peaks[0]) >= 8


def test_a_model_without_uncertainty_is_taken_as_known_and_told() -> None:
    system = box()
    drawn = Drawn.from_models(system, {"": modelfile.ModelFile("bare", system.axes[0].spring)})
    assert not drawn.spreads
    assert len(drawn.missing) == 3
    assert all("taken as known" in sentence for sentence in drawn.missing)
    assert drawn.system(system, 0, 0) == system


# Cautions about a description


def test_what_a_description_leaves_out_is_told() -> None:
    shared = tuple(replace(axis, model="one.json") for axis in three_axes())
    cautions = " ".join(answer_candidate("box", box(shared), {}, Unknowns()).cautions)
    assert "one.json stands for perpendicular axes" in cautions
    assert "resistance to rotation" in cautions
    one_axis = RigidBody("box", 20.0, inertia=((0.2, 0, 0), (0, 0.3, 0), (0, 0, 0.4)))
    few = MountedSystem(
        (one_axis,), (Mount("foot", 0, (0.0, 0.0, -0.1), three_axes()[:1]),), (Point("p", 0, (0, 0, 0)),)
    )
    assert "fewer than three axes" in " ".join(answer_candidate("few", few, {}, Unknowns()).cautions)
