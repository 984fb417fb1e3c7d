"""The native FMU with continuous states: its equation, its derivatives, and what solvers and CasADi make of it."""

from __future__ import annotations

import ctypes
import itertools
import json
import math
from collections.abc import Sequence
from ctypes import byref, c_double, c_int, c_size_t
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from scipy.integrate import solve_ivp

from fmu_tools import OTHER, SPRING, check_fmu
from native_tools import ERROR, MODEL_EXCHANGE, OK, WARNING, Native, close, doubles, states_library
from oracles import monolithic
from springs import TABLE
from strandspring import SpringParameters
from strandspring.core.polynomials import polynomial
from strandspring.core.variables import start_values
from strandspring.cosimulation import Attachment, Plant
from strandspring.fmu.archive import write_archive
from strandspring.fmu.checks.check import examine_fmu
from strandspring.fmu.native.native_fmu import build_native_fmu, native_contents
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile, save_model
from terminal import Terminal
from tools import slow_but, tool

OUTPUTS = ("force", "stiffness", "absorbed_energy")
RATES = ("der(absorbed_energy)", "der(omega)")
STATES = ("absorbed_energy", "omega")
RANGE = SPRING.displacement_max - SPRING.displacement_min


def of(parameters: SpringParameters = SPRING) -> Native:
    return Native(states_library(parameters), MODEL_EXCHANGE)


@pytest.fixture
def spring():
    with of() as one:
        yield one


def set_states(one: Native, energy: float, omega: float) -> int:
    """fmi2SetContinuousStates."""
    return int(one.SetContinuousStates(doubles([energy, omega]), c_size_t(2)))


def rates(one: Native) -> list[float]:
    """fmi2GetDerivatives."""
    found = (c_double * 2)()
    assert one.GetDerivatives(found, c_size_t(2)) == OK, one.messages[-1]
    return list(found)


# The equation


def force_by_paper(p: SpringParameters, displacement: float, omega: float) -> float:
    """Paper eq. (10)."""
    x = displacement - p.displacement_offset
    return float(polynomial(p.kE, x) + p.kappa_omega * omega * polynomial(p.kA, x))


def slope_by_paper(p: SpringParameters, velocity: float, omega: float) -> float:
    """Paper eq. (11), d(omega)/dt."""
    sign = np.sign(velocity) * np.sign(omega)
    return float(p.rho * velocity * (1.0 - (p.sigma * sign - p.sigma + 1.0) * abs(omega) ** p.n))


@pytest.mark.parametrize("parameters", [SPRING, OTHER, replace(SPRING, n=100.0), replace(OTHER, n=0.05, sigma=40.0)])
def test_rates_and_force_are_the_papers(parameters):
    random = np.random.default_rng(1)
    with of(parameters) as one:
        one.begin_continuous_time()
        for _ in range(200):
            displacement = random.uniform(parameters.displacement_min, parameters.displacement_max)
            velocity, omega, energy = random.normal(0.0, 0.3), random.uniform(-1.0, 1.0), random.normal()
            one.set(displacement=displacement, velocity=velocity)
            assert set_states(one, energy, omega) == OK
            force = force_by_paper(parameters, displacement, omega)
            close(one.get("force", *STATES), [force, energy, omega])
            expected = [force * velocity, slope_by_paper(parameters, velocity, omega)]
            for found in (rates(one), one.get(*RATES)):
                np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("parameters", [SPRING, OTHER, TABLE])
