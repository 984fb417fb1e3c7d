"""Directional and output derivatives of the native FMU against differences of its own outputs."""

from __future__ import annotations

from ctypes import byref, c_double, c_int, c_size_t

import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, wandering_path
from native_tools import DISCARD, ERROR, MODEL_EXCHANGE, OK, Native, close, doubles, library
from strandspring.core.variables import start_values

UNKNOWNS = ("force", "stiffness")
OUTPUTS = (*UNKNOWNS, "absorbed_energy")
# Inside and outside the identified range of SPRING, both ways; and of OTHER.
PATHS = {
    SPRING: (np.array([0.021, 0.032, 0.0251, 0.0373]), np.array([0.021, 0.045, 0.058]), np.array([0.03, 0.01, -0.004])),
    OTHER: (np.array([-0.01, 0.04, 0.011, 0.023]), np.array([0.0, 0.12]), np.array([0.0, -0.13])),
}
CASES = [(parameters, path) for parameters, paths in PATHS.items() for path in paths]


@pytest.fixture
def spring():
    with Native() as one:
        yield one


def along(parameters, path, *names: str, **changed: float) -> list[float]:
    """Outputs at the end of a path, with changed parameters."""
    with Native(library(parameters)) as one:
        one.initialize(displacement=path[0], **changed)
        for displacement in path[1:]:
            one.step(displacement)
        return one.get(*names)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_seeds_that_are_not_finite_are_refused(spring, bad):
    spring.initialize()
    assert directional(spring, "force", "rho", bad) == ERROR
    assert spring.said == f"The seed of `rho` must be finite, got {bad!r}."


def test_a_derivative_that_overflows_is_discarded(spring):
    spring.initialize()
    assert directional(spring, "force", "displacement", 1e308) == DISCARD
    assert spring.said == "The directional derivative of `force` overflows; use smaller seeds."


def directional(one: Native, unknown: str, known: str, seed: float) -> int:
    return one.GetDirectionalDerivative(
        one.references(unknown), c_size_t(1), one.references(known), c_size_t(1), doubles([seed]), doubles([0.0])
    )


def difference(function, at: float, scale: float) -> np.ndarray:
    """Derivative by central differences over some 1e-4 of `scale`, extrapolated once."""
    coarse, fine = (
        (np.array(function(at + h)) - np.array(function(at - h))) / (2.0 * h) for h in (2e-4 * scale, 1e-4 * scale)
    )
    return (4.0 * fine - coarse) / 3.0


def agree(found, expected, scale: float, values) -> bool:
    """Compare with a derivative by `difference`, in which the 1e-13 of the outputs' tables becomes 1e-9."""
    return bool(np.all(np.abs(np.subtract(found, expected)) * abs(scale) <= 1e-8 * np.abs(values)))


def step_of(value: float) -> float:
    """Over which an output is smooth in a parameter."""
    return 0.1 * abs(value) or 1.0


@pytest.mark.parametrize(("parameters", "path"), CASES)
def test_derivatives_by_parameters(parameters, path):
    start = {**start_values(parameters), "omega_start": 0.25}
    with Native(library(parameters)) as one:
        one.initialize(displacement=path[0], omega_start=0.25)
        for displacement in path[1:]:
            one.step(displacement)
        values = one.get(*UNKNOWNS)
        found = {name: one.derivatives(UNKNOWNS, **{name: 1.0}) for name in start if name != "input_resolution"}
    for name in (name for name in start if name not in ("displacement", "kA_0", "input_resolution")):

        def outputs(value: float, name: str = name) -> list[float]:
            return along(parameters, path, *UNKNOWNS, **{"omega_start": 0.25, name: value})

        scale = step_of(start[name])
        assert agree(found[name], difference(outputs, start[name], scale), scale, values), name
    # kA[0] must be 1, but all of kA and kappa_omega multiply the same.
    by_kA = sum(coefficient * np.array(found[f"kA_{i}"]) for i, coefficient in enumerate(parameters.kA))
    close(by_kA, parameters.kappa_omega * np.array(found["kappa_omega"]))


