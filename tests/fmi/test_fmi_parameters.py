"""Further columns of the conformance table: parameters that are changed on the way, derivatives, and model exchange.

Derivatives are compared with differences of values.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from ctypes import byref, c_double
from dataclasses import replace
from typing import Any

import fmpy
import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, wandering_path
from forms import FORMS, NATIVE_PATHS, STATES, STEPPED, Form, rows
from native_tools import DISCARD, ERROR, OK, WARNING, Native, Native3, close, close_each
from oracles import rate_of_omega
from springs import force_by_definition
from strandspring.kernel.arrays import address
from strandspring.kernel.library import library as kernel
from strandspring.kernel.path import PathSolver

pytestmark = pytest.mark.long


@pytest.mark.parametrize("name", ["co-simulation", "model exchange", "fmi3", "python", "table", "table, python"])
def test_a_change_acts_from_the_committed_point_on_with_omega_carried_on(name: str) -> None:
    form = FORMS[name]
    p, path, time = form.spring, wandering_path(form.spring, 120, seed=3), np.arange(200) * 1e-3
    elastic = "FE_forces" if p.FE_knots else "kE"
    changes: list[dict[str, Any]] = [
        {"kappa_omega": 28.0}, {"rho": 190.0}, {"sigma": 2.0}, {"n": 1.4}, {"kA": (1.0, *(1.1 * k for k in p.kA[1:]))},
        {elastic: tuple(1.2 * k for k in getattr(p, elastic))},
        {"kappa_omega": 28.0, "rho": 190.0, "sigma": 2.0, "n": 1.4},
    ]  # fmt: skip
    for fields in changes:
        change, values = 40 if "n" in fields else 77, dict[str, float]()
        for field, value in fields.items():
            elements = isinstance(value, tuple)
            values |= {f"{field}_{i}": v for i, v in enumerate(value)} if elements else {field: value}
        with form.begun(float(path[0])) as one:
            found = one.along(path[: change + 1], time[: change + 1], *form.outputs)
            assert one.tune(**values) == OK
            found += one.along(path[change:], time[change : path.size], *form.outputs)
        early = form.expected(path[: change + 1], time[: change + 1], {})
        after = replace(form, spring=replace(p, **fields))
        late = after.expected(path[change:], time[change : path.size], {"omega_start": early[-1][-1]})
        late[2] += early[2][-1]
        # A table of another n or sigma inverts omega to 1e-12.
        close_each(np.transpose(found), np.concatenate([early[:, 1:], late[:, 1:]], axis=1), 1e-10)


@pytest.mark.parametrize("name", rows())
def test_values_as_they_are_change_no_bit(name: str) -> None:
    """Fixed ones among them, which OpenModelica sets between steps before its version of August 2026."""
    form = FORMS[name]
    with form.begun() as one:
        form.moved(one)
        causalities = {v.name: v.causality for v in one.library.variables}
        names = [known for known in one.library.references if causalities[known] == "parameter"]
        assert one.tune() == OK
        before = one.serialized()
        assert one.tune(**dict(zip(names, one.get(*names), strict=True))) == OK
        assert one.serialized() == before


@pytest.mark.parametrize("name", ["branches", "branches, fmi3", "branches, python"])
def test_a_changed_branch_keeps_its_elongation(name: str) -> None:
    form = FORMS[name]
    path, time = (values[:30] for values in form.motion())
    with form.begun(float(path[0])) as one:
        one.along(path, time)
        force, elongation = one.get("force", "branch_1_elongation")
        stiffness = form.spring.branches[1].stiffness
        assert one.set(branch_1_stiffness=2.0 * stiffness) == OK
        after = one.get("force", "branch_1_elongation")
        assert after[1] == elongation != 0.0
        assert after[0] - force == pytest.approx(stiffness * elongation, rel=1e-9)
        assert one.set(second_rho=700.0, branch_0_time_constant=0.5) == OK
        assert one.get("force") == pytest.approx(after[:1], rel=1e-12)


@pytest.mark.parametrize("name", STEPPED)
def test_friction_follows_no_reversals_below_the_resolution_of_the_input(name: str) -> None:
    form = FORMS[name]
    p = form.spring
    random, span = np.random.default_rng(3), p.displacement_max - p.displacement_min
    share = 0.5 + 0.4 * np.sin(np.linspace(0.0, 9.0, 150))
    noise = np.geomspace(1.0, 200.0, 150) * 1e-3 * random.uniform(-0.5, 0.5, 150)
    path, time = p.displacement_min + span * np.clip(share + noise, 0.0, 1.0), np.linspace(0.0, 3.0, 150)
    resolution, seen = 0.02 * span, np.empty_like(path)
    expected, without = form.expected(path, time, {}, resolution)[0], form.expected(path, time, {})[0]
    assert np.abs(expected - without).max() > 0.01 * np.abs(expected).max()
    kernel().spring_resolved_path(path.size, address(path), resolution, address(seen))  # what friction follows
    with form.begun(float(path[0]), input_resolution=resolution) as one:
        found = one.get("force")
        for x, h in zip(path[1:].tolist(), np.diff(time).tolist(), strict=True):
            for trial in (-3.0, -0.4, 0.4):
                assert one.set(displacement=x + trial * resolution) == OK
                one.get(*form.outputs)
            one.advance(x, h)
            found += one.get("force")
        close(found, expected, 1e-10)
        slow = PathSolver(p).slow
        if not p.branches:
            close(one.get("absorbed_energy"), slow.absorbed_energy(seen)[-1:], 1e-10)
        if not form.python:
            assert one.directional(["force"], {"displacement": 1.0}) == ERROR
            assert "input_resolution" in one.said
        # Without it friction catches up.
        assert one.set(input_resolution=0.0) == OK
        assert one.get("omega")[0] == pytest.approx(slow.omega(np.append(seen, path[-1]))[-1], abs=1e-12)


# Derivatives

UNKNOWNS = ["force", "stiffness"]


def difference(function: Callable[[float], list[float]], at: float, scale: float) -> np.ndarray:
    """Derivative by central differences over some 1e-4 of `scale`, extrapolated once."""
    coarse, fine = (
        (np.array(function(at + h)) - np.array(function(at - h))) / (2.0 * h) for h in (2e-4 * scale, 1e-4 * scale)
    )
    return np.asarray((4.0 * fine - coarse) / 3.0)


def agree(found: object, expected: np.ndarray, scale: float, values: object) -> bool:
    """Compare with a derivative by `difference`, in which the 1e-13 of the outputs' tables becomes 1e-9."""
    error = np.abs(np.subtract(found, expected)) * abs(scale)
    return bool(np.all(error <= 1e-8 * np.maximum(np.abs(values), 1e-3)))


