"""The conformance table: what FMI and the equations of the spring ask of every form of FMU.

Rows are the forms of `forms.FORMS`; each test is a column, over the forms that it holds for. Values are compared
with an ODE solver that knows nothing of the package (`oracles`), and to rounding with the package.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from ctypes import byref, c_double
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, run_python, wandering_path
from forms import FORMS, PATHS, STEPPED, Form, motion, moved, oracle_force, rows
from native_tools import ERROR, OK, close
from oracles import OracleSpring, travel_to
from strandspring import Spring, SpringParameters
from strandspring.kernel.arrays import address
from strandspring.kernel.library import library as kernel
from strandspring.kernel.path import PathSolver


def close_each(found: object, expected: np.ndarray, tolerance: float = 1e-12) -> None:
    """Each row within a tolerance of its largest value."""
    for one, other in zip(np.array(found), expected, strict=True):
        close(one, other, tolerance)


def rounding(form: Form) -> float:
    """Of steps; where branches decay, of times that add up, too."""
    return 1e-10 if form.spring.branches else 1e-12


@pytest.mark.parametrize("name", PATHS)
def test_values_along_a_path(name: str) -> None:
    """Over steps of any size and of none, standstills and excursions, with trials that leave no trace."""
    form, random = FORMS[name], np.random.default_rng(2)
    for samples in (60, 400):
        path, time = motion(form.spring, samples)
        with form.begun(float(path[0]), **form.starts) as one:
            found = [one.get(*form.outputs)]
            for x, h in zip(path[1:].tolist(), np.diff(time).tolist(), strict=True):
                for trial in random.normal(x, 0.01, random.integers(0, 3)):
                    assert one.set(displacement=trial) == OK
                    one.get(*form.outputs[: random.integers(1, len(form.outputs) + 1)])
                one.advance(x, h)
                found.append(one.get(*form.outputs))
        close_each(np.transpose(found), form.expected(path, time, form.starts), rounding(form))
        if samples == 60:  # the solver's tolerance, over its strokes
            close(np.array(found)[:, 0], oracle_force(form.spring), 1e-8)


@pytest.mark.parametrize("name", PATHS)
def test_a_trial_answers_as_a_step_in_no_time(name: str) -> None:
    form = FORMS[name]
    path, time = (values[:41] for values in motion(form.spring))
    with form.begun(float(path[0])) as one:
        one.along(path, time)
        committed = one.set(displacement=float(path[-1])) == OK and one.get(*form.outputs)
        for trial in (float(path[-1]) + 0.004, -0.2, float(path[-2])):
            assert one.set(displacement=trial) == OK
            jump = form.expected(np.append(path, trial), np.append(time, time[-1]), {})[:, -1]
            close(one.get(*form.outputs), jump, 1e-9)  # of stiffness and omega, each in units of the stiffness
            close(one.get("force"), jump[:1], 1e-10)
        assert one.set(displacement=float(path[-1])) == OK
        assert one.get(*form.outputs) == committed


@pytest.mark.parametrize("name", PATHS)
def test_steps_may_be_cut(name: str) -> None:
    form, forces = FORMS[name], []
    low, high = form.spring.displacement_min, form.spring.displacement_max
    for pieces in (1, 2, 500):
        with form.begun(low) as one:
            for a, b in ((low, high), (high, 0.5 * (low + high))):
                for x in np.linspace(a, b, pieces + 1)[1:]:
                    one.advance(float(x), 1.0 / pieces)
            forces.append(one.get("force")[0])
    if form.spring.branches:
        assert forces[1:] == pytest.approx([forces[0]] * 2, rel=1e-11)
    else:
        assert len(set(forces)) == 1


@pytest.mark.parametrize("name", PATHS)
def test_the_start_follows_the_displacement_until_initialization_ends(name: str) -> None:
    form = FORMS[name]
    p = replace(form.spring, branches=())
    with form.instance() as one:
        one.enter_initialization()
        for x in (p.displacement_min, p.displacement_max):
            assert one.set(displacement=x, **form.starts) == OK
            close(one.get("force"), Spring(p).response([x], (0.3, -0.2) if p.second else 0.3))
        assert one.get("omega") == [0.3]
        assert one.set(rho=0.5 * p.rho) == OK
        assert one.ExitInitializationMode() == OK
        assert one.get("rho") == [0.5 * p.rho]


# What is kept


@pytest.mark.parametrize("name", PATHS)
def test_a_state_taken_is_a_state_kept(name: str) -> None:
    form = FORMS[name]
    path, time = motion(form.spring, 80)
    with form.begun(float(path[0])) as one:
        one.along(path[:40], time[:40], *form.outputs)
        assert one.tune(displacement=float(path[30]), rho=0.9 * form.spring.rho) == OK
        state, now, runs = one.snapshot(), one.time, []
        address = state.value
        for _ in range(2):
            first = one.get(*form.outputs, "rho")
            runs.append([first, one.along(path[39:], time[39:], *form.outputs)])
            assert one.tune(rho=form.spring.rho) == OK
            assert one.SetFMUstate(state) == OK
            one.time = now
        assert runs[0] == runs[1]
        if not form.python:
            assert one.GetFMUstate(byref(state)) == OK  # into memory given before
            assert state.value == address
        assert one.FreeFMUstate(byref(state)) == OK
        assert form.python or state.value is None


@pytest.mark.parametrize("name", rows())
def test_states_from_before_and_after_initialization(name: str) -> None:
    form = FORMS[name]
    x = form.spring.displacement_offset
    with form.instance() as one:
        one.enter_initialization()
        assert one.set(displacement=x, kappa_omega=30.0) == OK
        before = one.snapshot()
        assert one.ExitInitializationMode() == OK
        after = one.snapshot()
        for state, mode_ends in ((before, OK), (after, form.refusal)):
            assert one.SetFMUstate(state) == OK
            assert one.get("kappa_omega") == [30.0]
            assert one.ExitInitializationMode() == mode_ends
            assert one.FreeFMUstate(byref(state)) == OK


@pytest.mark.parametrize("name", rows())
def test_a_serialized_state_goes_on_in_another_instance(name: str) -> None:
    form = FORMS[name]
    path, time = motion(form.spring, 80)
    names = [*form.outputs, "rho", "displacement", *(["velocity", "der(omega)"] if form.has_states else [])]
    with form.instance() as one, form.instance() as other:
        content = moved(form, one.begin(displacement=float(path[0])))
        assert other.restore(content) == OK, other.said
        other.time = one.time
        assert other.get(*names) == one.get(*names)
        if not form.has_states:
            rest = [each.along(path[39:], time[39:], *names) for each in (one, other)]
            assert rest[0] == rest[1]
        assert one.serialized() == other.serialized()


CONTINUE_ELSEWHERE = """
import json, sys
sys.path[:0] = json.loads(sys.argv[1])
from forms import CO_SIMULATION, Instance, Instance3, Library, OK, Path
import numpy as np
job = json.load(open(sys.argv[2]))
of = Library(Path(job["folder"]))
with (Instance if job["fmi"] == 2 else Instance3)(of, CO_SIMULATION) as one:
    assert one.restore(bytes.fromhex(job["state"])) == OK
    print(json.dumps(one.along(np.array(job["path"]), np.array(job["time"]), *job["names"])))