def test_the_closed_form_solves_the_equation(parameters):
    """Along strokes at the omega of the closed form: its tangent is the stiffness, its energy has the power."""
    path = np.linspace(parameters.displacement_min, parameters.displacement_max, 60)
    path = np.concatenate([path, path[::-1][1:40]])
    model = PathSolver(parameters)
    step = 1e-7
    with of(parameters) as one:
        one.begin_continuous_time(displacement=path[0])
        for k in range(1, path.size):
            before, direction = path[: k + 1], np.sign(path[k] - path[k - 1])
            ends = [model.omega(np.append(before, before[-1] + direction * s))[-1] for s in (step, 2.0 * step)]
            omega = model.omega(before)[-1]
            if abs(omega) < 0.01:
                continue  # the cusp
            one.set(displacement=path[k], velocity=direction)
            assert set_states(one, 0.0, omega) == OK
            slope = direction * (4.0 * ends[0] - ends[1] - 3.0 * omega) / (2.0 * step)
            assert direction * rates(one)[1] == pytest.approx(slope, rel=1e-4, abs=1e-5 * parameters.rho)
            close(one.get("force", "stiffness"), [model.force(before)[-1], model.stiffness(before)[-1]], 1e-9)


def test_beyond_saturation_the_slope_is_that_of_saturation(spring):
    spring.begin_continuous_time()
    for omega in (1.0, 1.0003, 2.0):
        set_states(spring, 0.0, omega)
        spring.set(velocity=0.1)
        assert rates(spring)[1] == 0.0
        assert spring.derivatives(RATES, omega=1.0)[1] in (
            (0.0,) if omega > 1.0 else (pytest.approx(-31.0 * SPRING.n),)
        )
        spring.set(velocity=-0.1)
        assert rates(spring)[1] == pytest.approx(-0.1 * SPRING.rho * 2.0 * SPRING.sigma)


def test_nothing_is_remembered(spring):
    """The same inputs and states give the same bits, whatever has been before."""
    values = {"displacement": 0.031, "velocity": -0.2}

    def answers(one: Native) -> list[float]:
        one.set(**values)
        set_states(one, 0.4, -0.6)
        return [
            *one.get("force", "stiffness"),
            *rates(one),
            *one.derivatives([*OUTPUTS, *RATES], displacement=1.0, n=2.0),
        ]

    spring.begin_continuous_time()
    expected = answers(spring)
    random = np.random.default_rng(2)
    for k in range(50):
        spring.set(velocity=random.normal())
        set_states(spring, random.normal(), random.uniform(-1.0, 1.0))
        spring.accept(0.1 * k, random.uniform(0.0, 0.06))
    assert answers(spring) == expected


# Derivatives

POINTS = [(0.03, 0.2, 0.5), (0.03, -0.2, 0.5), (0.012, 0.4, -0.8), (0.06, -0.1, -0.3), (-0.02, 0.1, 0.9)]


@pytest.mark.parametrize("initializing", [True, False], ids=["initialization", "continuous time"])
@pytest.mark.parametrize("point", POINTS)
@pytest.mark.parametrize("parameters", [SPRING, TABLE], ids=["polynomial", "table"])
def test_directional_derivatives(parameters, point, initializing):
    """With respect to inputs, states and parameters, against central differences."""
    low, span = parameters.displacement_min, parameters.displacement_max - parameters.displacement_min
    displacement = low + span * (point[0] - SPRING.displacement_min) / RANGE
    values = {**start_values(parameters, with_states=True)}
    values |= {"displacement": displacement, "velocity": point[1], "omega": point[2], "absorbed_energy": 0.3}
    unknowns = [*OUTPUTS, *RATES]
    with of(parameters) as one:
        if initializing:
            one.enter_initialization()
        else:
            one.begin_continuous_time()
        fixed = {name for name in values if name.startswith(("displacement_", "FE_knots_"))}
        # The first and last knot lie at the ends of the range; kA_0 must be 1.
        tied = {"kA_0"} | ({name for name in fixed if name != "displacement_offset"} if parameters.FE_knots else set())
        states_and_inputs = {name: values[name] for name in ("displacement", "velocity", "omega", "absorbed_energy")}
        assert one.set(**states_and_inputs) == OK
        for name, value in values.items():
            if name in tied or (name in fixed and not initializing):
                continue
            scale = 1e-5 * (abs(value) or 1.0)
            ends = []
            for side in (1.0, -1.0):
                assert one.set(**{name: value + side * scale}) == OK, one.said
                ends.append(np.array(one.get(*unknowns)))
            assert one.set(**{name: value}) == OK
            found = np.array(one.derivatives(unknowns, **{name: 1.0}))
            size = np.abs(one.get(*unknowns)) + 1e-3
            assert np.all(np.abs(found - (ends[0] - ends[1]) / (2.0 * scale)) * scale <= 2e-9 * size), (name, found)
        mixed = one.derivatives(unknowns, velocity=2.0, omega=-0.5)
        single = [np.array(one.derivatives(unknowns, **{name: 1.0})) for name in ("velocity", "omega")]
        close(mixed, 2.0 * single[0] - 0.5 * single[1])