def knowns(form: Form, one: Native) -> dict[str, float]:
    """Parameters that may be moved by themselves, and their values; the ends of a table are those of the range."""
    last = len(form.spring.FE_knots) - 1
    tied = {"kA_0", "second_kA_0", "input_resolution", "FE_knots_0", f"FE_knots_{last}"}
    tied |= {"displacement_min", "displacement_max"} if form.spring.FE_knots else set()
    names = [v.name for v in one.library.variables if v.causality == "parameter" and v.name not in tied]
    return dict(zip(names, one.get(*names), strict=True))


def step_of(name: str, value: float) -> float:
    """Over which an output is smooth in a parameter."""
    return 1e-3 if name.startswith("FE_knots") else 0.1 * abs(value) or 1.0


def ended(form: Form, one: Native, end: int, **changed: float) -> list[float]:
    """Outputs at a trial at the end of a path, which lies outside the range, or on which parameters are tuned."""
    path, time = (values[:end] for values in form.motion(40))
    trial = changed.pop("displacement", float(path[-1]))
    assert one.Reset() == OK
    one.time = 0.0
    one.begin(**{"displacement": float(path[0]), **form.starts, **changed}).along(path[:-1], time[:-1])
    if end == 13:
        assert one.tune(rho=0.8 * form.spring.rho, sigma=1.1) == OK
    assert one.set(displacement=trial) == OK
    return one.get(*UNKNOWNS)


