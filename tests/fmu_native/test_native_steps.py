"""Steps of the native FMU: input derivatives, the status of steps, and steps that are refused."""

from __future__ import annotations

from ctypes import byref, c_double, c_int, c_size_t

import numpy as np
import pytest

from fmu_tools import SPRING
from native_tools import DISCARD, ERROR, OK, Native, close, doubles
from strandspring.kernel.path import PathSolver

OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")


@pytest.fixture
def spring():
    with Native() as one:
        yield one


def parabolas(random: np.random.Generator, count: int) -> list[tuple[float, float, float, float]]:
    """Displacement, velocity, acceleration and size of steps; most turn back inside, some begin with a jump."""
    end, steps = 0.02, []
    for _ in range(count):
        size = 10.0 ** random.uniform(-3, 0)
        start = end if random.uniform() < 0.8 else float(random.uniform(0.005, 0.045))
        turn, goal = random.uniform(0.0, 1.5) * size, random.uniform(0.0, 0.05)
        # Velocity zero at `turn`, displacement `goal` at the end.
        acceleration = (goal - start) / (0.5 * size**2 - turn * size) if abs(turn - 0.5 * size) > 0.05 * size else 0.0
        velocity = -acceleration * turn if acceleration else (goal - start) / size
        steps.append((start, velocity, acceleration, size))
        end = start + size * (velocity + 0.5 * acceleration * size)
    return steps


def vertices(steps: list[tuple[float, float, float, float]]) -> tuple[np.ndarray, list[int]]:
    """The path through all turning points, and where in it each step ends."""
    path, ends = [steps[0][0]], []
    for start, velocity, acceleration, size in steps:
        path.append(start)
        if acceleration and 0.0 < -velocity / acceleration < size:
            path.append(start - 0.5 * velocity**2 / acceleration)
        path.append(start + velocity * size + 0.5 * acceleration * size**2)
        ends.append(len(path) - 1)
    return np.array(path), ends


def test_input_derivatives_commit_the_path_through_its_turning_points(spring):
    steps = parabolas(np.random.default_rng(5), 300)
    path, ends = vertices(steps)
    assert path.size - 2 * len(steps) > 100  # so many turn inside
    spring.initialize(displacement=path[0])
    found = []
    for start, velocity, acceleration, size in steps:
        spring.set(displacement=start)
        assert spring.set_derivatives(velocity, acceleration) == OK
        assert spring.DoStep(c_double(0.0), c_double(size), 1) == OK
        found.append(spring.get(*OUTPUTS))
        assert spring.get("displacement") == [pytest.approx(path[ends[len(found) - 1]], abs=1e-15)]
    model = PathSolver(SPRING)
    for values, expected in zip(
        np.array(found).T, (model.force, model.stiffness, model.absorbed_energy, model.omega), strict=True
    ):
        # The FMU and this test round the vertices apart, by 1e-17 m.
        close(values, expected(path)[ends], 1e-11)


def test_a_trial_before_the_step_answers_to_its_beginning(spring):
    spring.initialize()
    spring.set(displacement=0.03)
    spring.set_derivatives(5.0, 1.0)
    close(spring.get("force"), PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1:])


def test_input_derivatives_hold_for_one_step(spring):
    spring.initialize()
    spring.set_derivatives(1.0)
    spring.step(0.02, size=0.01)
    assert spring.get("displacement") == [pytest.approx(0.03, rel=1e-15)]
    assert spring.step(0.025, "displacement", size=0.01) == [0.025]
    close(spring.get("force"), PathSolver(SPRING).force(np.array([0.02, 0.03, 0.025]))[-1:])
    # Nor is the rate at its end that of the derivatives.
    (stiffness,) = spring.get("stiffness")
    close(spring.output_derivatives("force"), [stiffness * (0.025 - 0.03) / 0.01])


def test_the_order_in_which_value_and_derivatives_are_set_does_not_matter():
    forces = []
    for first in (True, False):
        with Native() as one:
            one.initialize()
            if first:
                one.set_derivatives(1.0)
            one.set(displacement=0.025)
            if not first:
                one.set_derivatives(1.0)
            one.DoStep(c_double(0.0), c_double(0.01), 1)
            forces.append(one.get("force"))
    assert forces[0] == forces[1]