# Solvers


@pytest.mark.parametrize("parameters", [SPRING, replace(SPRING, n=1.0), replace(SPRING, n=20.0)])
def test_a_solver_follows_the_closed_form(parameters):
    """omega as a state of scipy's solver along a sine, between its turns."""
    middle, swing = 0.025, 0.02
    phases = np.array([0.0, 0.5, 1.5, 2.5, 3.5]) * np.pi
    with of(parameters) as one:
        one.begin_continuous_time(displacement=middle)

        def rate(t: float, z: np.ndarray) -> list[float]:
            one.set(displacement=middle + swing * math.sin(t), velocity=swing * math.cos(t))
            set_states(one, *z.tolist())
            return rates(one)

        state = np.zeros(2)
        for begin, end in itertools.pairwise(phases):
            state = solve_ivp(rate, (begin, end), state, rtol=1e-9, atol=1e-11).y[:, -1]
    path, model = middle + swing * np.sin(phases), PathSolver(parameters)
    expected = [model.absorbed_energy(path)[-1], model.omega(path)[-1]]
    np.testing.assert_allclose(state, expected, rtol=1e-6)


def test_fmpy_simulates_it(tmp_path):
    """With CVode; FMPy holds inputs over each step of its solver, so that omega lags behind by half an interval."""
    fmu = build_native_fmu(ModelFile("spring", SPRING), tmp_path, chosen_platforms("host"), zero=0.0, with_states=True)
    time = np.linspace(0.0, 1.0, 4001)
    angle = 4.0 * np.pi * time
    path = 0.025 + 0.02 * np.sin(angle)
    given = np.zeros(time.size, dtype=[("time", float), ("displacement", float), ("velocity", float)])
    given["time"], given["displacement"], given["velocity"] = time, path, 0.02 * 4.0 * np.pi * np.cos(angle)
    expected, errors, messages = PathSolver(SPRING).omega(path), [], []
    for interval in (0.002, 0.001):
        found = fmpy.simulate_fmu(
            str(fmu), stop_time=1.0, output_interval=interval, input=given, relative_tolerance=1e-7,
            output=["omega"], logger=lambda *arguments: messages.append(str(arguments)),
        )  # fmt: skip
        places = np.rint(found["time"] * 4000).astype(int)
        errors.append(float(np.max(np.abs(found["omega"] - expected[places]))))
    print(errors)
    # Half, but for the places of the solver's steps.
    assert errors[1] < 0.6 * errors[0] < 0.6 * 0.1
    assert messages == []


# CasADi

MASS, LOAD = 5.0, 120.0


def casadi_model(parameters: SpringParameters) -> Any:
    return tool("casadi").DaeBuilder("spring", str(states_library(parameters).folder))


def decay(parameters: SpringParameters, solver: str, times: np.ndarray) -> np.ndarray:
    """Position [m] and velocity of a mass on the FMU after a load is put on it, with the solver's defaults."""
    casadi = tool("casadi")
    function = casadi_model(parameters).create("f", ["x", "u"], ["ode", "y"])
    z = casadi.MX.sym("z", 4)  # position, velocity, absorbed_energy, omega
    derivatives, outputs = function(z[2:], z[:2])
    system = {"x": z, "ode": casadi.vertcat(z[1], (LOAD - outputs[0]) / MASS, derivatives)}
    integrator = casadi.integrator("decay", solver, system, 0.0, times.tolist(), {"max_num_steps": 100_000})
    return np.array(integrator(x0=[parameters.displacement_offset, 0.0, 0.0, 0.0])["xf"])