@pytest.mark.parametrize("end", [4, 13, 29])
@pytest.mark.parametrize("name", NATIVE_PATHS)
def test_derivatives_by_parameters_along_a_path(name: str, end: int) -> None:
    form, found = FORMS[name], dict[str, list[float]]()
    with form.instance() as one:
        values, before, given = (
            ended(form, one, end),
            one.serialized(),
            knowns(form, one) | {"displacement": float(form.motion(40)[0][end - 1])},
        )
        if end == 13:
            del given["rho"], given["sigma"]
        for known in given:
            assert one.directional(UNKNOWNS, {known: 1.0}) == OK, one.said
            found[known] = list(one.found)
        matrix, weights = np.array(list(found.values())), 0.3 * np.arange(1.0, len(found) + 1.0)
        if isinstance(one, Native3):
            for seed, row in zip(np.eye(2).tolist(), matrix.T, strict=True):
                close(one.adjoint(UNKNOWNS, list(found), seed), row)
        assert one.directional(UNKNOWNS, dict(zip(found, weights.tolist(), strict=True))) == OK
        close(list(one.found), weights @ matrix, 1e-11)
        assert one.directional(UNKNOWNS, {}) == OK
        assert (list(one.found), one.serialized()) == ([0.0, 0.0], before)
        for known, value in given.items():

            def moved(v: float, known: str = known) -> list[float]:
                return ended(form, one, end, **{known: v})

            scale = 1e-4 if known == "displacement" else step_of(known, value)
            assert agree(found[known], difference(moved, value, scale), scale, values), known


@pytest.mark.parametrize("share", [0.3, 1.1])
@pytest.mark.parametrize("name", [*NATIVE_PATHS, *STATES])
def test_derivatives_in_initialization_mode_and_of_states(name: str, share: float) -> None:
    """omega is given there, and no energy has been absorbed: what depends on the path does not count."""
    form = FORMS[name]
    p = form.spring
    start = {"displacement": p.displacement_min + share * (p.displacement_max - p.displacement_min)}
    start |= {"velocity": -0.2, "omega": 0.5, "absorbed_energy": 0.3} if form.has_states else form.starts
    with form.instance() as one:
        one.enter_initialization()
        assert one.set(**start) == OK
        unknowns = [v.name for v in one.library.variables if v.causality == "output" or v.name.startswith("der(")]
        for known, value in (knowns(form, one) | start).items():

            def outputs(v: float, known: str = known) -> list[float]:
                assert one.set(**{known: v}) == OK, one.said
                return one.get(*unknowns)

            scale = 0.1 * step_of(known, value)
            expected, at = difference(outputs, value, scale), outputs(value)
            assert one.directional(unknowns, {known: 1.0}) == OK, one.said
            assert agree(list(one.found), expected, scale, at), (known, list(one.found), expected)


@pytest.mark.parametrize("name", [name for name in NATIVE_PATHS if not FORMS[name].exchange])
def test_output_derivatives_follow_the_last_step(name: str) -> None:
    form = FORMS[name]
    low, high = form.spring.displacement_min, form.spring.displacement_max
    end, outputs = 0.6 * high + 0.4 * low, [output for output in form.outputs if output != "omega"]
    with form.begun(low) as one:
        assert one.output_derivatives(*outputs) == [0.0] * len(outputs)
        one.advance(high, 0.1)
        one.advance(end, 0.01)
        found: list[float] = one.output_derivatives(*outputs)  # type: ignore[assignment]
        # They are those at the end of the step, whatever is tried next, or where a step of no size goes.
        assert one.set(displacement=low) == OK
        close(one.output_derivatives(*outputs), found)
        one.advance(end, 0.0)
        close(one.output_derivatives(*outputs), found)
        rate = 0.4 * (low - high) / 0.01
        assert one.directional(outputs, {"displacement": 1.0}) == OK
        if form.spring.branches:  # their forces decay besides
            (before,) = one.get("force")
            one.advance(end + 1e-9 * rate, 1e-9)
            assert found[0] == pytest.approx((one.get("force")[0] - before) / 1e-9, rel=1e-4)  # one-sided
        else:
            close(found, rate * np.array(one.found))
        one.advance(high, 5e-324)
        assert one.output_derivatives("force") == DISCARD
        assert "no derivatives, for `displacement` moved at 1.7976931348623157e+308 m/s" in one.said


# Of the input, by FMI 2.0


@pytest.mark.parametrize("name", ["co-simulation", "table"])
def test_input_derivatives_commit_the_path_through_its_turning_points(name: str) -> None:
    form, random = FORMS[name], np.random.default_rng(5)
    low, high = form.spring.displacement_min, form.spring.displacement_max
    path, ends, found = [low], [], []
    with form.begun(low) as one:
        for k in range(200):
            size = float(10.0 ** random.uniform(-3.0, 0.0))
            start = path[-1] if low < path[-1] < high else float(random.uniform(low, high))  # a jump
            velocity, acceleration = (
                (high - low) * random.uniform(-2.0, 2.0, 2) * [1.0 / size, 2.0 / size**2]
            ).tolist()
            path.append(start)
            if 0.0 < -velocity / acceleration < size:
                path.append(start - 0.5 * velocity**2 / acceleration)
            path.append(start + velocity * size + 0.5 * acceleration * size**2)
            ends.append(len(path) - 1)
            if k % 2:  # in any order
                assert one.set(displacement=start) == one.set_derivatives(velocity, acceleration) == OK
            else:
                assert one.set_derivatives(velocity, acceleration) == one.set(displacement=start) == OK
            assert one.go(0.0, size) == OK
            found.append(one.get(*form.outputs))
            assert one.get("displacement") == [pytest.approx(path[-1], abs=1e-14)]
    assert len(path) > 460  # so many turn inside
    # The FMU and this test round the vertices apart, by 1e-17 m.
    close_each(np.transpose(found), form.expected(np.array(path), np.zeros(len(path)), {})[:, ends], 1e-10)