@pytest.mark.parametrize("name", ["rho", "sigma", "n", "kappa_omega", "omega_start"])
def test_derivatives_by_a_parameter_count_from_its_last_change(name):
    path, change = PATHS[SPRING][0], 2
    tuned = {"rho": 0.8 * SPRING.rho, "sigma": 1.1 * SPRING.sigma}
    start = {**start_values(SPRING), "omega_start": 0.25, **tuned}

    def outputs(value: float) -> list[float]:
        """Along the path, the parameter being `value` throughout, or from the change on if it is tuned there."""
        with Native() as one:
            first = {} if name in tuned else {name: value}
            one.initialize(**{"displacement": path[0], "omega_start": 0.25, **first})
            for k, displacement in enumerate(path[1:], start=1):
                if k == change:
                    assert one.set(**tuned, **({name: value} if name not in (*tuned, "omega_start") else {})) == OK
                    if name in tuned:
                        assert one.set(**{name: value}) == OK
                one.step(displacement)
            derivatives.append(one.derivatives(UNKNOWNS, **{name: 1.0}))
            return one.get(*UNKNOWNS)

    derivatives: list[list[float]] = []
    scale = step_of(start[name])
    expected, values = difference(outputs, start[name], scale), outputs(start[name])
    assert agree(derivatives[-1], expected, scale, values)


@pytest.mark.parametrize(("parameters", "path"), CASES)
def test_derivatives_by_displacement_at_a_trial(parameters, path):
    with Native(library(parameters)) as one:
        one.initialize(displacement=path[0])
        for displacement in path[1:-1]:
            one.step(displacement)

        def outputs(trial: float) -> list[float]:
            assert one.set(displacement=trial) == OK
            return one.get(*OUTPUTS)

        scale = 0.1 * (path[-1] - path[-2])
        expected = difference(outputs, path[-1], scale)
        values = outputs(path[-1])
        found = one.derivatives(OUTPUTS, displacement=1.0)
        assert agree(found, expected, scale, values)
        assert (found[0], found[2]) == (values[1], values[0])


def test_derivatives_in_model_exchange():
    path = PATHS[SPRING][0]
    with Native() as slave, Native(kind=MODEL_EXCHANGE) as model:
        slave.initialize(displacement=path[0])
        model.begin_continuous_time(displacement=path[0])
        for time, displacement in enumerate(path[1:-1], start=1):
            slave.step(displacement)
            model.accept(float(time), displacement)
        for one in (slave, model):
            one.set(displacement=path[-1])
        found, expected = (one.derivatives(UNKNOWNS, displacement=1.0, rho=2.0) for one in (model, slave))
    assert found == expected


@pytest.mark.parametrize("start", [0.015, 0.03, 0.06, -0.01])
def test_derivatives_in_initialization_mode(spring, start):
    """omega is given there, and no energy has been absorbed: what depends on the path does not count."""
    given = {**start_values(SPRING), "displacement": start, "omega_start": -0.3}
    spring.enter_initialization()
    spring.set(displacement=start, omega_start=-0.3)
    values = spring.get(*OUTPUTS)
    assert spring.derivatives(OUTPUTS, input_resolution=1.0) == [0.0] * len(OUTPUTS)
    for name in (name for name in given if name not in ("kA_0", "input_resolution")):

        def outputs(value: float, name: str = name) -> list[float]:
            spring.set(**{name: value})
            return spring.get(*OUTPUTS)

        scale = step_of(given[name])
        expected = difference(outputs, given[name], scale)
        spring.set(**{name: given[name]})
        assert agree(spring.derivatives(OUTPUTS, **{name: 1.0}), expected, scale, values), name


def test_seeds_add_up(spring):
    spring.initialize(displacement=0.021)
    spring.step(0.03)
    spring.step(0.025)
    seeds = {"displacement": 1e-3, "rho": -20.0, "kE_1": 30.0, "omega_start": 0.2}
    one_by_one = np.array([spring.derivatives(UNKNOWNS, **{name: seed}) for name, seed in seeds.items()])
    close(spring.derivatives(UNKNOWNS, **seeds), one_by_one.sum(axis=0))
    assert spring.derivatives(UNKNOWNS) == [0.0, 0.0]


def test_derivatives_leave_no_trace(spring):
    spring.initialize()
    spring.step(0.03)
    spring.set(displacement=0.025)
    before = spring.serialized()
    spring.derivatives(OUTPUTS, displacement=1.0)
    spring.output_derivatives(*OUTPUTS)
    assert spring.serialized() == before