@pytest.mark.parametrize("solver", ["cvodes", "idas"])
@pytest.mark.parametrize("n", slow_but([0.05, 0.22, 1.0, 100.0], (0.22, 100.0)))
def test_a_mass_decays_in_casadi_as_in_the_model(solver, n):
    """Every output time of a free decay, to the closed equations solved with events at each turn."""
    parameters = replace(SPRING, n=n)
    times = np.linspace(0.0, 1.0, 201)
    attachment = Attachment([1.0], offset=parameters.displacement_offset)
    expected = monolithic(Plant([[MASS]], [attachment], lambda _: [LOAD]), [parameters], times)
    found = decay(parameters, solver, times)
    amplitude = np.ptp(expected.displacement)
    error = float(np.max(np.abs(found[0] - expected.displacement[:, 0])) / amplitude)
    print(solver, n, error, expected.reversals, np.max(np.abs(found[3])))
    assert expected.reversals > 5
    # Measured: 1e-6 to 5e-6, and 1.2e-5 for n = 100.
    assert error < 3e-5
    assert np.max(np.abs(found[3])) < 1.001


def test_casadi_differentiates_by_states_inputs_and_parameters():
    builder = casadi_model(SPRING)
    assert builder.x() == ["absorbed_energy", "omega"]
    assert builder.u() == ["displacement", "velocity"]
    names = builder.p()
    assert set(names) == {
        *(f"kE_{i}" for i in range(4)),
        *(f"kA_{i}" for i in range(1, 3)),
        "kappa_omega",
        "rho",
        "sigma",
        "n",
    }
    function = builder.create("f", ["x", "u", "p"], ["ode", "y"])
    jacobian = function.factory("j", ["x", "u", "p"], ["jac:ode:x", "jac:ode:u", "jac:ode:p", "jac:y:p"])
    start = start_values(SPRING, with_states=True)
    point = ([0.0, 0.4], [0.03, 0.1], [start[name] for name in names])
    by_x, by_u, by_p, outputs_by_p = (np.array(matrix) for matrix in jacobian(*point))
    with of() as one:
        one.begin_continuous_time()
        one.set(displacement=0.03, velocity=0.1, omega=0.4)
        for found, unknowns, knowns in (
            (by_x, RATES, STATES), (by_u, RATES, ("displacement", "velocity")), (by_p, RATES, names),
            (outputs_by_p, OUTPUTS, names),
        ):  # fmt: skip
            expected = np.transpose([one.derivatives(unknowns, **{name: 1.0}) for name in knowns])
            # CasADi multiplies and divides by the nominal values, which rounds.
            np.testing.assert_allclose(found, expected, rtol=1e-15)


# The velocity


@pytest.mark.parametrize(("share", "warned"), [(0.0, True), (-1.0, True), (1e3, True), (0.5, True), (1.0, False)])
def test_a_velocity_that_is_not_the_rate_of_the_displacement(spring, share, warned):
    """One warning, once the spring has travelled a twentieth of its range."""
    middle, swing, step = 0.025, 0.02, 0.02 * math.pi
    spring.begin_continuous_time(displacement=middle, velocity=share * swing)
    for k in range(1, 300):
        spring.set(velocity=share * swing * math.cos(k * step))
        spring.accept(k * step, middle + swing * math.sin(k * step))
    assert [status for status, _, _ in spring.messages] == [WARNING] * warned
    if warned:
        assert spring.said.startswith("`velocity` must be the rate of `displacement`, but up to time ")
        assert spring.Reset() == OK


