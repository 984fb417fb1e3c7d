"""Further columns of the conformance table: parameters that are changed on the way, and derivatives.

These are compared with differences of values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, wandering_path
from forms import FORMS, NATIVE_PATHS, STATES, STEPPED, Form, rows
from native_tools import DISCARD, ERROR, OK, Native, Native3, close, close_each
from oracles import OracleSpring, travel_to
from strandspring import SpringParameters
from strandspring.kernel.arrays import address
from strandspring.kernel.library import library as kernel
from strandspring.kernel.path import PathSolver

pytestmark = pytest.mark.long

TUNED: dict[str, dict[str, float]] = {
    "kappa_omega": {"kappa_omega": 28.0}, "rho": {"rho": 190.0}, "sigma": {"sigma": 2.0}, "n": {"n": 1.4},
    "kE": {"kE_0": 8.0, "kE_1": 9.9e3}, "kA": {"kA_1": 2.2},
    "all": {"kappa_omega": 28.0, "rho": 190.0, "sigma": 2.0, "n": 1.4},
}  # fmt: skip


def changed(p: SpringParameters, values: Mapping[str, float]) -> SpringParameters:
    """The spring with values by the FMU's names."""
    fields: dict[str, object] = {}
    for name, value in values.items():
        array, _, place = name.rpartition("_")
        if place.isdigit():
            elements = list(fields.get(array, getattr(p, array)))  # type: ignore[call-overload]
            elements[int(place)] = value
            fields[array] = tuple(elements)
        else:
            fields[name] = value
    return replace(p, **fields)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "name", ["co-simulation", "model exchange", "fmi3", "real time", "python", "table", "table, python"]
)
def test_a_change_acts_from_the_committed_point_on_with_omega_carried_on(name: str) -> None:
    form = FORMS[name]
    p, path = form.spring, wandering_path(form.spring, 120, seed=3)
    of_table = {"kE": {f"FE_forces_{i}": 1.2 * force for i, force in enumerate(p.FE_forces)}} if p.FE_knots else {}
    for values in (TUNED | of_table).values():
        after, change = changed(p, values), 40 if "n" in values else 77
        found = []
        with form.begun(float(path[0])) as one:
            for k, x in enumerate(path[1:].tolist(), start=1):
                if k == change + 1:
                    assert one.tune(**values) == OK
                one.advance(x)
                found.append(one.get(*form.outputs))
        times = np.zeros(path.size)
        early = form.expected(path[: change + 1], times[: change + 1], {})
        late = replace(form, spring=after).expected(path[change:], times[change:], {"omega_start": early[-1][-1]})
        if "absorbed_energy" in form.outputs:
            late[2] += early[2][-1]
        # A table of another n or sigma inverts omega to 1e-12.
        close_each(np.transpose(found), np.concatenate([early[:, 1:], late[:, 1:]], axis=1), 1e-10)


@pytest.mark.parametrize("name", rows(lambda form: "arrays" not in form.options))
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


def followed(path: np.ndarray, resolution: float) -> np.ndarray:
    """The displacement that friction follows."""
    found = np.empty_like(path)
    kernel().spring_resolved_path(path.size, address(path), resolution, address(found))
    return found


@pytest.mark.parametrize("name", STEPPED)
def test_friction_follows_no_reversals_below_the_resolution_of_the_input(name: str) -> None:
    form = FORMS[name]
    p = form.spring
    random, span = np.random.default_rng(3), p.displacement_max - p.displacement_min
    share = 0.5 + 0.4 * np.sin(np.linspace(0.0, 9.0, 150))
    noise = np.geomspace(1.0, 200.0, 150) * 1e-3 * random.uniform(-0.5, 0.5, 150)
    path, time = p.displacement_min + span * np.clip(share + noise, 0.0, 1.0), np.linspace(0.0, 3.0, 150)
    resolution, slow = 0.02 * span, PathSolver(p).slow
    expected, without = form.expected(path, time, {}, resolution)[0], form.expected(path, time, {})[0]
    assert np.abs(expected - without).max() > 0.01 * np.abs(expected).max()
    with form.begun(float(path[0]), input_resolution=resolution) as one:
        found = one.get("force")
        for x, h in zip(path[1:].tolist(), np.diff(time).tolist(), strict=True):
            for trial in (-3.0, -0.4, 0.4):
                assert one.set(displacement=x + trial * resolution) == OK
                one.get(*form.outputs)
            one.advance(x, h)
            found += one.get("force")
        close(found, expected, 1e-10)
        seen = followed(path, resolution)
        assert one.get("omega")[0] == pytest.approx(slow.omega(seen)[-1], abs=1e-12)
        if "absorbed_energy" in form.outputs and not p.branches:
            close(one.get("absorbed_energy"), slow.absorbed_energy(seen)[-1:], 1e-10)
        if not form.python:
            assert one.directional(["force"], {"displacement": 1.0}) == ERROR
            assert "input_resolution" in one.said
        # Without it friction catches up; with it again, it follows no motion back below it.
        assert one.set(input_resolution=0.0) == OK
        caught = slow.omega(np.append(seen, path[-1]))[-1]
        assert one.get("omega")[0] == pytest.approx(caught, abs=1e-12)
        end = 0.5 * (p.displacement_min + p.displacement_max)
        one.advance(end, 1.0)
        (omega,), heading = one.get("omega"), float(np.sign(end - path[-1]))
        assert one.set(input_resolution=resolution) == OK
        for share, follows in ((0.9, False), (1.5, True)):
            one.advance(end - share * heading * resolution, 1.0)
            assert (abs(one.get("omega")[0] - omega) > 1e-6) == follows
        for share in (-0.3, -1.7, 1.4):
            assert one.set(displacement=end + share * resolution) == OK
            answer = one.get(*form.outputs)
            one.advance(end + share * resolution, 0.0)
            assert one.get(*form.outputs) == pytest.approx(answer, rel=1e-12)