def test_an_excursion_inside_a_step_is_reported(spring):
    spring.initialize(displacement=0.045)
    spring.set(displacement=0.045)
    spring.set_derivatives(2.0, -200.0)  # up to 0.055 m and back
    assert spring.DoStep(c_double(0.0), c_double(0.02), 1) == OK
    assert spring.get("displacement") == [pytest.approx(0.045, abs=1e-15)]
    assert not spring.extrapolating
    assert [text.split()[1] for _, _, text in spring.messages] == ["0.055"]


@pytest.mark.parametrize(
    ("values", "orders", "name", "text"),
    [
        ([np.nan], [1], "displacement", "derivative of order 1 of `displacement` must be finite, got nan"),
        ([np.inf], [2], "displacement", "derivative of order 2 of `displacement` must be finite, got inf"),
        ([1.0], [3], "displacement", "must be 1 or 2, got 3"),
        ([1.0], [0], "displacement", "must be 1 or 2, got 0"),
        ([1.0], [1], "force", "`force` is not an input"),
        ([1.0], [1], "rho", "`rho` is not an input"),
    ],
)
def test_input_derivatives_that_are_refused(spring, values, orders, name, text):
    spring.initialize()
    before = spring.serialized()
    assert spring.set_derivatives(0.1, *values, orders=[1, *orders], names=["displacement", name]) == ERROR
    assert text in spring.said
    assert spring.serialized() == before


def test_derivatives_that_leave_the_numbers_are_refused(spring):
    spring.initialize()
    spring.set_derivatives(1e200, 1e308)
    before = spring.serialized()
    assert spring.DoStep(c_double(0.0), c_double(1e10), 1) == ERROR
    assert "1e+200 m/s and 1e+308 m/s^2 of `displacement` must keep it within +-1e+09 m" in spring.said
    assert spring.serialized() == before


def test_the_least_acceleration_in_the_longest_step_is_refused(spring):
    # 2.5e18 m; half of the acceleration would be 0.
    spring.initialize()
    spring.set_derivatives(0.0, 5e-324)
    before = spring.serialized()
    assert spring.DoStep(c_double(0.0), c_double(1e171), 1) == ERROR
    assert "of `displacement` must keep it within +-1e+09 m" in spring.said
    assert spring.serialized() == before


def test_a_rate_at_the_end_of_a_step_that_none_can_have_is_refused(spring):
    # 0.5 m in 1e-300 s.
    spring.initialize()
    spring.set_derivatives(0.0, 1e300)
    before = spring.serialized()
    assert spring.DoStep(c_double(0.0), c_double(1e-150), 1) == ERROR
    assert spring.said == (
        "The derivatives 0.0 m/s and 1e+300 m/s^2 of `displacement` must keep it within +-1e+09 m, and its rate within "
        "+-1e+09 m/s, in the step at time 0.0 s."
    )
    assert spring.serialized() == before


def test_outputs_have_no_derivatives_after_a_jump(spring):
    spring.initialize()
    spring.step(0.03, size=5e-324)
    found = doubles([7.0])
    assert spring.GetRealOutputDerivatives(spring.references("force"), c_size_t(1), (c_int * 1)(1), found) == DISCARD
    assert spring.said.startswith(
        "The outputs have no derivatives, for `displacement` moved at 1.7976931348623157e+308 m/s"
    )
    assert found[0] == 7.0
    spring.step(0.02)
    assert np.all(np.isfinite(spring.output_derivatives("force", "stiffness")))


def test_status_of_steps(spring):
    spring.initialize()
    spring.step(0.03, time=0.25, size=0.5)
    time, terminated = c_double(), c_int(-1)
    assert spring.GetRealStatus(2, byref(time)) == OK
    assert spring.GetBooleanStatus(3, byref(terminated)) == OK
    assert (time.value, terminated.value) == (0.75, 0)
    for call, kind in (("GetStatus", 0), ("GetStringStatus", 1), ("GetIntegerStatus", 0), ("GetRealStatus", 3)):
        assert getattr(spring, call)(kind, byref(c_double())) == DISCARD
        assert "steps of this FMU are never pending" in spring.said