def test_jumps_and_restored_states_are_no_travel(spring):
    spring.begin_continuous_time(displacement=0.025)
    state = spring.serialized()
    for k in range(20):
        spring.event(0.01 + 0.03 * (k % 2))
        spring.accept(0.1 * k, 0.01 + 0.03 * (k % 2))
        assert spring.restore(state) == OK
        spring.accept(0.1 * k, 0.04)
    assert spring.messages == []


# Calls of FMI


def test_it_is_for_model_exchange_alone():
    one = Native(states_library())
    assert one.component is None
    assert one.said == ("This form of the FMU has continuous states and no solver; instantiate it for model exchange.")


def test_states_through_both_doors(spring):
    spring.begin_continuous_time()
    found, nominal = (c_double * 2)(), (c_double * 2)()
    set_states(spring, 3.0, 0.25)
    assert spring.get(*STATES) == [3.0, 0.25]
    assert spring.set(omega=-0.5, absorbed_energy=7.0) == OK
    assert spring.GetContinuousStates(found, c_size_t(2)) == OK
    assert spring.GetNominalsOfContinuousStates(nominal, c_size_t(2)) == OK
    assert list(found) == [7.0, -0.5]
    assert list(nominal) == [SPRING.kappa_omega * RANGE, 1.0]
    assert spring.GetEventIndicators(None, c_size_t(0)) == OK


def test_omega_begins_where_it_is_set():
    with of() as one:
        one.initialize(omega=0.4, absorbed_energy=2.0)
        assert one.get("omega", "absorbed_energy") == [0.4, 2.0]
    with of() as one:
        one.enter_initialization()
        one.set(omega=1.5)
        assert one.ExitInitializationMode() == ERROR
        assert one.said == "`omega` must begin within [-1, 1], got 1.5."


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("omega", math.nan, "`omega` must be within +-1e+100, got nan; the previous value is kept."),
        ("velocity", math.inf, "`velocity` must be within +-1e+09 m/s, got inf; the previous value is kept."),
        (
            "displacement",
            1e10,
            "`displacement` must be within +-1e+09 m, got 10000000000.0; the previous value is kept.",
        ),
        ("der(omega)", 1.0, "`der(omega)` is calculated and cannot be set."),
        ("force", 1.0, "`force` is calculated and cannot be set."),
        ("displacement_max", 1.0, "`displacement_max` is fixed after initialization; reset the instance to change it."),
        ("rho", -1.0, "`rho` must be > 0 [1/m], got -1.0."),
    ],
)
def test_values_that_are_refused_change_nothing(spring, name, value, text):
    spring.begin_continuous_time(velocity=0.1)
    before = spring.serialized()
    assert spring.set(**{"omega": 0.7, name: value}) == ERROR
    assert spring.said == text
    assert spring.serialized() == before
    if name == "omega":
        assert set_states(spring, 0.0, value) == ERROR
        assert spring.said == text
        assert spring.serialized() == before


def calls(one: Native) -> dict[str, partial[int]]:
    """Calls that need a mode, with arguments that are right in it."""
    two, flag = (c_double * 2)(), c_int()
    return {
        "EnterInitializationMode": partial(one.EnterInitializationMode),
        "ExitInitializationMode": partial(one.ExitInitializationMode),
        "SetTime": partial(one.SetTime, c_double(0.0)),
        "SetContinuousStates": partial(one.SetContinuousStates, two, c_size_t(2)),
        "GetContinuousStates": partial(one.GetContinuousStates, two, c_size_t(2)),
        "GetDerivatives": partial(one.GetDerivatives, two, c_size_t(2)),
        "EnterEventMode": partial(one.EnterEventMode),
        "EnterContinuousTimeMode": partial(one.EnterContinuousTimeMode),
        "CompletedIntegratorStep": partial(one.CompletedIntegratorStep, 1, byref(flag), byref(c_int())),
        "DoStep": partial(one.DoStep, c_double(0.0), c_double(0.1), 1),
        "GetRealOutputDerivatives": partial(
            one.GetRealOutputDerivatives, one.references("force"), c_size_t(1), (c_int * 1)(1), two
        ),
        "Terminate": partial(one.Terminate),
    }