def test_the_oracle_of_the_table_is_the_integral_in_closed_form() -> None:
    """Of eq. (11), hypergeometric: travel from omega = 0 by the ODE solver against the closed form."""
    for p in (SPRING, OTHER, replace(OTHER, n=0.05), replace(OTHER, n=8.0)):
        travel = np.linspace(0.0, 1.5 / p.rho, 8)
        path = np.concatenate([travel, travel[::-1][1:]])
        omega = OracleSpring(p.as_dict(), rtol=1e-11, atol=1e-13).omega(path, 0.0)
        found = [travel_to(u, p.n, p.sigma) for u in omega[:8]]
        assert found == pytest.approx(p.rho * travel, rel=1e-6, abs=1e-9)
        # Turned back, u = -omega rises from below zero.
        way = [travel_to(-u, p.n, p.sigma) - travel_to(-omega[7], p.n, p.sigma) for u in omega[7:]]
        assert way == pytest.approx(p.rho * (travel[-1] - path[7:]), rel=1e-6, abs=1e-9)


# Derivatives

UNKNOWNS = ["force", "stiffness"]
DIFFERENTIABLE = [name for name in NATIVE_PATHS if "arrays" not in FORMS[name].options]
# Real-time FMUs give none by parameters of the path after initialization.
TABULATED = [name for name in DIFFERENTIABLE if not FORMS[name].is_real_time]


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


@pytest.mark.parametrize("end", [4, 13, 29])
@pytest.mark.parametrize("name", TABULATED)
def test_derivatives_by_parameters_along_a_path(name: str, end: int) -> None:
    """Inside and outside the identified range, at a trial, and where a parameter is tuned on the way."""
    form = FORMS[name]
    path, time = (values[:end] for values in form.motion(40))

    def run(ask: bool = False, **changed: float) -> list[float]:
        trial = changed.pop("displacement", float(path[-1]))
        with form.begun(float(path[0]), **{**form.starts, **changed}) as one:
            one.along(path[:-1], time[:-1])
            if end == 13:
                rho = {} if "rho" in changed else {"rho": 0.8 * form.spring.rho}
                assert one.tune(**rho, sigma=changed.get("sigma", 1.0) * 1.1) == OK
            assert one.set(displacement=trial) == OK
            if ask:
                before = one.serialized()
                given = {"displacement": trial} | {
                    k: v for k, v in knowns(form, one).items() if end != 13 or k not in ("rho", "sigma")
                }
                for known, value in given.items():
                    assert one.directional(UNKNOWNS, {known: 1.0}) == OK, one.said
                    found[known] = (value, list(one.found))
                if isinstance(one, Native3):
                    matrix = np.transpose([row for _, row in found.values()])
                    for seed, row in zip(np.eye(2).tolist(), matrix, strict=True):
                        close(one.adjoint(UNKNOWNS, list(found), seed), row)
                seeds = {k: 0.3 * (i + 1) for i, k in enumerate(found)}
                assert one.directional(UNKNOWNS, seeds) == OK
                close(list(one.found), sum(s * np.array(found[k][1]) for k, s in seeds.items()), 1e-11)
                assert one.directional(UNKNOWNS, {}) == OK
                assert (list(one.found), one.serialized()) == ([0.0, 0.0], before)
            return one.get(*UNKNOWNS)

    found: dict[str, tuple[float, list[float]]] = {}
    values = run(ask=True)
    assert len(found) > 10
    for known, (value, derivative) in found.items():
        scale = 1e-4 if known == "displacement" else step_of(known, value)
        expected = difference(lambda v, known=known: run(**{known: v}), value, scale)  # type: ignore[misc]
        assert agree(derivative, expected, scale, values), known


@pytest.mark.parametrize("share", [0.3, 1.1])
@pytest.mark.parametrize("name", [*DIFFERENTIABLE, *STATES])
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


@pytest.mark.parametrize("name", ["co-simulation", "table", "real time"])
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
            if len(ends) % 2:  # in any order
                assert one.set(displacement=start) == one.set_derivatives(velocity, acceleration) == OK
            else:
                assert one.set_derivatives(velocity, acceleration) == one.set(displacement=start) == OK
            assert one.go(0.0, size) == OK
            found.append(one.get(*form.outputs))
            assert one.get("displacement") == [pytest.approx(path[-1], abs=1e-14)]
        assert len(path) - 2 * len(steps) > 60  # so many turn inside
        # The FMU and this test round the vertices apart, by 1e-17 m.
        close_each(np.transpose(found), form.expected(np.array(path), np.zeros(len(path)), {})[:, ends], 1e-10)
        # They hold for one step; excursions within it are reported.
        low, high = form.spring.displacement_min, form.spring.displacement_max
        one.advance(low)
        one.messages.clear()
        one.set_derivatives(4.0 * (high - low), -6.0 * (high - low))  # beyond the upper end and back
        one.advance(low, 1.0)
        outside = [] if form.is_real_time else [pytest.approx(low + 4.0 * (high - low) / 3.0)]
        assert [float(text.split()[1]) for _, _, text in one.messages] == outside
        assert one.get("displacement") == [pytest.approx(high, rel=1e-12)]
        one.advance(low)
        assert one.get("displacement") == [low]
