"""Whole paths and single steps against the differential equation, against each other and against invariants."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from springs import (
    EXAMPLES,
    along,
    elastic_by_definition,
    energy_scale,
    force_by_definition,
    force_scale,
    fractions,
    omegas,
    spring,
    springs,
)
from strandspring import Spring, SpringParameters
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from strandspring.core.parameters import MAXIMUM_AMPLIFIER_DEGREE, MAXIMUM_DEGREE
from strandspring.core.restoring import tangent_stiffness
from strandspring.kernel.path import PathSolver
from strandspring.kernel.steady import steady_omega

pytestmark = pytest.mark.long

LAW = settings(max_examples=100)

examples = pytest.mark.parametrize("parameters", EXAMPLES.values(), ids=EXAMPLES)


class SmoothPath:
    """A sum of three sines in time, with inner loops and within the identified range."""

    DURATION = 12.0

    def __init__(self, parameters: SpringParameters, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.parameters = parameters
        self.amplitude = np.array([0.5, 0.3, 0.19])
        self.frequency = np.array([1.0, 2.7, 5.3]) * rng.uniform(0.9, 1.1, 3)
        self.phase = rng.uniform(0.0, 2.0 * np.pi, 3)
        self.half = 0.5 * (parameters.displacement_max - parameters.displacement_min)

    def displacement(self, time: float) -> float:
        return float(along(self.parameters, self.amplitude @ np.sin(self.frequency * time + self.phase)))

    def velocity(self, time: float) -> float:
        return self.half * float((self.amplitude * self.frequency) @ np.cos(self.frequency * time + self.phase))

    def turning_times(self) -> list[float]:
        even = np.linspace(0.0, self.DURATION, 1000)
        velocity = np.array([self.velocity(t) for t in even])
        changes = np.flatnonzero(velocity[:-1] * velocity[1:] < 0.0)
        return [brentq(self.velocity, even[k], even[k + 1], xtol=1e-14) for k in changes]


@dataclass(frozen=True)
class Integrated:
    """A path sampled so that the turning points are samples, and what eq. (11) makes of it."""

    displacement: np.ndarray
    omega: np.ndarray
    energy: np.ndarray


def integrate_equation_11(parameters: SpringParameters, path: SmoothPath, omega_start: float) -> Integrated:
    """omega and absorbed energy by Runge-Kutta of order 8 from paper eq. (11) as printed, in time.

    The integration is restarted at turning points, where the right-hand side has a kink.
    """
    p = parameters
    elastic, kA = elastic_by_definition(p), np.array(p.kA[::-1])

    def rates(time: float, state: np.ndarray) -> tuple[float, float]:
        omega, velocity = state[0], path.velocity(time)
        power = min(abs(omega), 2.0) ** p.n  # only a trial step that will be rejected gets beyond 2
        bracket = 1.0 - (p.sigma * np.sign(velocity) * np.sign(omega) - p.sigma + 1.0) * power
        x = path.displacement(time) - p.displacement_offset
        force = elastic(x) + p.kappa_omega * omega * np.polyval(kA, x)
        return p.rho * velocity * bracket, force * velocity

    # Near saturation omega decays with n*rho*|velocity|: an explicit method must not step further than that.
    longest = 0.5 / (p.n * p.rho * path.half)
    times, states = [0.0], [np.array([omega_start, 0.0])]
    for begin, end in pairwise([0.0, *path.turning_times(), path.DURATION]):
        samples = np.linspace(begin, end, 20)[1:]
        accuracy = {"rtol": 1e-10, "atol": [1e-12, 1e-12 * p.kappa_omega * path.half]}
        solution = solve_ivp(
            rates, (begin, end), states[-1], method="DOP853", t_eval=samples, max_step=longest, **accuracy
        )
        assert solution.success
        times.extend(samples)
        states.extend(solution.y.T)
    omega, energy = np.array(states).T
    return Integrated(np.array([path.displacement(t) for t in times]), omega, energy)


def errors_of(solved: Spring, exact: Integrated) -> tuple[float, float]:
    """Largest errors of force and energy, relative to what the spring could show."""
    p, path, omega_start = solved.parameters, exact.displacement, float(exact.omega[0])
    force = force_by_definition(p, path, exact.omega) - solved.response(path, omega_start)
    energy = exact.energy - solved.absorbed_energy(path, omega_start)
    return (
        float(np.max(np.abs(force))) / force_scale(p, path),
        float(np.max(np.abs(energy))) / energy_scale(p, path),
    )


@examples
@pytest.mark.parametrize(("seed", "omega_start"), [(2, -0.8), pytest.param(1, 0.0, marks=pytest.mark.slow)])
def test_force_and_energy_obey_the_differential_equation(
    parameters: SpringParameters, seed: int, omega_start: float
) -> None:
    force_error, energy_error = errors_of(
        Spring(parameters), integrate_equation_11(parameters, SmoothPath(parameters, seed), omega_start)
    )
    # The integrator is the inexact side: 2e-9 where a step crosses the cusp at omega = 0, 1e-10 elsewhere.
    assert force_error <= 1e-8
    # And 1e-9 where it crosses a knot, at which the third derivative of FE jumps; quarter steps halve it.
    assert energy_error <= (3e-9 if parameters.FE_knots else 1e-9)


@st.composite
def paths_and_subdivisions(draw: st.DrawFn) -> tuple[list[float], list[list[float]]]:
    path = draw(fractions(minimum=2))
    cuts = st.lists(st.floats(0.0, 1.0), max_size=4).map(sorted)
    return path, draw(st.lists(cuts, min_size=len(path) - 1, max_size=len(path) - 1))


@LAW
@given(springs(), paths_and_subdivisions(), omegas())
def test_subdividing_strokes_changes_nothing(
    parameters: SpringParameters, case: tuple[list[float], list[list[float]]], omega_start: float
) -> None:
    path = along(parameters, case[0])
    pieces, kept = [path[:1]], [0]
    for before, after, cuts in zip(path[:-1], path[1:], case[1], strict=True):
        inner = np.clip(before + np.array(cuts) * (after - before), min(before, after), max(before, after))
        pieces.append(np.append(inner, after))
        kept.append(kept[-1] + inner.size + 1)
    fine = np.concatenate(pieces)
    solved = Spring(parameters)
    # The same travelled distance from the same turning point gives the same bits.
    assert np.array_equal(solved.response(fine, omega_start)[kept], solved.response(path, omega_start))
    difference = solved.absorbed_energy(fine, omega_start)[kept] - solved.absorbed_energy(path, omega_start)
    # Other pieces of the quadrature: 1e-12 of the force times the way.
    assert np.max(np.abs(difference)) <= 1e-11 * energy_scale(parameters, path)


@LAW
@given(springs(), fractions(), st.lists(st.integers(1, 4), min_size=25, max_size=25), omegas())
def test_standing_still_changes_nothing(
    parameters: SpringParameters, positions: list[float], repeats: list[int], omega_start: float
) -> None:
    path = along(parameters, positions)
    counts = repeats[: path.size]
    still = np.repeat(path, counts)
    solved = Spring(parameters)
    for of_path in (solved.omega, solved.response, solved.stiffness, solved.absorbed_energy):
        moved = np.repeat(of_path(path, omega_start), counts)
        # The same samples in arrays of other lengths and other running sums: rounding only.
        assert of_path(still, omega_start) == pytest.approx(moved, rel=1e-14, abs=1e-300)


@LAW
@given(springs(), fractions(reach=100.0), omegas())
def test_omega_stays_within_saturation_and_starts_where_given(
    parameters: SpringParameters, positions: list[float], omega_start: float
) -> None:
    path = along(parameters, positions)
    solved = Spring(parameters)
    omega = solved.omega(path, omega_start)
    assert np.max(np.abs(omega)) <= 1.0
    assert omega[0] == omega_start
    # Two ways to sum a polynomial of degree 4: rounding.
    expected = force_by_definition(parameters, path, omega)
    assert np.max(np.abs(solved.response(path, omega_start) - expected)) <= 1e-13 * force_scale(parameters, path)


@LAW
@given(springs(), fractions(minimum=2), omegas())
def test_the_force_grows_while_only_friction_acts(
    parameters: SpringParameters, positions: list[float], omega_start: float
) -> None:
    path = along(parameters, positions)
    omega = Spring(parameters).omega(path, omega_start)
    growth = np.diff(omega) * np.sign(np.diff(path))
    # Eq. (22): omega follows the motion, at most with slope 2*rho*sigma; 1e-12 is the step between cells of W.
    assert np.min(growth) >= -1e-12
    # A displacement is rounded to 1e-15 of the offset, which counts when the range is narrow.
    steps = np.abs(np.diff(path)) + 1e-15 * np.max(np.abs(path))
    assert np.all(growth <= 2.0 * parameters.rho * parameters.sigma * steps + 1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_steady_closed_loops_only_dissipate(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cycles = 25
    least_steadiness, least_energy = 0.0, np.inf
    for _ in range(100):
        amplifier = rng.uniform(-1.0, 1.0, rng.integers(0, 5))
        parameters = spring(
            n=10.0 ** rng.uniform(-1.0, 0.8),
            sigma=0.5 + rng.choice([0.0, 0.1, 1.0, 10.0]) * rng.uniform(),
            saturations=10.0 ** rng.uniform(0.3, 2.0),
            amplifier=tuple(rng.uniform(0.0, 0.999) * amplifier / max(1.0, np.sum(np.abs(amplifier)))),
        )
        loop = rng.uniform(-1.0, 1.0, rng.integers(2, 11))
        loop[rng.permutation(loop.size)[:2]] = (-1.0, 1.0)  # a full swing makes the loop steady soon
        path = along(parameters, np.append(np.tile(loop, cycles), loop[0]))
        solved = Spring(parameters)
        last = [-loop.size - 1, -1]
        omega = solved.omega(path, rng.uniform(-1.0, 1.0))[last]
        energy = solved.absorbed_energy(path)[last]
        least_steadiness = max(least_steadiness, abs(omega[1] - omega[0]))
        least_energy = min(least_energy, (energy[1] - energy[0]) / energy_scale(parameters, path[-loop.size - 1 :]))
    assert least_steadiness <= 1e-9
    # 1e-12 of the force times the way is the accuracy of the quadrature.
    assert least_energy >= -1e-12


@examples
def test_outside_the_range_fe_goes_on_linearly_and_fa_is_held(parameters: SpringParameters) -> None:
    solved = Spring(parameters)
    for end in (-1.0, 1.0):
        outside = along(parameters, [0.0, end, 1.5 * end, 2.0 * end, 3.0 * end])
        path = np.concatenate([along(parameters, [-30.0 * end]), outside])
        omega = solved.omega(path)
        force = solved.response(path)[1:] - force_by_definition(parameters, outside, omega[1:])
        assert np.max(np.abs(force)) <= 1e-13 * force_scale(parameters, outside)  # rounding of two sums
        # The value does not jump at the end.
        near = along(parameters, end * np.array([-30.0, 1.0 - 1e-9, 1.0 + 1e-9]))
        inside, beyond = solved.response(near)[1:]
        step = 1e-9 * np.ptp(along(parameters, [-1.0, 1.0]))
        steepest = np.max(np.abs(solved.stiffness(near)[1:]))
        assert abs(beyond - inside) <= 2.0 * steepest * step + 1e-13 * force_scale(parameters, near)


def test_a_path_that_leaves_the_range_is_warned_of_and_the_noise_of_a_record_is_not() -> None:
    parameters = spring(n=1.0, sigma=1.0, saturations=40.0, amplifier=())
    solved = Spring(parameters)
    calls = (solved.response, solved.stiffness, solved.absorbed_energy, solved.responses)
    inside, outside = along(parameters, [0.0, 1.01, -1.01]), along(parameters, [0.0, 0.5, 1.1, -1.1, 0.0])
    for call in calls:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            call(inside)
        with pytest.warns(UserWarning, match="at index 2: in 2 of 5 rows the force is extrapolated") as caught:
            call(outside)
        assert [each.filename for each in caught] == [__file__]
    # omega has no range.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        solved.omega(outside)


def test_the_slope_of_the_elastic_force_is_continuous_at_the_ends() -> None:
    parameters = spring(n=1.0, sigma=1.0, saturations=40.0, amplifier=())
    solved = Spring(parameters)
    half = 0.5 * (parameters.displacement_max - parameters.displacement_min)
    for end in (-1.0, 1.0):
        path = along(parameters, end * np.array([-30.0, 1.0 - 1e-7, 1.0 + 1e-7, 2.0, 5.0]))
        _, inside, beyond, far, farther = solved.stiffness(path)
        # FE'' = (2 + 18*end)*kappa/half^2 moves the slope by 2e-7 of it at most; omega' = exp(-1240).
        assert abs(beyond - inside) <= 5e-6 * parameters.kappa_omega / half
        assert beyond == pytest.approx(far, rel=1e-14)  # a straight line
        assert far == farther


@examples
def test_stiffness_is_the_slope_of_the_force_along_the_motion(parameters: SpringParameters) -> None:
    solved = Spring(parameters)
    scale = force_scale(parameters, along(parameters, [-1.0, 1.0]))
    step = 1e-4
    turns = [0.0, 0.7, -0.4, 0.35, -0.9, 0.9]
    checked = 0
    for k in range(1, len(turns)):
        for at in np.linspace(turns[k - 1], turns[k], 7)[1:-1]:
            stencil = at + np.sign(turns[k] - turns[k - 1]) * step * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
            path = along(parameters, turns[:k] + stencil.tolist())
            force, omega = solved.response(path)[-5:], solved.omega(path)[-5:]
            if np.min(np.abs(omega)) < 0.02:
                continue  # at omega = 0 the slope has a cusp and differences mean nothing
            h = path[-1] - path[-2]
            slope = (force[0] - 8.0 * force[1] + 8.0 * force[3] - force[4]) / (12.0 * h)
            # Fourth order of step*rho*half <= 3e-3, five derivatives of a spring that saturates sharply.
            assert solved.stiffness(path)[-3] == pytest.approx(slope, rel=1e-6, abs=1e-6 * scale / abs(h) * step)
            checked += 1
    assert checked >= 15


@examples
def test_stiffness_after_a_reversal(parameters: SpringParameters) -> None:
    law = SpringLaw(parameters)
    solved = Spring(parameters)
    for turn, back in ((0.6, -1.0), (-0.6, 1.0)):
        step = 1e-5
        h = back * step * np.array([1.0, 2.0])
        path = along(parameters, [0.0, turn])
        forces = [solved.response(along(parameters, [0.0, turn, turn + d]))[1:] for d in h]
        way = along(parameters, turn + h) - path[1]
        quotients = [(after - before) / d for (before, after), d in zip(forces, way, strict=True)]
        one_sided = 2.0 * quotients[0] - quotients[1]
        omega = solved.omega(path)[1]
        expected = tangent_stiffness(law, path[1] - parameters.displacement_offset, omega, back)
        # Second order of step*rho*half*(2 sigma n) <= 3e-2 for the sharpest of the springs.
        assert expected == pytest.approx(one_sided, rel=2e-3)
        # It is steeper than going on: that is what makes a loop.
        assert expected > solved.stiffness(path)[1]
        memory = stepper.trial(law, stepper.start(path[0], 0.0), path[1])
        turned = stepper.trial(law, memory, float(np.nextafter(path[1], back * np.inf)))
        assert stepper.stiffness(law, turned) == pytest.approx(expected, rel=1e-9)  # one bit further


@examples
@pytest.mark.parametrize("reach", [0.8, 1.6])
def test_energy_is_the_integral_of_the_force(parameters: SpringParameters, reach: float) -> None:
    solved = Spring(parameters)
    turns = reach * np.array([0.1, 1.0, -0.5, 0.4, -1.0, 1.0])
    coarse = along(parameters, turns)
    energy = solved.absorbed_energy(coarse, 0.3)[-1]
    errors = []
    for pieces in (1000, 2000, 4000):
        fine = along(parameters, np.interp(np.linspace(0.0, 5.0, 5 * pieces + 1), np.arange(6), turns))
        errors.append(abs(np.trapezoid(solved.response(fine, 0.3), fine) - energy))
    # Second order would give 16; the cusp and the kinks at the ends of the range, between samples, disturb it.
    assert errors[0] / errors[2] > 4.0
    assert errors[2] <= 1e-4 * energy_scale(parameters, coarse)


@examples
def test_energy_of_one_big_stroke(parameters: SpringParameters) -> None:
    solved = Spring(parameters)
    start, end = along(parameters, [-2.5, 3.0])
    zero = brentq(lambda x: solved.omega([start, x], -1.0)[-1], start + 1e-12, end)  # where W has its cusp
    kinks = sorted([zero, parameters.displacement_min, parameters.displacement_max])
    corners = [start, *kinks, end]
    total = sum(
        quad(lambda x: solved.response([start, x], -1.0)[-1], a, b, epsabs=0.0, epsrel=1e-10, limit=200)[0]
        for a, b in pairwise(corners)
    )
    energy = solved.absorbed_energy([start, end], -1.0)
    assert energy[0] == 0.0
    # Adaptive quadrature to 1e-10 per piece between the kinks; the pieces may cancel.
    assert abs(energy[1] - total) <= 1e-9 * energy_scale(parameters, np.array([start, end]))


@pytest.mark.parametrize("degree", range(1, MAXIMUM_AMPLIFIER_DEGREE + 1))
@pytest.mark.parametrize("saturations", [0.001, 0.2, 1.0, 30.0, 300.0])
@pytest.mark.parametrize("omega_start", [0.0, 0.8])
def test_energy_of_amplifiers_of_any_degree(degree: int, saturations: float, omega_start: float) -> None:
    chebyshev = np.polynomial.chebyshev.cheb2poly([0.0] * degree + [1.0])
    amplifier = 0.9 * chebyshev / (1.0 + 0.9 * chebyshev[0])
    parameters = spring(n=0.5, sigma=1.3, saturations=saturations, elastic=(0.0,), amplifier=tuple(amplifier[1:]))
    solved = Spring(parameters)
    corners = np.array([0.0, 1.0, -1.0, 1.0])
    coarse = along(parameters, corners)
    fine = along(parameters, np.interp(np.linspace(0.0, 3.0, 3001), np.arange(4), corners))
    energy = solved.absorbed_energy(coarse, omega_start)
    difference = energy - solved.absorbed_energy(fine, omega_start)[::1000]
    # Powers of Chebyshev polynomials lose digits, 1e-11 measured at most.
    assert np.max(np.abs(difference)) <= 1e-10 * energy_scale(parameters, coarse)
    by_trapezoid = np.trapezoid(solved.response(fine, omega_start), fine)
    # Second order with 1000 pieces per stroke of a polynomial with up to 8 extremes, the outer ones narrow.
    assert abs(energy[-1] - by_trapezoid) <= 2e-4 * energy_scale(parameters, coarse)


def test_a_spring_of_the_largest_degrees_obeys_the_differential_equation() -> None:
    rng = np.random.default_rng(3)
    weights = rng.uniform(-1.0, 1.0, MAXIMUM_AMPLIFIER_DEGREE)
    parameters = spring(
        n=1.3,
        sigma=2.0,
        saturations=6.0,
        elastic=tuple(rng.uniform(-1.0, 1.0, MAXIMUM_DEGREE + 1)),
        amplifier=tuple(0.9 * weights / np.sum(np.abs(weights))),
    )
    force_error, energy_error = errors_of(
        Spring(parameters), integrate_equation_11(parameters, SmoothPath(parameters, 3), 0.2)
    )
    # As above: the integrator's accuracy.
    assert force_error <= 1e-8
    assert energy_error <= 1e-9


@examples
@pytest.mark.parametrize("count", [1, 2, 7])
def test_paths_that_never_move(parameters: SpringParameters, count: int) -> None:
    solved = Spring(parameters)
    path = np.full(count, along(parameters, 0.3))
    assert solved.omega(path, -0.6).tolist() == [-0.6] * count
    expected = force_by_definition(parameters, path, -0.6)
    assert solved.response(path, -0.6) == pytest.approx(expected, rel=1e-13)  # rounding
    assert solved.absorbed_energy(path, -0.6).tolist() == [0.0] * count
    law = SpringLaw(parameters)
    of_loading = tangent_stiffness(law, path[0] - parameters.displacement_offset, -0.6, 1)
    assert solved.stiffness(path, -0.6) == pytest.approx(np.full(count, of_loading), rel=1e-14)  # rounding


METHODS: dict[str, Callable[[Spring], Callable[..., np.ndarray]]] = {
    "response": lambda s: s.response,
    "omega": lambda s: s.omega,
    "stiffness": lambda s: s.stiffness,
    "absorbed_energy": lambda s: s.absorbed_energy,
}


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize(
    ("displacement", "sentence"),
    [
        ([0.05, float("nan"), 0.05], "`displacement` must be finite [m], got nan at index 1."),
        ([0.05, 0.06, float("inf")], "`displacement` must be finite [m], got inf at index 2."),
        ([float("-inf")], "`displacement` must be finite [m], got -inf at index 0."),
        ([], "`displacement` must have shape (K,) with K >= 1, got shape (0,)."),
        (0.05, "`displacement` must have shape (K,) with K >= 1, got shape ()."),
        ([[0.05, 0.06]], "`displacement` must have shape (K,) with K >= 1, got shape (1, 2)."),
    ],
)
def test_paths_that_are_refused(
    method: Callable[[Spring], Callable[..., np.ndarray]], displacement: object, sentence: str
) -> None:
    with pytest.raises(ValueError, match=r"^`displacement`") as refusal:
        method(Spring(EXAMPLES["wire_rope"]))(displacement)
    assert str(refusal.value) == sentence


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("omega_start", [1.0000001, -2.0, float("nan"), float("inf")])
def test_starts_that_are_refused(method: Callable[[Spring], Callable[..., np.ndarray]], omega_start: float) -> None:
    with pytest.raises(ValueError, match=r"^`omega_start`") as refusal:
        method(Spring(EXAMPLES["wire_rope"]))([0.05], omega_start)
    assert str(refusal.value) == f"`omega_start` must be within [-1, 1], got {omega_start!r}."


def stepped(law: SpringLaw, path: np.ndarray, omega_start: float) -> list[stepper.Memory]:
    memories = [stepper.start(float(path[0]), omega_start)]
    for position in path[1:].tolist():
        memories.append(stepper.trial(law, memories[-1], position))
    return memories


@settings(LAW, max_examples=50)  # the tables for single steps take 20 ms to build
@given(springs(), fractions(), omegas())
def test_single_steps_equal_whole_paths(
    parameters: SpringParameters, positions: list[float], omega_start: float
) -> None:
    path = along(parameters, positions)
    law, solver = SpringLaw(parameters), PathSolver(parameters)
    memories = stepped(law, path, omega_start)
    # Python's W and the kernel's are within 2e-13 (test_saturation).
    scale = force_scale(parameters, path)
    force = np.array([stepper.force(law, m) for m in memories])
    assert np.max(np.abs(force - solver.force(path, omega_start))) <= 1e-12 * scale
    energy = np.array([stepper.absorbed_energy(law, m) for m in memories])
    # Where xi is large, its rounding in Python is a way: short strokes lose digits of their length.
    lost = np.finfo(float).eps * sum(abs(m.start_xi) for m in memories) / parameters.rho
    tolerance = 1e-12 * energy_scale(parameters, path) + scale * lost
    assert np.max(np.abs(energy - solver.absorbed_energy(path, omega_start))) <= tolerance


@examples
def test_single_steps_have_the_stiffness_of_whole_paths(parameters: SpringParameters) -> None:
    # Unloading first: before the first motion both give the stiffness of loading.
    path = along(parameters, np.append(0.9, np.random.default_rng(8).uniform(-1.2, 0.8, 200)))
    law = SpringLaw(parameters)
    single = np.array([stepper.stiffness(law, m) for m in stepped(law, path, 0.5)])
    whole = PathSolver(parameters).stiffness(path, 0.5)
    # omega differs by 2e-13 and n*|omega|^(n-1) multiplies it, by up to 1e3 near the cusp of n = 0.22.
    assert np.max(np.abs(single - whole)) <= 1e-9 * np.max(np.abs(whole))


@examples
def test_a_memory_rebuilt_from_its_numbers_continues_bit_for_bit(parameters: SpringParameters) -> None:
    rng = np.random.default_rng(9)
    law = SpringLaw(parameters)
    original = rebuilt = stepper.start(float(along(parameters, 0.1)), 0.2)
    for position in along(parameters, rng.uniform(-1.5, 1.5, 40)).tolist():
        rebuilt = stepper.Memory(*json.loads(json.dumps(tuple(rebuilt))))
        original, rebuilt = stepper.trial(law, original, position), stepper.trial(law, rebuilt, position)
        assert rebuilt == original
        assert stepper.force(law, rebuilt) == stepper.force(law, original)
        assert stepper.absorbed_energy(law, rebuilt) == stepper.absorbed_energy(law, original)


@examples
def test_trial_steps_leave_no_trace(parameters: SpringParameters) -> None:
    rng = np.random.default_rng(10)
    law = SpringLaw(parameters)
    tried = untouched = stepper.start(float(along(parameters, -0.2)), -1.0)
    for position in along(parameters, rng.uniform(-1.5, 1.5, 25)).tolist():
        before = tuple(tried)
        for trial in along(parameters, rng.uniform(-2.0, 2.0, 3)).tolist():
            stepper.absorbed_energy(law, stepper.trial(law, tried, trial))
            assert tuple(tried) == before
        tried, untouched = stepper.trial(law, tried, position), stepper.trial(law, untouched, position)
        assert tried == untouched


@examples
def test_integrating_the_energy_changes_nothing_else(parameters: SpringParameters) -> None:
    rng = np.random.default_rng(12)
    law = SpringLaw(parameters)
    plain = integrated = stepper.start(float(along(parameters, 0.0)), 0.0)
    path = along(parameters, np.cumsum(rng.normal(0.0, 0.2, 200)))
    for position in path.tolist():
        plain = stepper.trial(law, plain, position)
        integrated = stepper.integrate(law, stepper.trial(law, integrated, position))
        assert stepper.integrate(law, integrated) == integrated
        assert integrated.energy_at == position
        assert stepper.force(law, integrated) == stepper.force(law, plain)
        assert integrated._replace(energy_at=plain.energy_at, energy=plain.energy) == plain
        # Other pieces of the quadrature and one more sum per step.
        difference = integrated.energy - stepper.absorbed_energy(law, plain)
        assert abs(difference) <= 1e-12 * energy_scale(parameters, path)


def test_a_step_of_no_length_keeps_the_memory() -> None:
    law = SpringLaw(EXAMPLES["exponential"])
    memory = stepper.trial(law, stepper.start(0.05, 0.0), 0.06)
    assert stepper.trial(law, memory, 0.06) is memory


def energy_of_steps(parameters: SpringParameters, path: np.ndarray, omega: float) -> float:
    """The energy that Python's stepper absorbs along a path [J]."""
    law = SpringLaw(parameters)
    memory = stepper.start(float(path[0]), omega)
    for displacement in path.tolist():
        memory = stepper.trial(law, memory, displacement)
    return stepper.absorbed_energy(law, memory)