@pytest.mark.parametrize(
    ("mode", "allowed"),
    [
        ("instantiated", {"EnterInitializationMode", "Terminate"}),
        ("in event mode", {"SetTime", "GetContinuousStates", "GetDerivatives", "EnterEventMode",
                           "EnterContinuousTimeMode", "Terminate"}),
        ("in continuous-time mode", {"SetTime", "SetContinuousStates", "GetContinuousStates", "GetDerivatives",
                                     "EnterEventMode", "CompletedIntegratorStep", "Terminate"}),
    ],
)  # fmt: skip
def test_calls_in_a_wrong_mode_are_refused_in_words(mode, allowed):
    for name in calls(Native(states_library(), MODEL_EXCHANGE)):
        with of() as one:
            if mode != "instantiated":
                one.initialize()
            if mode == "in continuous-time mode":
                assert one.EnterContinuousTimeMode() == OK
            status = calls(one)[name]()
            assert status == (OK if name in allowed else ERROR), name
            if name not in allowed:
                assert one.said.startswith(f"fmi2{name} must be called ")


def test_counts_of_arrays(spring):
    spring.begin_continuous_time()
    many = (c_double * 3)()
    for call in (spring.SetContinuousStates, spring.GetContinuousStates, spring.GetDerivatives):
        assert call(many, c_size_t(3)) == ERROR
        assert spring.said.endswith("must have 2 elements, got 3.")
    assert spring.GetEventIndicators(many, c_size_t(1)) == ERROR
    assert spring.said == "`eventIndicators` of fmi2GetEventIndicators must have 0 elements, got 1."


@pytest.mark.parametrize(
    ("unknown", "known", "text"),
    [
        ("force", "stiffness", "`stiffness` is calculated; there are no derivatives with respect to it."),
        ("omega", "displacement", "`omega` is not an output, so it has no derivatives."),
        ("rho", "displacement", "`rho` is not an output, so it has no derivatives."),
    ],
)
def test_derivatives_that_there_are_none_of(spring, unknown, known, text):
    spring.begin_continuous_time()
    assert derivative_status(spring, [unknown], [known]) == ERROR
    assert spring.said == text


def derivative_status(one: Native, unknowns: Sequence[str], knowns: Sequence[str]) -> int:
    found = (ctypes.c_double * len(unknowns))()
    return int(
        one.GetDirectionalDerivative(
            one.references(*unknowns), c_size_t(len(unknowns)), one.references(*knowns), c_size_t(len(knowns)),
            doubles([1.0] * len(knowns)), found,
        )
    )  # fmt: skip


def test_parameters_are_tunable_wherever_they_are_set(spring):
    """Nothing depends on a path, so that functional importers may set them beside states and inputs."""
    spring.begin_continuous_time(displacement=0.03, velocity=0.2)
    set_states(spring, 0.0, 0.5)
    assert spring.set(rho=100.0, n=2.0, sigma=4.0, kappa_omega=50.0) == OK
    tuned = replace(SPRING, rho=100.0, n=2.0, sigma=4.0, kappa_omega=50.0)
    close([*spring.get("force"), rates(spring)[1]], [force_by_paper(tuned, 0.03, 0.5), slope_by_paper(tuned, 0.2, 0.5)])
    spring.set(velocity=-0.2)
    close(rates(spring)[1], slope_by_paper(tuned, -0.2, 0.5))


def test_a_state_comes_back_in_another_instance(spring):
    spring.begin_continuous_time(displacement=0.03, velocity=0.2)
    spring.set(rho=100.0)
    set_states(spring, 0.3, 1.0002)
    content = spring.serialized()
    with of() as other:
        assert other.restore(content) == OK
        assert other.get("force", "velocity", "rho", *STATES, *RATES) == spring.get(
            "force", "velocity", "rho", *STATES, *RATES
        )
    with Native(kind=MODEL_EXCHANGE) as usual:
        assert usual.restore(content) == ERROR
        assert usual.said == "The serialized state is from another FMU."