EXCHANGE = ["model exchange", "fmi3 exchange"]


@pytest.mark.parametrize("name", EXCHANGE)
def test_a_jump_in_event_mode_is_part_of_the_path_and_its_iterations_are_not(name: str) -> None:
    with FORMS[name].begun(0.02) as one:
        one.accept(0.1, 0.03)
        assert one.EnterEventMode() == OK
        for iteration in (0.0, 0.07, 0.045):
            one.set(displacement=iteration)
            close(one.get("force"), PathSolver(SPRING).force(np.array([0.02, 0.03, iteration]))[-1:])
            assert one.NewDiscreteStates(byref(fmpy.fmi2.fmi2EventInfo())) == OK
        assert one.EnterContinuousTimeMode() == OK
        one.accept(0.2, 0.04)
        # Without the vertex 0.045 m it would be one straight stroke to 0.04 m.
        close(one.get("force"), PathSolver(SPRING).force(np.array([0.02, 0.03, 0.045, 0.04]))[-1:])
        for bad in (math.nan, math.inf):
            before = one.serialized()
            assert one.SetTime(c_double(bad)) == ERROR
            assert one.said == f"The time must be finite [s], got {bad!r}."
            assert one.serialized() == before


@pytest.mark.parametrize("name", [*EXCHANGE, "states"])
def test_extrapolating_is_discrete(name: str) -> None:
    """It changes in event mode, which a completed step outside asks for."""
    with FORMS[name].begun(0.02) as one:
        assert not one.at(0.05, 0.2).extrapolating
        assert one.accept(0.1, 0.06)
        assert not one.extrapolating
        one.event()
        assert one.extrapolating
        assert not one.accept(0.2, 0.07)
        assert one.accept(0.3, 0.04)
        assert one.extrapolating
        one.event()
        assert not one.extrapolating
        outside = [text for status, _, text in one.messages if status == WARNING and "identified range" in text]
        assert len(outside) == 1
        assert outside[0].startswith("`displacement` 0.06 m lies outside the identified range")


# The event indicator


@pytest.mark.parametrize("name", EXCHANGE)
def test_the_indicator_finds_turning_points(name: str) -> None:
    """Of parabolas within its slack; of others it misses them by the fourth power of the step."""
    from scipy.optimize import brentq

    slack = 1e-9 * (SPRING.displacement_max - SPRING.displacement_min)  # by which a displacement comes back before it
    with FORMS[name].instance() as one:

        def turn(path: Callable[[float], float], *times: float) -> float:
            """The time at which the indicator falls through zero after steps at all but the last of `times`."""
            one.Reset()
            one.enter_initialization(times[0])
            one.set(displacement=path(times[0]))
            one.ExitInitializationMode()
            one.EnterContinuousTimeMode()
            for time in times[1:-1]:
                one.accept(time, path(time))
            return float(brentq(lambda t: one.at(t, path(t)).indicator, *times[-2:], xtol=1e-15, rtol=1e-14))

        for before, last in itertools.product((0.3, 1e-4, 0.4), (0.4, 0.49)):
            found = turn(lambda t: 0.02 - 0.01 * (t - 0.5) ** 2, 0.0 - before, before, last, 1.0)
            # h*rate = slack, with the rate 0.02*(found - 0.5) m/s and h the time since the accepted point.
            assert 0.02 * (found - 0.5) * (found - last) == pytest.approx(slack, rel=1e-6)  # brentq
        missed = [
            0.01 * t**2 * (1.0 - t / 3.0)
            for h in (0.2, 0.1, 0.05)
            for t in [turn(lambda t: 0.03 - 0.01 * t**2 * (1.0 - t / 3.0), -2.6 * h, -1.6 * h, -0.6 * h, 0.4 * h)]
        ]
        assert np.log2(np.array(missed[:-1]) / missed[1:]) == pytest.approx(4.0, abs=0.15)  # the next order
        assert missed[0] < 1e-6  # 1e-4 m is what the parabola without its vertex would miss


