"""Model exchange with the native FMU: what is committed when, the event indicator, and a mass on it under CVODE."""

from __future__ import annotations

import math
from collections.abc import Callable
from ctypes import byref, c_double
from typing import Any

import numpy as np
import pytest
from fmpy.fmi2 import fmi2EventInfo
from fmpy.sundials import CVodeSolver
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fmu_tools import SPRING, wandering_path
from native_tools import ERROR, MODEL_EXCHANGE, OK, WARNING, Native, close, library
from strandspring import SpringParameters
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from strandspring.kernel.path import PathSolver
from tools import slow_but

RANGE = SPRING.displacement_max - SPRING.displacement_min
SLACK = 1e-9  # of the range, by which a displacement comes back before an event


@pytest.fixture
def spring():
    with Native(kind=MODEL_EXCHANGE) as one:
        yield one


def force_at_end(*path: float) -> list[float]:
    return [PathSolver(SPRING).force(np.array(path))[-1]]


# What is committed


def test_accepted_points_are_the_path_and_trials_leave_no_trace(spring):
    path = wandering_path(SPRING, 200, seed=3)
    random = np.random.default_rng(4)
    spring.begin_continuous_time(displacement=path[0])
    found, time = [spring.get("force", "stiffness", "absorbed_energy")], 0.0
    for displacement in path[1:]:
        for _ in range(3):
            spring.at(time + random.uniform(0.0, 2.0), random.uniform(-0.01, 0.06)).get("force")
        time += random.exponential()
        if spring.accept(time, displacement):
            spring.event()
        found.append(spring.get("force", "stiffness", "absorbed_energy"))
    model = PathSolver(SPRING)
    for one, expected in zip(np.array(found).T, (model.force, model.stiffness, model.absorbed_energy), strict=True):
        close(one, expected(path))


def test_a_jump_in_event_mode_is_part_of_the_path_and_its_iterations_are_not(spring):
    spring.begin_continuous_time()
    spring.accept(0.1, 0.03)
    assert spring.EnterEventMode() == OK
    for iteration in (0.0, 0.07, 0.045):
        spring.set(displacement=iteration)
        close(spring.get("force"), force_at_end(0.02, 0.03, iteration))
        assert spring.NewDiscreteStates(byref(fmi2EventInfo())) == OK
    assert spring.EnterContinuousTimeMode() == OK
    spring.accept(0.2, 0.04)
    # Without the vertex 0.045 m it would be one straight stroke to 0.04 m.
    close(spring.get("force"), force_at_end(0.02, 0.03, 0.045, 0.04))


def test_new_discrete_states_asks_for_nothing(spring):
    spring.initialize()
    info = fmi2EventInfo(1, 1, 1, 1, 1, 1.0)
    assert spring.NewDiscreteStates(byref(info)) == OK
    assert [getattr(info, name) for name, _ in fmi2EventInfo._fields_] == [0, 0, 0, 0, 0, 0.0]


def test_extrapolating_is_discrete(spring):
    """It changes in event mode, which a completed step outside asks for."""
    spring.begin_continuous_time()
    assert not spring.at(0.05, 0.2).extrapolating
    assert spring.accept(0.1, 0.06)
    assert not spring.extrapolating
    assert [status for status, _, _ in spring.messages] == [WARNING]
    spring.event()
    assert spring.extrapolating
    assert not spring.accept(0.2, 0.07)
    assert spring.accept(0.3, 0.04)
    assert spring.extrapolating
    spring.event()
    assert not spring.extrapolating
    assert len(spring.messages) == 1


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_time_that_is_not_finite(spring, bad):
    spring.begin_continuous_time()
    before = spring.serialized()
    assert spring.SetTime(c_double(bad)) == ERROR
    assert spring.said == f"The time must be finite [s], got {bad!r}."
    assert spring.serialized() == before


# The event indicator


def turn_found(spring: Native, path: Callable[[float], float], times: list[float]) -> float:
    """The time at which the indicator falls through zero after steps at all but the last of `times`."""
    start, *accepted, last = times
    spring.Reset()
    spring.enter_initialization(start)
    spring.set(displacement=path(start))
    spring.ExitInitializationMode()
    spring.EnterContinuousTimeMode()
    for time in accepted:
        spring.accept(time, path(time))
    return float(brentq(lambda t: spring.at(t, path(t)).indicator, accepted[-1], last, xtol=1e-15, rtol=1e-14))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("times", [[0.0, 0.3, 0.4, 1.0], [0.0, 1e-4, 0.49, 1.0], [-1.0, 0.4, 0.4001, 1.0]])
def test_the_turning_point_of_a_parabola_is_found(spring, side, times):
    def path(t: float) -> float:
        return 0.02 - side * 0.01 * (t - 0.5) ** 2

    turn = turn_found(spring, path, times)
    # h*rate = SLACK*range, with the rate 0.02*(turn - 0.5) m/s and h the time since the last accepted point.
    assert 0.02 * (turn - 0.5) * (turn - times[-2]) == pytest.approx(SLACK * RANGE, rel=1e-6)  # brentq
    assert abs(path(turn) - path(0.5)) < SLACK * RANGE