def test_the_range_is_watched(spring):
    spring.begin_continuous_time(displacement=0.03, velocity=0.3)
    assert spring.accept(0.1, 0.06)
    spring.event()
    assert spring.extrapolating
    assert spring.said.startswith("`displacement` 0.06 m lies outside the identified range")


# The file


def test_the_description_is_valid_and_lists_states(tmp_path):
    fmu = build_native_fmu(ModelFile("spring", TABLE), tmp_path, chosen_platforms("host"), with_states=True)
    assert fmu == tmp_path / "spring_states.fmu"
    assert validate_fmu(str(fmu)) == []
    description = fmpy.read_model_description(str(fmu))
    assert description.coSimulation is None
    assert description.modelExchange.modelIdentifier == description.modelName == "spring_states"
    assert description.modelExchange.providesDirectionalDerivative
    assert (description.numberOfContinuousStates, description.numberOfEventIndicators) == (2, 0)
    assert [unknown.variable.name for unknown in description.derivatives] == list(RATES)
    assert [unknown.variable.derivative.name for unknown in description.derivatives] == list(STATES)
    assert [unknown.variable.name for unknown in description.outputs] == list(OUTPUTS)
    assert "omega_start" not in {v.name for v in description.modelVariables}


def test_the_same_model_gives_the_same_bytes(tmp_path):
    model = ModelFile("spring", SPRING)
    paths = [
        build_native_fmu(model, tmp_path / name, chosen_platforms("host"), with_states=True) for name in ("a", "b")
    ]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_the_check_finds_other_rates(tmp_path):
    """A description of another sigma than the binary's."""
    folder = tmp_path / "spring"
    model = ModelFile("spring", SPRING)
    fmu = build_native_fmu(model, folder, chosen_platforms("host"), with_states=True)
    assert check_fmu(fmu).interfaces == ("model exchange",)
    contents = native_contents(model, chosen_platforms("host"), with_states=True)
    description = contents["modelDescription.xml"].replace(b'start="1.3"', b'start="1.4"')
    assert description != contents["modelDescription.xml"]
    write_archive(fmu, {**contents, "modelDescription.xml": description})
    (problem,) = examine_fmu(fmu).problems
    assert "der(omega) differ" in problem or "must be that of the model" in problem


def test_the_documentation_says_what_it_is_for():
    model = ModelFile("spring", SPRING)
    usual, states = (
        native_contents(model, (), with_states=one)["documentation/index.html"].decode() for one in (False, True)
    )
    assert "spring_states.fmu" in usual
    assert "CasADi" in usual
    assert "<td>velocity</td>" in states
    assert "Co-simulation" not in states


def test_the_command_line_builds_it_beside_the_usual_one(tmp_path, capsys):
    model = tmp_path / "mount.json"
    save_model(model, ModelFile("mount", OTHER))
    arguments = ["build", str(model), "--states", "-o", str(tmp_path), "--platform", "host", "--json"]
    fmus = json.loads(Terminal(capsys)(*arguments))["fmus"]
    assert [(Path(one["path"]).name, one["backend"]) for one in fmus] == [
        ("mount.fmu", "native"),
        ("mount_states.fmu", "states"),
    ]
    assert all("give the force of the model" in one["check"] for one in fmus)


def test_it_verifies_itself_and_can_be_built_again(tmp_path, capsys):
    """From the FMU alone, the same bytes."""
    model = ModelFile("spring", SPRING)
    fmu = build_native_fmu(model, tmp_path, chosen_platforms("host"), zero=0.02, with_states=True)
    terminal = Terminal(capsys)
    assert "The reference comes out of model exchange in 401 steps" in terminal("verify", str(fmu))
    terminal("build", str(fmu), "-o", str(tmp_path / "again"), "--platform", "host")
    assert (tmp_path / "again" / fmu.name).read_bytes() == fmu.read_bytes()