"""


@pytest.mark.long
@pytest.mark.parametrize("name", ["co-simulation", "branches, fmi3", "python"])
def test_a_state_goes_on_in_another_process_bit_for_bit(name: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    form, file = FORMS[name], tmp_path_factory.mktemp("job") / "job.json"
    path, time = motion(form.spring, 80)
    with form.begun(float(path[0])) as one:
        state = moved(form, one)
        here = one.along(path[39:], time[39:] - time[39], *form.outputs)
    job = {"folder": str(form.library().folder), "fmi": form.fmi, "state": state.hex(), "names": form.outputs}
    file.write_text(json.dumps({**job, "path": path[39:].tolist(), "time": (time[39:] - time[39]).tolist()}))
    places = json.dumps([str(Path(__file__).parents[k]) for k in (0, 1)])
    assert json.loads(run_python(CONTINUE_ELSEWHERE, places, file)) == here


@pytest.mark.parametrize("name", rows(lambda form: not form.python))
def test_damaged_and_foreign_states_are_refused(name: str) -> None:
    form = FORMS[name]
    with form.instance() as one:
        content = moved(form, one.begin(displacement=form.spring.displacement_offset))
        for length in (0, 1, 7, 8, 27, 28, 65, 66, len(content) - 8, len(content) - 1):
            assert one.restore(content[:length]) == ERROR
            assert one.said.startswith("The serialized state ")
        assert one.restore(content + b"\0") == ERROR
        for place in range(len(content)):
            damaged = bytearray(content)
            damaged[place] ^= 1
            assert one.restore(bytes(damaged)) == ERROR, place
        newer = bytearray(content)
        newer[8] += 1
        assert one.restore(bytes(newer)) == ERROR
        assert "the format of another version" in one.said
        assert one.serialized() == content
        with form.instance(OTHER) as other:
            assert other.restore(content) == ERROR
            assert other.said == "The serialized state is from another FMU."
            assert other.SetFMUstate(one.snapshot()) == ERROR
            assert "must come from an instance of the same FMU" in other.said
        if form.options.keys() <= {"fmi"} and not form.spring.branches:
            with replace(form, exchange=not form.exchange).instance() as model:
                kinds = ("co-simulation", "model exchange") if form.exchange else ("model exchange", "co-simulation")
                assert model.restore(content) == ERROR
                assert model.said == f"The state must be one of {kinds[0]}, but it is one of {kinds[1]}."


@pytest.mark.parametrize("name", ["python", "branches, python"])
def test_damaged_states_of_python_are_refused(name: str) -> None:
    form = FORMS[name]
    with form.begun(form.spring.displacement_offset) as one:
        content = moved(form, one)
        whole = json.loads(content)
        memories, elongations, work, at = whole["memory"]
        first = memories[0]
        damaged = [
            {**whole, "format": "other"}, {**whole, "format_version": 1}, {**whole, "guid": "{%s%n}"},
            {**whole, "more": 1}, {key: value for key, value in whole.items() if key != "side"},
            {**whole, "displacement": "0.1"}, {**whole, "displacement": math.nan}, {**whole, "energy_wanted": 0},
            {**whole, "side": 2}, {**whole, "settings": [None]}, {**whole, "settings": whole["settings"][:-1]},
            {**whole, "settings": [-1.0] * len(whole["settings"])},
            *({**whole, "memory": memory} for memory in (
                [[first[:-1], *memories[1:]], elongations, work, at], [[], elongations, work, at],
                [[[first[0], 1.5, *first[2:]], *memories[1:]], elongations, work, at],
                [[[math.inf, *first[1:]], *memories[1:]], elongations, work, at],
                [memories, [0.0, math.inf, 0.0, 0.0], work, at], [memories, elongations, work],
                [memories, elongations, work, at[:-1]], [memories, elongations, work, [math.nan, *at[1:]]],
                [memories, elongations, work, [at[0], 0.5, *at[2:]]],
            )),
        ]  # fmt: skip
        texts = [json.dumps(one).encode() for one in damaged]
        for state in (b"", b"\x80\x04junk", b"[]", b"[" * 100_000, content[:-1], content + b"}", *texts):
            assert one.restore(state) == form.refusal, state[:80]
        with form.instance(OTHER) as other:
            other.initialize()
            assert one.restore(other.serialized()) == form.refusal
            assert "of another one" in one.said
        assert one.serialized() == content


@pytest.mark.parametrize("name", rows())
def test_reset_returns_to_the_start_values(name: str) -> None:
    form = FORMS[name]
    with form.instance() as one, form.instance() as fresh:
        moved(form, one.begin(displacement=form.spring.displacement_offset))
        assert one.Terminate() == OK
        assert one.Reset() == OK
        assert one.serialized() == fresh.serialized()
        one.begin(displacement=form.spring.displacement_offset)
        assert one.get("rho") == [form.spring.rho]


@pytest.mark.parametrize("name", ["co-simulation", "fmi3", "python", "states"])
def test_instances_do_not_meet(name: str) -> None:
    """Of one FMU, and of another of the same name."""
    form = FORMS[name]
    stiffer = replace(SPRING, kE=(3.0, 2.2e4, -2.0e4, 1.0e6))
    starts = [0.01 + 0.001 * k for k in range(6)]
    ones = [form.instance(stiffer if k % 2 else SPRING).__enter__() for k in range(6)]
    for one, start in zip(ones, starts, strict=True):
        one.begin(displacement=start)
    if not form.has_states:
        for one in ones:
            one.advance(0.03)
    for k, (one, start) in enumerate(zip(ones, starts, strict=True)):
        path = np.array([start] if form.has_states else [start, 0.03])
        close(one.get("force"), PathSolver(stiffer if k % 2 else SPRING).force(path)[-1:])
        one.__exit__()


# Steps


@pytest.mark.parametrize("name", STEPPED)
def test_steps_that_are_refused_change_nothing(name: str) -> None:
    form = FORMS[name]
    with form.instance() as one:
        one.enter_initialization(0.0, None if form.python else 0.3)
        assert one.set(displacement=form.spring.displacement_offset) == OK
        assert form.python or one.DoStep(c_double(0.0), c_double(1e-3), 1) == ERROR
        assert one.ExitInitializationMode() == OK
        one.time = 0.2
        one.advance(form.spring.displacement_max, 0.1)  # 0.30000000000000004 s is the stop time rounded
        content = one.serialized()
        refused = [(0.1, -1e-3, "-0.001"), (0.1, math.nan, "nan"), (0.1, math.inf, "inf"), (0.1, -math.inf, "-inf")]
        if not form.python:
            refused += [
                (math.nan, 0.1, "The time of a step must be finite [s], got nan"), (-math.inf, 1.0, "got -inf"),
                (1.7e308, 1.7e308, "1.7e+308"),
                (0.3, 1e-3, "The step of 0.001 s at time 0.3 s must not go beyond the stop time 0.3 s."),
            ]  # fmt: skip
        for time, size, text in refused:
            assert one.DoStep(c_double(time), c_double(size), 1) == form.refusal
            assert text in one.said
            assert one.serialized() == content


@pytest.mark.parametrize("name", PATHS)
def test_absurd_displacements_do_no_harm(name: str) -> None:
    form = FORMS[name]
    with form.begun(form.spring.displacement_offset) as one:
        for displacement in (1e9, -1e9, 1e6, form.spring.displacement_max):
            one.advance(displacement, 1e-3)
            one.get(*form.outputs)
        assert one.restore(one.serialized()) == OK
        assert math.isfinite(one.get("force")[0])


# Parameters

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
    with form.begun(form.spring.displacement_offset) as one:
        moved(form, one)
        causalities = {v.name: v.causality for v in one.library.variables}
        names = [known for known in one.library.references if causalities[known] == "parameter"]
        assert one.tune() == OK
        before = one.serialized()
        assert one.tune(**dict(zip(names, one.get(*names), strict=True))) == OK
        assert one.serialized() == before


@pytest.mark.parametrize("name", ["branches", "branches, fmi3", "branches, python"])
def test_a_changed_branch_keeps_its_elongation(name: str) -> None:
    form = FORMS[name]
    path, time = (values[:30] for values in motion(form.spring))
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