def test_the_turning_point_is_missed_by_the_fourth_power_of_the_step(spring):
    def path(t: float) -> float:
        return 0.03 - 0.01 * t**2 * (1.0 - t / 3.0)  # turns at t = 0, with a third derivative

    missed = []
    for h in (0.2, 0.1, 0.05):
        turn = turn_found(spring, path, [-2.6 * h, -1.6 * h, -0.6 * h, 0.4 * h])
        missed.append(path(0.0) - path(turn))
    orders = np.log2(np.array(missed[:-1]) / missed[1:])
    assert orders == pytest.approx(4.0, abs=0.15)  # the next order
    assert missed[0] < 1e-6  # 1e-4 m is what the parabola without its vertex would miss


def test_the_indicator_is_positive_where_a_step_begins(spring):
    spring.begin_continuous_time(displacement=0.02)
    time = 0.0
    for displacement in wandering_path(SPRING, 100, seed=6):
        assert spring.indicator > 0.0
        time += 0.1
        spring.accept(time, displacement)
        assert spring.indicator > 0.0
        spring.event()
        assert spring.indicator > 0.0


def test_a_displacement_that_rests_has_no_event(spring):
    spring.begin_continuous_time(displacement=0.02)
    for k in range(1, 100):
        assert spring.at(0.1 * k - 0.05, 0.02).indicator > 0.0
        spring.accept(0.1 * k, 0.02)


def test_a_displacement_that_comes_to_rest_has_one_event_at_most(spring):
    """The parabola through a kink falls back once."""
    spring.begin_continuous_time(displacement=0.02)
    spring.accept(0.1, 0.03)
    events = 0
    for k in range(2, 100):
        events += spring.at(0.1 * k, 0.03).indicator < 0.0
        spring.accept(0.1 * k, 0.03)
    assert events <= 1


def test_points_given_twice_and_times_that_go_back(spring):
    spring.begin_continuous_time(displacement=0.02)
    spring.accept(0.1, 0.03)
    spring.accept(0.2, 0.035)
    assert spring.at(0.3, 0.034).indicator < 0.0
    # A correction keeps what is known of the motion, as does an event without a jump.
    spring.accept(0.2, 0.035 + 1e-8 * RANGE)
    spring.event()
    assert spring.at(0.3, 0.034).indicator < 0.0
    # A jump does not, and neither does a time before.
    for time, displacement in ((0.2, 0.04), (0.1, 0.035)):
        state = spring.serialized()
        spring.accept(time, displacement)
        assert spring.at(0.3, 0.034).indicator > 0.0
        assert spring.restore(state) == OK


def test_the_motion_belongs_to_the_state(spring):
    spring.begin_continuous_time(displacement=0.02)
    spring.accept(0.1, 0.03)
    spring.accept(0.2, 0.035)
    expected = spring.at(0.3, 0.034).indicator
    state = spring.serialized()
    with Native(kind=MODEL_EXCHANGE) as other:
        assert other.restore(state) == OK
        assert other.indicator == expected


def test_trembling_causes_few_events_and_motion_after_it_is_watched_as_before(spring):
    """As of a solver with loose tolerances: turns that follow at the slack's own distance make it grow."""
    spring.begin_continuous_time(displacement=0.02)
    events = 0
    for k in range(1, 1000):
        trembling = 0.02 + (-1) ** k * 1e-7 * RANGE
        events += spring.at(1e-3 * k, trembling).indicator < 0.0
        spring.accept(1e-3 * k, trembling)
    assert 1 <= events <= 10
    assert spring.indicator > 1e-7
    for k in range(1, 30):
        spring.accept(1.0 + 1e-3 * k, 0.02 + 1e-4 * k)
    assert spring.indicator == SLACK


# A mass on the spring under CVODE

MOUNT = SpringParameters(
    (50.0, 20_000.0, 1e5, 2e7), (1.0, 10.0, 100.0), 15.0, 400.0, 1.0, 0.5, 0.05, 0.02, 0.08
)  # fmt: skip
MASS, LOAD, MIDDLE = 5.0, 50.0, 0.05
AMPLITUDE, CIRCULAR = 0.004, 2.0 * np.pi * 7.0
STOP, INTERVAL = 0.4, 1e-3


def base(t: float) -> float:
    return AMPLITUDE * math.sin(CIRCULAR * t)


def base_speed(t: float) -> float:
    return AMPLITUDE * CIRCULAR * math.cos(CIRCULAR * t)


