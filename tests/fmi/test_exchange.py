"""Model exchange: what is committed when, the event indicator, and the form with states in solvers."""

from __future__ import annotations

import math
from collections.abc import Callable
from ctypes import byref, c_double
from dataclasses import replace

import fmpy
import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, wandering_path
from forms import FORMS, STATES, Form
from native_tools import ERROR, OK, WARNING, Native, close
from oracles import rate_of_omega
from springs import force_by_definition
from strandspring.kernel.path import PathSolver

RANGE = SPRING.displacement_max - SPRING.displacement_min
SLACK = 1e-9  # of the range, by which a displacement comes back before an event
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
    with FORMS[name].instance() as one:
        one.initialize()
        info = fmpy.fmi2.fmi2EventInfo(1, 1, 1, 1, 1, 1.0)
        assert one.NewDiscreteStates(byref(info)) == OK  # asks for nothing
        assert name != "model exchange" or [getattr(info, field) for field, _ in info._fields_] == [0] * 6


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


def turn_found(one: Native, path: Callable[[float], float], times: list[float]) -> float:
    """The time at which the indicator falls through zero after steps at all but the last of `times`."""
    start, *accepted, last = times
    one.Reset()
    one.enter_initialization(start)
    one.set(displacement=path(start))
    one.ExitInitializationMode()
    one.EnterContinuousTimeMode()
    for time in accepted:
        one.accept(time, path(time))
    from scipy.optimize import brentq

    return float(brentq(lambda t: one.at(t, path(t)).indicator, accepted[-1], last, xtol=1e-15, rtol=1e-14))


@pytest.mark.parametrize("name", EXCHANGE)
def test_the_indicator_finds_turning_points(name: str) -> None:
    """Of parabolas within its slack; of others it misses them by the fourth power of the step."""
    with FORMS[name].instance() as one:
        for side in (1.0, -1.0):
            for times in ([0.0, 0.3, 0.4, 1.0], [0.0, 1e-4, 0.49, 1.0], [-1.0, 0.4, 0.4001, 1.0]):

                def path(t: float, side: float = side) -> float:
                    return 0.02 - side * 0.01 * (t - 0.5) ** 2

                turn = turn_found(one, path, times)
                # h*rate = SLACK*range, with the rate 0.02*(turn - 0.5) m/s and h the time since the accepted point.
                assert 0.02 * (turn - 0.5) * (turn - times[-2]) == pytest.approx(SLACK * RANGE, rel=1e-6)  # brentq
        missed = []
        for h in (0.2, 0.1, 0.05):

            def cubic(t: float) -> float:
                return 0.03 - 0.01 * t**2 * (1.0 - t / 3.0)

            missed.append(cubic(0.0) - cubic(turn_found(one, cubic, [-2.6 * h, -1.6 * h, -0.6 * h, 0.4 * h])))
        assert np.log2(np.array(missed[:-1]) / missed[1:]) == pytest.approx(4.0, abs=0.15)  # the next order
        assert missed[0] < 1e-6  # 1e-4 m is what the parabola without its vertex would miss


def test_the_indicator_and_the_motion_belong_to_the_state() -> None:
    form = FORMS["model exchange"]
    with form.begun(0.02) as one, form.instance() as other:
        for k, displacement in enumerate(wandering_path(SPRING, 100, seed=6)):  # a step begins without an event
            assert one.indicator > 0.0
            one.accept(0.1 * (k + 1), displacement)
        one.event(0.02)
        one.accept(20.1, 0.03)
        one.accept(20.2, 0.035)
        expected = one.at(20.3, 0.034).indicator
        assert expected < 0.0
        assert other.restore(one.serialized()) == OK
        assert other.indicator == expected
        # A correction keeps what is known of the motion, as does an event without a jump.
        one.accept(20.2, 0.035 + 1e-8 * RANGE)
        one.event()
        assert one.at(20.3, 0.034).indicator < 0.0
        for time, displacement in ((20.2, 0.04), (20.1, 0.035)):  # a jump does not, and neither does a time before
            state = one.serialized()
            one.accept(time, displacement)
            assert one.at(20.3, 0.034).indicator > 0.0
            assert one.restore(state) == OK


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
            parts = list(zip(p.mechanisms, omegas, strict=True))
            force = sum(float(force_by_definition(m, np.array([x]), w)[0]) for m, w in parts)
            force += sum(b.stiffness * e for b, e in zip(p.branches, elongations, strict=True))
            close(one.get("force", *states), [force, *values.values()])
            # Along the motion: dF/dx at this omega, and what omega changes.
            side, h = float(np.sign(velocity)), 1e-7
            slope = sum(b.stiffness for b in p.branches)
            for m, w in parts:
                below, above, beyond = force_by_definition(m, np.array([x - h, x + h, x]), np.array([w, w, w + 1.0]))
                at = float(force_by_definition(m, np.array([x]), w)[0])
                slope += (above - below) / (2.0 * h) + (beyond - at) * rate_of_omega(m, side, w) * side
            assert one.get("stiffness")[0] == pytest.approx(slope, rel=1e-5, abs=1e-5 * p.kappa_omega * p.rho)
            rates = {"absorbed_energy": force * velocity}
            rates |= {f"{'second_' * i}omega": rate_of_omega(m, velocity, w) for i, (m, w) in enumerate(parts)}
            rates |= {
                f"branch_{i}_elongation": velocity - e / b.time_constant
                for i, (b, e) in enumerate(zip(p.branches, elongations, strict=True))
            }
            for found in (one.rates(len(states)), one.get(*(f"der({state})" for state in states))):
                assert found == pytest.approx([rates[state] for state in states], rel=1e-11, abs=1e-11)


def test_states_are_all_that_is_remembered_and_may_leave_saturation() -> None:
    with FORMS["states"].begun(0.02) as one:

        def answers() -> list[float]:
            one.set(displacement=0.031, velocity=-0.2)
            one.set_states(0.4, -0.6)
            assert one.directional(["force", "der(omega)"], {"displacement": 1.0, "n": 2.0}) == OK
            return [*one.get("force", "stiffness"), *one.rates(), *one.found]

        expected, random = answers(), np.random.default_rng(2)
        for k in range(50):
            one.set(velocity=random.normal())
            one.set_states(random.normal(), random.uniform(-1.0, 1.0))
            one.accept(0.1 * k, random.uniform(0.0, 0.06))
        assert answers() == expected
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
    """One warning, once the spring has travelled a twentieth of its range; jumps and restored states are no travel."""
    middle, swing, step = 0.025, 0.02, 0.02 * math.pi
    with FORMS["states"].begun(middle, velocity=share * swing) as one:
        for k in range(1, 300):
            one.set(velocity=share * swing * math.cos(k * step))
            one.accept(k * step, middle + swing * math.sin(k * step))
        assert [status for status, _, _ in one.messages] == [WARNING] * warned
        assert not warned or one.said.startswith("`velocity` must be the rate of `displacement`, but up to time ")
    with FORMS["states"].begun(0.025) as one:
        state = one.serialized()
        for k in range(20):
            one.event(0.01 + 0.03 * (k % 2))
            one.accept(0.1 * k, 0.01 + 0.03 * (k % 2))
            assert one.restore(state) == OK
            one.accept(0.1 * k, 0.04)
        assert one.messages == []