# The form with states


@pytest.mark.parametrize("name", [*STATES, "sharp", "square"])
def test_rates_and_force_are_the_papers(name: str) -> None:
    """Paper eqs. (10) and (11), and dr/dt of a Maxwell branch, at random states."""
    springs = {"sharp": replace(OTHER, n=0.05, sigma=40.0), "square": replace(SPRING, n=100.0)}
    form = Form(springs[name], {"with_states": True}) if name in springs else FORMS[name]
    p, random = form.spring, np.random.default_rng(1)
    with form.begun(p.displacement_offset) as one:
        states = [v.name[4:-1] for v in one.library.variables if v.name.startswith("der(")]
        for _ in range(100):
            x, velocity = random.uniform(p.displacement_min, p.displacement_max), random.normal(0.0, 0.3)
            values = {state: random.uniform(-1.0, 1.0) for state in states}
            one.set(displacement=x, velocity=velocity)
            assert one.set_states(*values.values()) == OK
            omegas = [values[state] for state in ("omega", "second_omega") if state in values]
            elongations = [values[state] for state in states if "elongation" in state]
            branches, parts = (
                list(zip(*pair, strict=True)) for pair in ((p.branches, elongations), (p.mechanisms, omegas))
            )

            def force(x: float, omegas: list[float], held: float = sum(b.stiffness * e for b, e in branches)) -> float:
                at = zip(p.mechanisms, omegas, strict=True)
                return held + sum(float(force_by_definition(m, np.array([x]), w)[0]) for m, w in at)

            close(one.get("force", *states), [force(x, omegas), *values.values()])
            of_omegas = [rate_of_omega(m, velocity, w) for m, w in parts]
            of_elongations = [velocity - e / b.time_constant for b, e in branches]
            rates = {
                "absorbed_energy": force(x, omegas) * velocity,
                "omega": of_omegas[0],
                "second_omega": of_omegas[-1],
            }
            rates |= {f"branch_{i}_elongation": rate for i, rate in enumerate(of_elongations)}
            for found in (one.rates(len(states)), one.get(*(f"der({state})" for state in states))):
                assert found == pytest.approx([rates[state] for state in states], rel=1e-11, abs=1e-11)
            # Along the motion: force is linear in omega and elongations.
            h = 1e-7 / velocity
            ways = [[w + sign * h * rate for w, rate in zip(omegas, of_omegas, strict=True)] for sign in (1.0, -1.0)]
            slope = (force(x + 1e-7, ways[0]) - force(x - 1e-7, ways[1])) / 2e-7 + sum(b.stiffness for b in p.branches)
            assert one.get("stiffness")[0] == pytest.approx(slope, rel=1e-5, abs=1e-5 * p.kappa_omega * p.rho)


def test_states_may_leave_saturation() -> None:
    with FORMS["states"].begun(0.02) as one:
        for omega in (1.0, 1.0003, 2.0):
            one.set_states(0.0, omega)
            one.set(velocity=0.1)
            assert one.rates()[1] == 0.0
            assert one.directional(["der(omega)"], {"omega": 1.0}) == OK
            assert one.found[0] == pytest.approx(0.0 if omega > 1.0 else -31.0 * SPRING.n)
            one.set(velocity=-0.1)
            assert one.rates()[1] == pytest.approx(-0.1 * SPRING.rho * 2.0 * SPRING.sigma)


@pytest.mark.parametrize(("share", "warned"), [(0.0, True), (-1.0, True), (1e3, True), (0.5, True), (1.0, False)])
def test_a_velocity_that_is_not_the_rate_of_the_displacement(share: float, warned: bool) -> None:
    """One warning, once the spring has travelled a twentieth of its range."""
    middle, swing, step = 0.025, 0.02, 0.02 * math.pi
    with FORMS["states"].begun(middle, velocity=share * swing) as one:
        for k in range(1, 300):
            one.set(velocity=share * swing * math.cos(k * step))
            one.accept(k * step, middle + swing * math.sin(k * step))
        assert [status for status, _, _ in one.messages] == [WARNING] * warned
        assert not warned or one.said.startswith("`velocity` must be the rate of `displacement`, but up to time ")
