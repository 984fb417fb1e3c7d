"""Directional, adjoint and output derivatives of FMUs against differences of their outputs, and input derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from ctypes import byref, c_double, c_int, c_size_t

import numpy as np
import pytest
from scipy.optimize import least_squares

from fmu_tools import SPRING
from forms import FORMS, NATIVE_PATHS, Form, Instance, Instance3, motion, rows
from native_tools import DISCARD, ERROR, OK, close, doubles
from strandspring.core.variables import start_values
from strandspring.kernel.path import PathSolver

UNKNOWNS = ["force", "stiffness"]
DIFFERENTIABLE = [name for name in NATIVE_PATHS if "arrays" not in FORMS[name].options]
# Real-time FMUs give none by parameters of the path after initialization.
TABULATED = [name for name in DIFFERENTIABLE if "real_time" not in FORMS[name].options]


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


def knowns(form: Form, one: Instance) -> dict[str, float]:
    """Parameters that may be moved by themselves, and their values; the ends of a table are those of the range."""
    last = len(form.spring.FE_knots) - 1
    tied = {"kA_0", "second_kA_0", "input_resolution", "FE_knots_0", f"FE_knots_{last}"}
    tied |= {"displacement_min", "displacement_max"} if form.spring.FE_knots else set()
    names = [v.name for v in one.library.variables if v.causality == "parameter" and v.name not in tied]
    return dict(zip(names, one.get(*names), strict=True))


def step_of(name: str, value: float) -> float:
    """Over which an output is smooth in a parameter."""
    return 1e-3 if name.startswith("FE_knots") else 0.1 * abs(value) or 1.0


@pytest.mark.parametrize("end", [4, 13, 29])
@pytest.mark.parametrize("name", TABULATED)
def test_by_parameters_along_a_path(name: str, end: int) -> None:
    """Inside and outside the identified range, at a trial, and where a parameter is tuned on the way."""
    form = FORMS[name]
    path, time = (values[:end] for values in motion(form.spring, 40))

    def run(ask: bool = False, **changed: float) -> list[float]:
        with form.begun(float(path[0]), **{**form.starts, **changed}) as one:
            one.along(path[:-1], time[:-1])
            if end == 13:
                tuned = {} if "rho" in changed else {"rho": 0.8 * form.spring.rho}
                assert one.tune(**tuned, sigma=changed.get("sigma", 1.0) * 1.1) == OK
            assert one.set(displacement=float(path[-1])) == OK
            if ask:
                given = {k: v for k, v in knowns(form, one).items() if end != 13 or k not in ("rho", "sigma")}
                for known, value in given.items():
                    assert one.directional(UNKNOWNS, {known: 1.0}) == OK, one.said
                    found[known] = (value, list(one.found))
                if isinstance(one, Instance3):
                    matrix = np.transpose([row for _, row in found.values()])
                    for seed, row in zip(np.eye(2).tolist(), matrix, strict=True):
                        close(one.adjoint(UNKNOWNS, list(found), seed), row)
                seeds = {k: 0.3 * (i + 1) for i, k in enumerate(found)}
                assert one.directional(UNKNOWNS, seeds) == OK
                close(list(one.found), sum(s * np.array(found[k][1]) for k, s in seeds.items()), 1e-11)
            return one.get(*UNKNOWNS)

    found: dict[str, tuple[float, list[float]]] = {}
    values = run(ask=True)
    assert len(found) > 10
    for known, (value, derivative) in found.items():
        scale = step_of(known, value)
        expected = difference(lambda v, known=known: run(**{known: v}), value, scale)  # type: ignore[misc]
        assert agree(derivative, expected, scale, values), known


@pytest.mark.parametrize("name", DIFFERENTIABLE)
def test_by_displacement_at_a_trial_and_leaving_no_trace(name: str) -> None:
    form = FORMS[name]
    path, time = (values[:30] for values in motion(form.spring))
    with form.begun(float(path[0])) as one:
        one.along(path, time)
        turn = float(path[-1]) - 0.1 * (path[-1] - path[-2] or 1e-3)
        assert one.set(displacement=turn) == OK
        before = one.serialized()
        unknowns = [output for output in form.outputs if output != "omega"]
        assert one.directional(unknowns, {"displacement": 1.0}) == OK
        found = list(one.found)
        assert one.directional(unknowns, {}) == OK
        assert list(one.found) == [0.0] * len(unknowns)
        assert one.serialized() == before

        def outputs(trial: float) -> list[float]:
            assert one.set(displacement=trial) == OK
            return one.get(*unknowns)

        scale = 0.05 * abs(turn - path[-1])
        assert agree(found, difference(outputs, turn, scale), scale, outputs(turn))
        values = dict(zip(unknowns, outputs(turn), strict=True))
        assert found[0] == pytest.approx(values["stiffness"], rel=1e-12)
        if not form.spring.branches and "absorbed_energy" in values:
            assert found[2] == values["force"]


@pytest.mark.parametrize("share", [0.3, 1.1])
@pytest.mark.parametrize("name", [*DIFFERENTIABLE, *rows(lambda form: form.has_states)])
def test_in_initialization_mode_and_of_states(name: str, share: float) -> None:
    """omega is given there, and no energy has been absorbed: what depends on the path does not count."""
    form = FORMS[name]
    p = form.spring
    start = {"displacement": p.displacement_min + share * (p.displacement_max - p.displacement_min)}
    start |= {"velocity": -0.2, "omega": 0.5, "absorbed_energy": 0.3} if form.has_states else form.starts
    with form.instance() as one:
        one.enter_initialization()
        assert one.set(**start) == OK
        unknowns = [v.name for v in one.library.variables if v.causality == "output" or v.name.startswith("der(")]
        values = knowns(form, one) | start
        for known, value in values.items():

            def outputs(v: float, known: str = known) -> list[float]:
                assert one.set(**{known: v}) == OK, one.said
                return one.get(*unknowns)

            scale = 0.1 * step_of(known, value)
            expected = difference(outputs, value, scale)
            at = outputs(value)
            assert one.directional(unknowns, {known: 1.0}) == OK, one.said
            assert agree(list(one.found), expected, scale, at), (known, list(one.found), expected)


@pytest.mark.parametrize("name", NATIVE_PATHS)
def test_refused_ones_write_nothing(name: str) -> None:
    form = FORMS[name]
    is_real_time = "real_time" in form.options
    refused: list[tuple[str, str, float, int, str]] = [
        ("displacement", "displacement", 1.0, ERROR, "`displacement` is not an output"),
        ("omega", "displacement", 1.0, ERROR, "`omega` is not an output"),
        ("rho", "displacement", 1.0, ERROR, "`rho` is not an output"),
        ("force", "stiffness", 1.0, ERROR, "`stiffness` is calculated"),
        ("force", "input_resolution", 1.0, ERROR, "respect to `input_resolution`"),
        ("extrapolating", "displacement", 1.0, ERROR, "`extrapolating`"),
        ("force", "extrapolating", 1.0, ERROR, "`extrapolating`"),
        ("force", "kappa_omega", float("nan"), ERROR, "The seed of `kappa_omega` must be finite, got nan."),
        ("force", "displacement", 1e308, DISCARD, "overflows; use smaller seeds."),
    ]
    if not is_real_time:
        refused.append(("absorbed_energy", "rho", 1.0, ERROR, "respect to `rho` is available in initialization mode"))
    else:
        refused.append(("force", "n", 1.0, ERROR, "An FMU for real time gives no derivatives with respect to `n`"))
    with form.begun(form.spring.displacement_offset) as one:
        for unknown, known, seed, status, text in refused:
            assert one.directional(["stiffness", unknown], {known: seed}) == status, (unknown, known)
            assert text in one.said
            assert list(one.found) == [7.0, 7.0]


# Of outputs, over time

RATED = [name for name in NATIVE_PATHS if not FORMS[name].exchange]


@pytest.mark.parametrize("name", RATED)
def test_output_derivatives_follow_the_last_step(name: str) -> None:
    form = FORMS[name]
    low, high = form.spring.displacement_min, form.spring.displacement_max
    outputs = [output for output in form.outputs if output != "omega"]
    with form.begun(low) as one:
        assert one.output_derivatives(*outputs) == [0.0] * len(outputs)
        one.advance(high, 0.1)
        one.advance(0.6 * high + 0.4 * low, 0.01)
        found = one.output_derivatives(*outputs)
        # They are those at the end of the step, whatever is tried next, or where a step of no size goes.
        assert one.set(displacement=low) == OK
        close(one.output_derivatives(*outputs), found)
        one.advance(0.6 * high + 0.4 * low, 0.0)
        close(one.output_derivatives(*outputs), found)
        rate = 0.4 * (low - high) / 0.01
        assert one.directional(outputs, {"displacement": 1.0}) == OK
        if form.spring.branches:  # their forces decay besides
            state, (before,) = one.snapshot(), one.get("force")
            one.advance(0.6 * high + 0.4 * low + 1e-9 * rate, 1e-9)
            assert found[0] == pytest.approx((one.get("force")[0] - before) / 1e-9, rel=1e-4)  # one-sided
            assert one.FreeFMUstate(byref(state)) == OK
        else:
            close(found, rate * np.array(one.found))
        for output, order, text in (
            ("force", 0, "order of the derivative of `force` must be 1, got 0"), ("force", 2, "must be 1, got 2"),
            ("displacement", 1, "`displacement` is not an output"), ("omega", 1, "`omega` is not an output"),
        ):  # fmt: skip
            values = doubles([7.0, 7.0])
            references, orders = one.references("force", output), (c_int * 2)(1, order)
            assert one.GetRealOutputDerivatives(references, c_size_t(2), orders, values) == ERROR
            assert text in one.said
            assert list(values) == [7.0, 7.0]
        one.advance(high, 5e-324)
        assert one.GetRealOutputDerivatives(one.references("force"), c_size_t(1), (c_int * 1)(1), values) == DISCARD
        assert "no derivatives, for `displacement` moved at 1.7976931348623157e+308 m/s" in one.said
        assert list(values) == [7.0, 7.0]


# Of the input, by FMI 2.0

INTERPOLATING = [name for name in RATED if FORMS[name].fmi == 2 and not FORMS[name].spring.branches]


def parabolas(low: float, high: float, count: int) -> list[tuple[float, float, float, float]]:
    """Displacement, velocity, acceleration and size of steps; most turn back inside, some begin with a jump."""
    random = np.random.default_rng(5)
    end, span, steps = low, high - low, []
    for _ in range(count):
        size = 10.0 ** random.uniform(-3, 0)
        start = end if random.uniform() < 0.8 else low + span * float(random.uniform(0.1, 0.9))
        turn, goal = random.uniform(0.0, 1.5) * size, low + span * random.uniform(0.0, 1.0)
        # Velocity zero at `turn`, displacement `goal` at the end.
        acceleration = (goal - start) / (0.5 * size**2 - turn * size) if abs(turn - 0.5 * size) > 0.05 * size else 0.0
        velocity = -acceleration * turn if acceleration else (goal - start) / size
        steps.append((start, velocity, acceleration, size))
        end = start + size * (velocity + 0.5 * acceleration * size)
    return steps


@pytest.mark.parametrize("name", INTERPOLATING)
def test_input_derivatives_commit_the_path_through_its_turning_points(name: str) -> None:
    form = FORMS[name]
    steps = parabolas(form.spring.displacement_min, form.spring.displacement_max, 200)
    path, ends, found = [steps[0][0]], [], []
    with form.begun(path[0]) as one:
        for start, velocity, acceleration, size in steps:
            path.append(start)
            if acceleration and 0.0 < -velocity / acceleration < size:
                path.append(start - 0.5 * velocity**2 / acceleration)
            path.append(start + velocity * size + 0.5 * acceleration * size**2)
            ends.append(len(path) - 1)
            given = [lambda: one.set(displacement=start), lambda: one.set_derivatives(velocity, acceleration)]  # noqa: B023
            for call in given if len(ends) % 2 else given[::-1]:  # in any order
                assert call() == OK
            assert one.DoStep(c_double(0.0), c_double(size), 1) == OK
            found.append(one.get(*form.outputs))
            assert one.get("displacement") == [pytest.approx(path[-1], abs=1e-14)]
    assert len(path) - 2 * len(steps) > 60  # so many turn inside
    expected = form.expected(np.array(path), np.zeros(len(path)), {})[:, ends]
    for values, wanted in zip(np.transpose(found), expected, strict=True):
        # The FMU and this test round the vertices apart, by 1e-17 m.
        close(values, wanted, 1e-10)


def test_input_derivatives_hold_for_one_step_and_excursions_within_it_are_reported() -> None:
    form = FORMS["co-simulation"]
    with form.begun(0.02) as one:
        one.set_derivatives(5.0, 1.0)
        one.set(displacement=0.03)  # a trial answers to the step's beginning
        close(one.get("force"), PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1:])
        one.set_derivatives(1.0, 0.0)
        one.advance(0.02, 0.01)
        assert one.get("displacement") == [pytest.approx(0.03, rel=1e-15)]
        one.advance(0.025, 0.01)
        assert one.get("displacement") == [0.025]
        close(one.output_derivatives("force"), [one.get("stiffness")[0] * (0.025 - 0.03) / 0.01])
        one.advance(0.045)
        one.set_derivatives(2.0, -200.0)  # up to 0.055 m and back
        one.advance(0.045, 0.02)
        assert not one.extrapolating
        assert [text.split()[1] for _, _, text in one.messages] == ["0.055"]


REFUSED: list[tuple[Mapping[str, object], float, str]] = [
    ({"values": [np.nan], "orders": [1]}, 0.0, "derivative of order 1 of `displacement` must be finite, got nan"),
    ({"values": [np.inf], "orders": [2]}, 0.0, "derivative of order 2 of `displacement` must be finite, got inf"),
    ({"values": [1.0], "orders": [3]}, 0.0, "must be 1 or 2, got 3"),
    ({"values": [1.0], "orders": [0]}, 0.0, "must be 1 or 2, got 0"),
    ({"values": [1.0], "orders": [1], "names": ["force"]}, 0.0, "`force` is not an input"),
    ({"values": [1.0], "orders": [1], "names": ["rho"]}, 0.0, "`rho` is not an input"),
    # Refused by the step: beyond any displacement, also where half of the acceleration is 0; a rate that none can have.
    ({"values": [1e200, 1e308]}, 1e10, "1e+200 m/s and 1e+308 m/s^2 of `displacement` must keep it within +-1e+09 m"),
    ({"values": [-1e8]}, 100.0, "must keep it within +-1e+09 m"),
    ({"values": [1e8, -2e6]}, 100.0, "must keep it within +-1e+09 m"),  # on the way only
    ({"values": [-1e8, 2e6]}, 100.0, "must keep it within +-1e+09 m"),
    ({"values": [0.0, -1e300]}, 1e-150, "and its rate within +-1e+09 m/s"),
    ({"values": [0.0, 5e-324]}, 1e171, "of `displacement` must keep it within +-1e+09 m"),
    ({"values": [0.0, 1e300]}, 1e-150, "and its rate within +-1e+09 m/s, in the step at time 0.0 s."),
]


@pytest.mark.parametrize(("given", "size", "text"), REFUSED)
def test_input_derivatives_that_are_refused(given: dict[str, list[float]], size: float, text: str) -> None:
    with FORMS["co-simulation"].begun(0.02) as one:
        options = {key: value for key, value in given.items() if key != "values"}
        if size:
            assert one.set_derivatives(*given["values"], **options) == OK
        before = one.serialized()
        refused = (
            one.DoStep(c_double(0.0), c_double(size), 1) if size else one.set_derivatives(*given["values"], **options)
        )
        assert refused == ERROR
        assert text in one.said
        assert one.serialized() == before


def test_branches_take_no_input_derivatives_and_a_step_beyond_any_memory_has_finite_ones() -> None:
    form = FORMS["branches"]
    with form.begun(form.spring.displacement_offset) as one:
        assert one.set_derivatives(0.1, orders=(1,)) == ERROR
        assert "moves straight through a step" in one.said
        one.advance(form.spring.displacement_max, 1e305)  # over a time constant it overflows
        assert one.directional(["force"], {"branch_2_time_constant": 1.0}) == OK
        assert list(one.found) == [0.0]


def test_where_there_are_arrays_derivatives_by_their_elements_are_those_of_scalars() -> None:
    """One call by all elements of kE and kA in FMI 3.0 is the sum over the scalars of FMI 2.0."""
    form, scalars = FORMS["fmi3 arrays"], FORMS["fmi3"]
    seeds = {"kE": len(SPRING.kE), "kA": len(SPRING.kA)}
    elements = {f"{array}_{i}": 0.1 * (i + 1) for array, count in seeds.items() for i in range(count)}
    path, time = motion(SPRING, 40)
    assert start_values(SPRING).keys() >= elements.keys()
    with form.begun(float(path[0])) as one, scalars.begun(float(path[0])) as other:
        for each in (one, other):
            each.along(path, time)
        assert other.directional(UNKNOWNS, elements) == OK
        call = one.__getattr__("GetDirectionalDerivative")
        found, values = doubles([0.0, 0.0]), doubles(list(elements.values()))
        references = one.references(*UNKNOWNS), c_size_t(2), one.references(*seeds), c_size_t(2)
        assert call(*references, values, c_size_t(len(values)), found, c_size_t(2)) == OK, one.said
        assert list(found) == list(other.found)
        assert call(*references, values, c_size_t(3), found, c_size_t(2)) == ERROR


def test_scipy_finds_the_parameters_by_the_fmus_derivatives() -> None:
    """Calibration through the FMU alone, from far off, as catalogue values of another spring would be."""
    names, guess = ("kappa_omega", "rho", "sigma", "n"), (40.0, 150.0, 2.5, 0.6)
    path, form = motion(SPRING, 400, seed=11)[0], FORMS["co-simulation"]
    record = form.expected(path, np.zeros(path.size), {})[0]

    def simulated(values: np.ndarray) -> np.ndarray:
        """Force [N] and its derivatives by the parameters, shape (K, 5)."""
        rows = []
        with form.begun(float(path[0]), **dict(zip(names, values.tolist(), strict=True))) as one:
            for k, x in enumerate(path.tolist()):
                if k:
                    one.advance(x)
                rows.append([*one.get("force"), *(one.derivatives(["force"], **{name: 1.0})[0] for name in names)])
        return np.array(rows)

    fit = least_squares(
        lambda values: simulated(values)[:, 0] - record, guess, jac=lambda values: simulated(values)[:, 1:],
        bounds=[(1.0, 10.0, 0.5, 0.05), (500.0, 5000.0, 20.0, 10.0)], x_scale="jac", ftol=1e-14, xtol=1e-14, gtol=1e-14,
    )  # fmt: skip
    np.testing.assert_allclose(fit.x, [getattr(SPRING, name) for name in names], rtol=1e-4)