def monolithic(times: np.ndarray) -> np.ndarray:
    """Position of the mass; the model's own memory is committed where the spring turns, which is solved for."""
    law = SpringLaw(MOUNT)
    memory, state, found = stepper.start(MIDDLE, 0.0), np.zeros(2), []
    now, direction = 0.0, -1.0
    while len(found) < times.size:

        def rate(t: float, z: np.ndarray, memory: Any = memory) -> list[float]:
            return [z[1], (LOAD - stepper.force(law, stepper.trial(law, memory, MIDDLE + z[0] - base(t)))) / MASS]

        def turn(t: float, z: np.ndarray, direction: float = direction) -> float:
            return direction * (z[1] - base_speed(t))

        turn.terminal, turn.direction = True, -1.0  # type: ignore[attr-defined]
        piece = solve_ivp(rate, (now, STOP), state, "DOP853", events=turn, dense_output=True, rtol=1e-10, atol=1e-13)
        now, state, direction = piece.t[-1], piece.y[:, -1], -direction
        memory = stepper.trial(law, memory, MIDDLE + state[0] - base(now))
        found += [piece.sol(t)[0] for t in times[len(found) :] if t <= now]
    return np.array(found)


class MassOnSpring:
    """The mass as FMPy's solver takes it, coupled to an instance; it counts evaluations and events.

    Parameters
    ----------
    watched : str   What the solver watches: "indicator", the true "velocity" of the spring, or "nothing".
    """

    def __init__(self, spring: Native, watched: str) -> None:
        self.spring, self.watched = spring, watched
        self.time, self.state, self.direction = 0.0, [0.0, 0.0], -1.0
        self.evaluations = self.events = 0

    def displacement(self) -> float:
        return MIDDLE + self.state[0] - base(self.time)

    def get_state(self, x: Any, _: int) -> None:
        x[0], x[1] = self.state

    def set_state(self, x: Any, _: int) -> None:
        self.state = [x[0], x[1]]

    def set_time(self, time: float) -> None:
        self.time = time

    def get_rate(self, rate: Any, _: int) -> None:
        self.evaluations += 1
        (pull,) = self.spring.at(self.time, self.displacement()).get("force")
        rate[0], rate[1] = self.state[1], (LOAD - pull) / MASS

    def get_indicator(self, z: Any, _: int) -> None:
        z[0] = {
            "indicator": self.spring.at(self.time, self.displacement()).indicator,
            "velocity": self.direction * (self.state[1] - base_speed(self.time)) + 1e-9,
            "nothing": 1.0,
        }[self.watched]

    def get_nominals(self, x: Any, _: int) -> None:
        x[0], x[1] = 0.02, 1.0

    def apply(self, time: float) -> None:
        """The solver's input; the base moves with the state."""

    def run(self, tolerance: float) -> np.ndarray:
        """Positions at every interval, by the loop of FMPy's simulation."""
        solver = CVodeSolver(
            nx=2, nz=1, get_x=self.get_state, set_x=self.set_state, get_dx=self.get_rate, get_z=self.get_indicator,
            get_nominals=self.get_nominals, set_time=self.set_time, input=self, startTime=0.0, maxStep=STOP / 50.0,
            relativeTolerance=tolerance,
        )  # fmt: skip
        positions = [0.0]
        while len(positions) <= round(STOP / INTERVAL):
            goal = len(positions) * INTERVAL
            event, _, self.time = solver.step(self.time, goal)
            asked = self.spring.accept(self.time, self.displacement())
            if event or asked:
                self.events += 1
                self.direction *= -1.0
                self.spring.event()
                solver.reset(self.time)
            if self.time >= goal - 1e-12:
                positions.append(self.state[0])
        return np.array(positions)


@pytest.fixture(scope="module")
def expected() -> np.ndarray:
    return monolithic(np.linspace(0.0, STOP, round(STOP / INTERVAL) + 1))


def solved(watched: str, tolerance: float, expected: np.ndarray) -> tuple[float, MassOnSpring]:
    """The error of a run, relative to the travel of the mass."""
    with Native(library(MOUNT), MODEL_EXCHANGE) as spring:
        mass = MassOnSpring(spring.begin_continuous_time(displacement=MIDDLE), watched)
        positions = mass.run(tolerance)
    return float(np.max(np.abs(positions - expected)) / np.ptp(expected)), mass


@pytest.mark.parametrize("tolerance", slow_but([1e-5, 1e-7, 1e-9], (1e-7,)))
def test_a_mass_agrees_with_the_monolithic_solution(expected, tolerance):
    """Within the error that the solver makes at its tolerance where it can see the velocity, and as fast."""
    found, mass = solved("indicator", tolerance, expected)
    best, seeing = solved("velocity", tolerance, expected)
    print(tolerance, found, best, mass.evaluations, seeing.evaluations)
    assert mass.events == seeing.events == 9
    # Measured: 5.2e-4 and 5.2e-4, 6.8e-6 and ..., 1.4e-7 and ...
    assert found < 1.5 * best
    assert found < 200.0 * tolerance  # error per step against error of the run
    assert mass.evaluations < 1.05 * seeing.evaluations


def test_without_the_indicator_the_error_stalls(expected):
    """Accepted points alone lose the tips between them, and the solver creeps over each kink."""
    watched, mass = solved("indicator", 1e-9, expected)
    blind, other = solved("nothing", 1e-9, expected)
    print(watched, blind, mass.evaluations, other.evaluations)
    assert blind > 100.0 * watched
    assert other.evaluations > mass.evaluations
