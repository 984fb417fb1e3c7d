"""The native FMU of a spring with a second mechanism and Maxwell branches, against an independent ODE solver."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.integrate import solve_ivp

from branched_springs import BRANCHED, oracle_force, uneven_motion
from native_tools import ERROR, Native, library
from strandspring import Spring, SpringParameters
from strandspring.core.branch_variables import OF_BRANCH
from strandspring.core.branches import MaxwellBranch
from strandspring.fmu.checks.check import described_spring, examine_fmu, running
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.kernel.path import PathSolver
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import ModelFile
from tools import slow_but

TIME, PATH = uneven_motion()
BOTH = BRANCHED["both"]


class Run:
    """An initialized co-simulation of an FMU of FMI 2.0 or 3.0 whose displacement is that of the record."""

    def __init__(self, slave: Any, references: dict[str, int]) -> None:
        self.slave, self.references, self.time = slave, references, 0.0

    def get(self, *names: str) -> list[float]:
        return list(self.slave.getReal([self.references[name] for name in names]))

    def set(self, **values: float) -> None:
        self.slave.setReal([self.references[name] for name in values], list(values.values()))

    def step(self, displacement: float, size: float) -> float:
        self.set(displacement=displacement)
        self.slave.doStep(self.time, size)
        self.time += size
        return self.get("force")[0]

    def along(self, path: np.ndarray, time: np.ndarray) -> list[float]:
        return [self.step(x, h) for x, h in zip(path.tolist()[1:], np.diff(time).tolist(), strict=True)]


@contextmanager
def begun(fmu: Path, start: float, **values: float) -> Iterator[Run]:
    description = fmpy.read_model_description(str(fmu))
    with running(fmu) as slave:
        run = Run(slave, {v.name: v.valueReference for v in description.modelVariables})
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        run.set(displacement=start, **values)
        slave.exitInitializationMode()
        yield run


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("branched")


@pytest.fixture(scope="module")
def both(folder: Path) -> Path:
    return build_native_fmu(ModelFile("both", BOTH), folder, zero="rig")


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", slow_but(BRANCHED, ("both", "table")))
def test_every_form_is_valid_and_answers_as_the_model(name: str, fmi: int, tmp_path: Path) -> None:
    model = ModelFile(name, BRANCHED[name])
    for form in ({}, {"with_states": True}, {"real_time": True}, {"no_energy": True}):
        report = examine_fmu(build_native_fmu(model, tmp_path, fmi=fmi, **form))
        assert (report.problems, report.not_run) == ((), None), form
    if fmi == 3:
        report = examine_fmu(build_native_fmu(model, tmp_path, fmi=3, arrays=True))
        assert report.problems == ()
    else:
        report = examine_fmu(build_python_fmu(model, tmp_path))
        assert (report.problems, report.not_run) == ((), None)


@pytest.mark.parametrize(
    "form", [{}, {"with_states": True}, {"real_time": True}, {"real_time": True, "no_energy": True}]
)
@pytest.mark.parametrize("name", BRANCHED)
def test_its_page_states_the_equation_and_what_the_form_can_do(
    name: str, form: dict[str, bool], tmp_path: Path
) -> None:
    parameters = BRANCHED[name]
    with ZipFile(build_native_fmu(ModelFile(name, parameters), tmp_path, **form)) as fmu:
        page = " ".join(fmu.read("documentation/index.html").decode().split())
        described = fmu.read("modelDescription.xml").decode()
    assert ("second_kappa_omega · second_omega · FA₂(x)" in page) == bool(parameters.second)
    assert ("Σ r_j" in page) == ("Maxwell branches, a spring and a dashpot" in page) == bool(parameters.branches)
    assert ("for co-simulation and model exchange:" in page) == (
        "<CoSimulation" in described and "<ModelExchange" in described
    )
    assert ("orders 1 and 2" in page) == ('canInterpolateInputs="true"' in described)
    assert ("There is no output <code>absorbed_energy" in page) == ("no_energy" in form)


@pytest.mark.parametrize("name", slow_but(["second", "branches", "both"], ("both",)))
def test_steps_of_any_size_give_the_force_of_an_independent_ode(name: str, tmp_path: Path) -> None:
    p, starts = BRANCHED[name], (0.3, -0.2)
    expected = oracle_force(p, PATH, TIME, starts)
    values = {"omega_start": starts[0]} | ({"second_omega_start": starts[1]} if p.second else {})
    model = ModelFile(name, p)
    native = [build_native_fmu(model, tmp_path, zero="rig", fmi=fmi) for fmi in (2, 3)]
    for fmu in (*native, build_python_fmu(model, tmp_path, zero="rig")):
        with begun(fmu, float(PATH[0]), **values) as run:
            found = [run.get("force")[0], *run.along(PATH, TIME)]
        # The solver; tables of W: 1e-13.
        assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max()), fmu.name


def test_energies_and_states_are_those_of_the_model(both: Path) -> None:
    spring, solver = Spring(BOTH), PathSolver(BOTH)
    names = ("absorbed_energy", "stored_energy", "stiffness", "omega", "second_omega")
    with begun(both, float(PATH[0])) as run:
        rows = [run.get(*names)]
        for x, h in zip(PATH.tolist()[1:], np.diff(TIME).tolist(), strict=True):
            run.step(x, h)
            rows.append(run.get(*names))
    energy, stored, stiffness, *omegas = np.transpose(rows)
    expected = spring.absorbed_energy(PATH, time=TIME)
    # Rounding of sums over 120 steps, and of a time that adds up.
    assert energy == pytest.approx(expected, abs=1e-11 * expected.max())
    assert stored == pytest.approx(spring.stored_energy(PATH, TIME), rel=1e-10, abs=1e-15)
    assert stiffness == pytest.approx(spring.stiffness(PATH), rel=1e-10)
    assert np.array(omegas) == pytest.approx(solver.omegas(PATH), abs=1e-12)


def test_a_trial_is_a_jump_and_leaves_no_trace(both: Path) -> None:
    with begun(both, float(PATH[0])) as one, begun(both, float(PATH[0])) as other:
        one.along(PATH[:20], TIME[:20])
        other.along(PATH[:20], TIME[:20])
        for run in (one,):
            for x in (0.051, 0.047, float(PATH[19])):
                run.set(displacement=x)
                trial = run.get("force", "absorbed_energy", "stored_energy")
                jumped = ([*PATH[:20], x], 0.0, [*TIME[:20], TIME[19]])
                expected = Spring(BOTH).response(*jumped)[-1], Spring(BOTH).absorbed_energy(*jumped)[-1]
                assert trial[:2] == pytest.approx(expected, rel=1e-10)
        assert one.step(0.052, 0.3) == other.step(0.052, 0.3)
        assert one.get("stored_energy", "second_omega") == other.get("stored_energy", "second_omega")


def test_a_state_goes_on_in_another_instance(both: Path) -> None:
    with begun(both, float(PATH[0])) as run, begun(both, 0.05) as other:
        run.along(PATH[:40], TIME[:40])
        slave = run.slave
        state = slave.getFMUState()
        data = slave.serializeFMUState(state)
        expected = run.along(PATH[39:], TIME[39:])
        slave.freeFMUState(state)
        restored = other.slave.deserializeFMUState(data)
        other.slave.setFMUState(restored)
        other.time = float(TIME[39])
        assert other.along(PATH[39:], TIME[39:]) == expected
        other.slave.freeFMUState(restored)
        damaged = bytes(data[:-4]) + b"\x00\x00\xf0\x7f"
        with pytest.raises(FMICallException):
            other.slave.deserializeFMUState(damaged)


def parameter_names(p: SpringParameters) -> list[str]:
    of_second = ["kappa_omega", "rho", "sigma", "n", "kA_1", "kA_2", "omega_start"]
    of_branches = [f"branch_{i}_{name}" for i in range(len(p.branches)) for name in OF_BRANCH]
    return ["kE_1", "kA_1", "kappa_omega", "rho", "n", *(f"second_{name}" for name in of_second), *of_branches]


def response_with(name: str, change: float, path: np.ndarray = PATH, time: np.ndarray = TIME) -> np.ndarray:
    """Force along the path, as FMU parameters, where one of them is times 1 + change, or is moved by it if it is 0."""
    p, starts = BOTH, [0.1, 0.1]
    if name.endswith("omega_start"):
        starts[1] += change
    elif name.startswith("branch_"):
        place, field = int(name[7]), name[9:]
        rows = list(p.branches)
        rows[place] = replace(rows[place], **{field: getattr(rows[place], field) * (1.0 + change)})
        p = replace(p, branches=tuple(rows))
    else:
        part: Any = p.second if name.startswith("second_") else p
        field = name.removeprefix("second_")
        if "_" in field and field[-1].isdigit():
            array, place = field[:2], int(field[3])
            values = list(getattr(part, array))
            values[place] *= 1.0 + change
            part = replace(part, **{array: tuple(values)})
        else:
            part = replace(part, **{field: getattr(part, field) * (1.0 + change)})
        p = replace(p, second=part) if name.startswith("second_") else part
    return Spring(p).response(path, (starts[0], starts[1]), time)


def value_of(name: str) -> float:
    if name.endswith("omega_start"):
        return 1.0  # moved by the change itself
    if name.startswith("branch_"):
        return float(getattr(BOTH.branches[int(name[7])], name[9:]))
    part: Any = BOTH.second if name.startswith("second_") else BOTH
    field = name.removeprefix("second_")
    return float(getattr(part, field[:2])[int(field[3])] if field[-1].isdigit() else getattr(part, field))


@pytest.mark.parametrize("end", [30, 110])
def test_directional_derivatives_are_those_of_the_force(both: Path, end: int) -> None:
    names = parameter_names(BOTH)
    with begun(both, float(PATH[0]), omega_start=0.1, second_omega_start=0.1) as run:
        run.along(PATH[:end], TIME[:end])
        force = [run.references["force"]]
        found = [run.slave.getDirectionalDerivative(force, [run.references[name]], [1.0])[0] for name in names]
        by_displacement = run.slave.getDirectionalDerivative(force, [run.references["displacement"]], [1.0])[0]
        stiffness = run.get("stiffness")[0]
    assert by_displacement == pytest.approx(stiffness, rel=1e-12)
    step = 1e-4
    for name, derivative in zip(names, found, strict=True):
        a, b, c, d = (response_with(name, k * step)[end - 1] for k in (-2, -1, 1, 2))
        expected = (8.0 * (c - b) - (d - a)) / (12.0 * step) / value_of(name)
        # Fourth order leaves 1e-12, neighbouring tables of W differ by 1e-13 over 1e-4.
        scale = abs(expected) + 1e-4 * abs(b / value_of(name))
        assert derivative == pytest.approx(expected, abs=2e-6 * scale), name


def test_the_rate_of_the_force_counts_what_decays(both: Path) -> None:
    with begun(both, float(PATH[0])) as run:
        run.along(PATH[:30], TIME[:30])
        # Steps in which the velocity stays the same.
        velocity, size = 1e-3, 1e-5
        run.step(float(PATH[29]) + velocity * size, size)
        forces = [run.get("force")[0]]
        references = (ctypes.c_uint * 1)(run.references["force"])
        value = (ctypes.c_double * 1)()
        run.slave.fmi2GetRealOutputDerivatives(run.slave.component, references, 1, (ctypes.c_int * 1)(1), value)
        rate = value[0]
        step = 1e-9
        forces.append(run.step(float(PATH[29]) + velocity * (size + step), step))
    assert rate == pytest.approx((forces[1] - forces[0]) / step, rel=1e-4)  # one-sided difference


def test_a_step_longer_than_any_memory_leaves_finite_derivatives(both: Path) -> None:
    """Its duration over a time constant overflows."""
    with begun(both, float(PATH[0])) as run:
        run.along(PATH[:30], TIME[:30])
        run.step(float(PATH[31]), 1e305)
        force, known = [run.references["force"]], [run.references["branch_2_time_constant"]]
        assert run.slave.getDirectionalDerivative(force, known, [1.0]) == [0.0]


def test_a_changed_stiffness_keeps_the_elongation(both: Path) -> None:
    with begun(both, float(PATH[0])) as run:
        run.along(PATH[:30], TIME[:30])
        before = run.get("force", "branch_1_elongation")
        run.set(branch_1_stiffness=2.0 * BOTH.branches[1].stiffness)
        after = run.get("force", "branch_1_elongation")
        assert after[1] == before[1] != 0.0
        assert after[0] - before[0] == pytest.approx(BOTH.branches[1].stiffness * before[1], rel=1e-9)
        run.set(second_rho=700.0, branch_0_time_constant=0.5)
        assert run.get("force") == pytest.approx(after[:1], rel=1e-12)


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("second_rho", -1.0, "`second_rho` must be > 0 [1/m], got -1.0."),
        ("second_n", 1e4, "`second_n` must be within [0.01, 100], got 10000.0."),
        ("second_kA_1", -1e4, "the amplifier FA (coefficients `second_kA`) must be > 0 over the identified range"),
        ("second_omega_start", 2.0, "`second_omega_start` must be within [-1, 1], got 2.0."),
        ("branch_2_stiffness", -5.0, "`branch_2_stiffness` must be within [0, "),
        ("branch_0_time_constant", 0.0, "`branch_0_time_constant` must be within [1e-09, 1e+09] s, got 0.0."),
    ],
)
def test_impossible_parameters_are_named(name: str, value: float, sentence: str) -> None:
    with Native(library(BOTH)) as spring:
        spring.enter_initialization()
        assert ERROR in (spring.set(**{name: value}), spring.ExitInitializationMode())
        assert sentence in spring.said


def test_what_branches_cannot_do_is_refused(both: Path, folder: Path) -> None:
    description = fmpy.read_model_description(str(both))
    assert description.modelExchange is None
    assert not description.coSimulation.canInterpolateInputs
    with Native(library(BOTH)) as spring:
        spring.initialize()
        assert spring.set_derivatives(0.1, orders=(1,)) == ERROR
        assert "moves straight through a step" in spring.said
    only_second = build_native_fmu(ModelFile("second", BRANCHED["second"]), folder, zero="rig")
    assert fmpy.read_model_description(str(only_second)).modelExchange is not None


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_description_says_which_spring_it_is(fmi: int, tmp_path: Path) -> None:
    for name, p in BRANCHED.items():
        model = ModelFile(name, p)
        fmu = build_native_fmu(model, tmp_path, fmi=fmi)
        assert described_spring(fmpy.read_model_description(str(fmu))) == placed(model, None)[0].parameters


def test_the_form_with_states_is_the_ode(tmp_path: Path) -> None:
    p = replace(BOTH, branches=(*BOTH.branches[:2], MaxwellBranch(1e3, 2e-3)))
    fmu = build_native_fmu(ModelFile("both", p), tmp_path, zero="rig", with_states=True)
    # Straight strokes, each integrated by itself from the states that the last one left.
    time, path = np.array([0.0, 0.05, 0.07, 0.4]), np.array([0.05, 0.062, 0.045, 0.058])
    description = fmpy.read_model_description(str(fmu))
    references = {v.name: v.valueReference for v in description.modelVariables}
    count = 3 + len(p.branches)
    states, rates = (ctypes.c_double * count)(), (ctypes.c_double * count)()
    with running(fmu, model_exchange=True) as model:
        model.setupExperiment(startTime=0.0)
        model.enterInitializationMode()
        model.setReal([references["displacement"]], [path[0]])
        model.exitInitializationMode()
        model.newDiscreteStates()
        model.enterContinuousTimeMode()
        y, force = np.zeros(count), []
        for k in range(3):
            v = (path[k + 1] - path[k]) / (time[k + 1] - time[k])

            def change(t: float, y: np.ndarray, k: int = k, v: float = v) -> list[float]:
                place = [path[k] + v * (t - time[k]), v]
                model.setTime(t)
                model.setReal([references["displacement"], references["velocity"]], place)
                states[:] = y.tolist()
                model.setContinuousStates(states, count)
                model.getDerivatives(rates, count)
                return list(rates)

            span = (time[k], time[k + 1])
            y = solve_ivp(change, span, y, method="LSODA", rtol=1e-11, atol=1e-13).y[:, -1]
            change(time[k + 1], y)
            force.append(model.getReal([references["force"]])[0])
    expected = Spring(p).response(path, time=time)[1:]
    assert force == pytest.approx(expected, rel=1e-7)  # of the solver, whose rates have a cusp at omega = 0
    assert y[0] == pytest.approx(Spring(p).absorbed_energy(path, time=time)[-1], rel=1e-7)


def test_python_answers_as_machine_code_call_by_call(both: Path, tmp_path: Path) -> None:
    """Trials, dwells, tuned parameters and states in all variables; others hold the native FMU to other oracles."""
    python = build_python_fmu(ModelFile("both", BOTH), tmp_path, zero="rig")
    names = [v.name for v in fmpy.read_model_description(str(python)).modelVariables if v.type == "Real"]
    tuned = {
        20: ("branch_1_stiffness", 400.0),
        40: ("branch_0_time_constant", 0.2),
        60: ("second_n", 2.5),
        80: ("rho", 700.0),
    }
    starts = {"omega_start": 0.3, "second_omega_start": -0.2}
    with begun(both, float(PATH[0]), **starts) as native, begun(python, float(PATH[0]), **starts) as run:

        def each(call: Callable[[Run], Any]) -> list[Any]:
            answers = [call(one) for one in (native, run)]
            expected, found = (np.array(one.get(*names)) for one in (native, run))
            # Forces of some 100 N; tables of W: 1e-13, and energies are sums of strokes.
            np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10)
            return answers

        for k, (displacement, size) in enumerate(zip(PATH[1:].tolist(), np.diff(TIME).tolist(), strict=True)):
            each(lambda one, x=0.9 * displacement: one.set(displacement=x))  # type: ignore[misc]
            each(lambda one, x=displacement, h=size: one.step(x, h))  # type: ignore[misc]
            if k == 30:
                kept = each(lambda one: one.slave.serializeFMUstate(one.slave.getFMUstate()))
            if k in tuned:
                each(lambda one, setting=tuned[k]: one.set(**dict([setting])))  # type: ignore[misc]
        for one, state in zip((native, run), kept, strict=True):
            one.slave.setFMUstate(one.slave.deSerializeFMUstate(state))
        each(lambda one: one.step(float(PATH[31]), 0.1))


def test_python_refuses_a_second_mechanism_that_is_none_by_name(tmp_path: Path) -> None:
    with begun(build_python_fmu(ModelFile("both", BOTH), tmp_path, zero="rig"), 0.0) as run:
        for name, value in (("second_rho", -1.0), ("branch_1_time_constant", 0.0), ("second_omega_start", 0.5)):
            with pytest.raises(FMICallException):
                run.set(**{name: value})
            assert run.get(name) != [value]


def test_derivatives_at_a_trial_are_those_of_the_path_that_jumps_there(both: Path) -> None:
    # The trial turns back, so that omega of both mechanisms begins new strokes.
    end, jump = 30, -1e-3 * np.sign(PATH[29] - PATH[28])
    names = ["rho", "second_rho", "second_n", "second_omega_start", "branch_0_time_constant", "branch_1_stiffness"]
    x = float(PATH[29] + jump)
    with begun(both, float(PATH[0]), omega_start=0.1, second_omega_start=0.1) as run:
        run.along(PATH[:end], TIME[:end])
        run.set(displacement=x)
        force = [run.references["force"]]
        found = [run.slave.getDirectionalDerivative(force, [run.references[name]], [1.0])[0] for name in names]
    path, time, step = np.array([*PATH[:end], x]), np.array([*TIME[:end], TIME[29]]), 1e-4
    for name, derivative in zip(names, found, strict=True):
        a, b = (response_with(name, side * step, path, time)[-1] for side in (-1, 1))
        expected = (b - a) / (2.0 * step) / value_of(name)
        assert derivative == pytest.approx(expected, rel=1e-5, abs=1e-9 * abs(b / value_of(name))), name


def test_where_a_path_begins_branches_have_no_force_yet(both: Path) -> None:
    description = fmpy.read_model_description(str(both))
    references = {v.name: v.valueReference for v in description.modelVariables}
    with running(both) as slave:
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.setReal([references["displacement"]], [0.055])
        by_displacement = slave.getDirectionalDerivative([references["force"]], [references["displacement"]], [1.0])
        force = [Spring(replace(BOTH, branches=())).response([0.055 + side * 1e-6])[0] for side in (-1, 1)]
    assert by_displacement[0] == pytest.approx((force[1] - force[0]) / 2e-6, rel=1e-6)  # second order