def test_derivatives_by_parameters_go_on_from_a_state(spring):
    path = wandering_path(SPRING, 40, seed=9)
    spring.initialize(displacement=path[0])
    for displacement in path[1:20]:
        spring.step(displacement)
    state = spring.serialized()
    runs = []
    for _ in range(2):
        assert spring.restore(state) == OK
        for displacement in path[20:]:
            spring.step(displacement)
        runs.append([spring.derivatives(UNKNOWNS, **{name: 1.0}) for name in ("rho", "sigma", "n", "omega_start")])
    assert runs[0] == runs[1]
    assert np.all(np.array(runs[0])[:3] != 0.0)


@pytest.mark.parametrize(
    ("unknown", "known", "text"),
    [
        ("absorbed_energy", "rho", "with respect to `rho` is available in initialization mode only."),
        ("displacement", "displacement", "`displacement` is not an output"),
        ("omega", "displacement", "`omega` is not an output"),
        ("rho", "displacement", "`rho` is not an output"), ("force", "stiffness", "`stiffness` is calculated"),
        ("force", "omega", "`omega` is calculated"), ("force", "input_resolution", "respect to `input_resolution`"),
        ("extrapolating", "displacement", "is Boolean, not Real"),
        ("force", "extrapolating", "is Boolean, not Real"),
    ],
)  # fmt: skip
def test_derivatives_that_are_refused(spring, unknown, known, text):
    spring.initialize()
    found = doubles([7.0, 7.0])
    status = spring.GetDirectionalDerivative(
        spring.references("force", unknown), c_size_t(2), spring.references("displacement", known), c_size_t(2),
        doubles([1.0, 1.0]), found,
    )  # fmt: skip
    assert status == ERROR
    assert text in spring.said
    assert [*found] == [7.0, 7.0]


# Output derivatives


def test_no_motion_no_output_derivatives(spring):
    spring.initialize()
    assert spring.output_derivatives(*OUTPUTS) == [0.0, 0.0, 0.0]


def test_output_derivatives_follow_the_last_step(spring):
    spring.initialize()
    spring.step(0.03)
    spring.step(0.0251, size=0.01)
    rate = (0.0251 - 0.03) / 0.01
    expected = rate * np.array(spring.derivatives(OUTPUTS, displacement=1.0))
    # They are those at the end of the step, whatever is tried next, or where a step of no size goes.
    spring.set(displacement=0.04)
    close(spring.output_derivatives(*OUTPUTS), expected)
    spring.step(0.0251, size=0.0)
    close(spring.output_derivatives(*OUTPUTS), expected)


def test_output_derivatives_with_input_derivatives(spring):
    """Against differences over time along x(s) = x0 + v*s + a*s^2/2, which turns back at 0.1 s."""
    start, velocity, acceleration, size = 0.03, 0.2, -2.0, 0.15
    spring.initialize(displacement=start)

    def outputs(time: float) -> list[float]:
        spring.SetFMUstate(state)
        spring.set_derivatives(velocity, acceleration)
        assert spring.DoStep(c_double(0.0), c_double(time), 1) == OK
        return spring.get(*OUTPUTS)

    state = spring.snapshot()
    expected = difference(outputs, size, 0.01)
    values = outputs(size)
    assert agree(spring.output_derivatives(*OUTPUTS), expected, 0.01, values)
    assert spring.FreeFMUstate(byref(state)) == OK


@pytest.mark.parametrize(
    ("name", "order", "text"),
    [
        ("force", 0, "order of the derivative of `force` must be 1, got 0"), ("force", 2, "must be 1, got 2"),
        ("displacement", 1, "`displacement` is not an output"), ("omega", 1, "`omega` is not an output"),
        ("rho", 1, "`rho` is not an output"), ("extrapolating", 1, "is Boolean, not Real"),
    ],
)  # fmt: skip
def test_output_derivatives_that_are_refused(spring, name, order, text):
    spring.initialize()
    found = doubles([7.0, 7.0])
    orders = (c_int * 2)(1, order)
    assert spring.GetRealOutputDerivatives(spring.references("force", name), c_size_t(2), orders, found) == ERROR
    assert text in spring.said
    assert [*found] == [7.0, 7.0]