def energy_of_path(parameters: SpringParameters, path: np.ndarray, omega: float) -> float:
    return float(PathSolver(parameters).absorbed_energy(path, omega)[-1])


@pytest.mark.parametrize("energy_along", [energy_of_path, energy_of_steps])
@pytest.mark.parametrize("n", [0.5, 1.0, 2.0])
def test_the_energy_of_small_loops_has_all_its_digits(
    n: float, energy_along: Callable[[SpringParameters, np.ndarray, float], float]
) -> None:
    """Of a loop far below saturation, whose energy falls with the power 2 + n of its length."""
    parameters = SpringParameters((0.0,), (1.0, 5.0), 10.0, 500.0, 1.0, n, 0.0, -0.02, 0.02)

    def energies(length: float) -> np.ndarray:
        omega = -steady_omega(parameters, length)
        lows = np.linspace(-0.019, 0.019, 50)
        loops = [energy_along(parameters, np.array([low, low + length, low]), omega) for low in lows]
        return np.array(loops) / (1.0 + 5.0 * (lows + 0.5 * length))

    small, smaller = energies(1e-6), energies(1e-7)
    assert np.all(smaller > 0.0)
    # FA changes by 5e-6 of itself over the loop; rounding of the displacement, 3e-18 of 1e-7 m.
    assert small == pytest.approx(small.mean(), rel=1e-5)
    assert smaller == pytest.approx(smaller.mean(), rel=1e-5)
    # The next term of W is below rho*length of the first, to the power n at most.
    assert small.mean() / smaller.mean() == pytest.approx(10.0 ** (2.0 + n), rel=max(1e-4, 3.0 * (500.0 * 1e-6) ** n))


def test_work_beyond_a_range_that_xi_hardly_notices() -> None:
    """FA of degree 1 over a range far below 1/rho, left by a thousand times: quadrature over a rough piece."""
    parameters = SpringParameters((0.0, 1.0), (1.0, 0.5), 1.0, 1.0, 1.0, 1.0, 0.0, -1e-3, 1e-3)
    law = SpringLaw(parameters)
    memory = stepper.trial(law, stepper.start(0.0, 0.0), 1.0)
    there = stepper.absorbed_energy(law, memory)
    back = stepper.absorbed_energy(law, stepper.trial(law, memory, -1.0))
    # W = 1 - exp(-x) and FA is 1.0005 beyond the range.
    assert there == pytest.approx(0.5 + 1.0005 * np.exp(-1.0), rel=1e-6)  # FA within the range
    whole = PathSolver(parameters).absorbed_energy(np.array([0.0, 1.0, -1.0]))
    assert [there, back] == pytest.approx(whole[1:], rel=1e-14)
