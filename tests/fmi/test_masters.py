"""Co-simulation by the package: masters against the ODE of the whole, and `simulate_fmu`, row by row."""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomllib

from fmu_tools import SPRING, wandering_path
from forms import FORMS, Form
from kernel_tools import build_folder
from oracles import Reference, loaded, monolithic
from springs import MOUNT
from strandspring import Spring, SpringParameters, simulate_fmu
from strandspring.cosimulation import (
    Attachment,
    CosimulationError,
    FmuSpring,
    Iterative,
    Jacobi,
    Master,
    Motion,
    Plant,
    apply_static_load,
    one_mass,
    simulate,
)
from strandspring.cosimulation.plants import LinearFlow

pytestmark = pytest.mark.long
MASS, LOAD, MIDDLE, STOP = 5.0, 50.0, 0.05, 0.3
AMPLITUDE, CIRCULAR = 0.003, 2.0 * math.pi * 7.0
# Unloaded at 0 and loaded both ways, so that a mass set free returns to it.
RETURNING = SpringParameters((0.0, 1.2e4, 4.0e4, 1.0e6), (1.0, 4.0), 160.0, 150.0, 1.5, 0.7, 0.0, -0.06, 0.08)
# Linear within 1e-11 of its force, so that linear theory holds for the FMU.
NEARLY_LINEAR = {"kE_1": 1e4, "kE_2": 0.0, "kE_3": 0.0, "kA_1": 0.0, "kappa_omega": 1e-9, "rho": 1.0}


@cache
def fmu(form: Form) -> Path:
    """Built once."""
    return form.build(Path(tempfile.mkdtemp(dir=build_folder())))


def base(t: float) -> float:
    return AMPLITUDE * (1.0 - math.cos(CIRCULAR * t))


def shaken() -> Plant:
    return one_mass(MASS, LOAD, base, offset=MIDDLE)


@cache
def reference() -> Reference:
    velocity = [lambda t: AMPLITUDE * CIRCULAR * math.sin(CIRCULAR * t)]
    return monolithic(shaken(), [MOUNT], np.linspace(0.0, STOP, 151), base_velocities=velocity)


def run(spring: SpringParameters, plant: Plant, stop: float, step: float, master: Master, speed: float = 0.0) -> Motion:
    with FmuSpring(fmu(Form(spring))) as unit:
        return simulate(plant, [unit], stop, step, master, velocity=[speed])


# Order between steps of 1 ms and 0.25 ms, and error of the position at 0.25 ms in units of its range, about twice what
# was measured.
@pytest.mark.parametrize(("master", "order", "bound"), [(Jacobi(), 1.0, 0.07), (Iterative(), 2.0, 1e-4)], ids=str)
def test_error_falls_with_the_step_at_the_masters_order(master: Master, order: float, bound: float) -> None:
    errors = []
    for halvings in range(1, 4):
        motion = run(MOUNT, shaken(), STOP, 2e-3 / 2**halvings, master)
        difference = np.max(np.abs(motion.q[:: 2**halvings] - reference().q))
        errors.append(float(difference / np.ptp(reference().q)))
    # The first order is not quite reached, because growth adds to the error of the larger steps; measured 1.17.
    assert math.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(order, abs=0.25), errors
    assert errors[-1] < bound, errors


def growth(ratio: float, step: float, master: Master, speed: float = 1e-60) -> float:
    """Growth of free motion of 1 kg on 1e4 N/m in a step: the size of the roots of the recurrence of late samples.

    `ratio` is the share of critical damping; from a speed [m/s] that may grow by 60 powers of ten.
    """
    with FmuSpring(fmu(Form(RETURNING)), parameters=NEARLY_LINEAR) as unit:
        plant = one_mass(1.0, damping=2.0 * ratio * math.sqrt(1e4))
        late = simulate(plant, [unit], 300 * step, step, master, velocity=[speed]).q[200:, 0]
    late /= np.max(np.abs(late))
    recurrence, *_ = np.linalg.lstsq(np.column_stack([late[1:-1], late[:-2]]), late[2:])
    return float(np.max(np.abs(np.roots([1.0, *-recurrence]))))


def test_free_motion_on_the_fmu_grows_as_in_linear_theory() -> None:
    """For one undamped mass, from the characteristic polynomials of the schemes; w = h*omega."""
    for w in (0.1, 0.5):
        # All held: the force is that of the displacement one step before.
        roots = np.roots([1.0, -2.0, 1.0 + 0.5 * w * w, 0.5 * w * w])
        # By then the other eigenvalues have died out; what is left is how little the spring is not linear.
        assert growth(0.0, w / 100.0, Jacobi()) == pytest.approx(np.max(np.abs(roots)), abs=1e-7)
        assert growth(0.0, w / 100.0, Iterative(), speed=1.0) == pytest.approx(1.0, abs=1e-7)
    # Held forces act a step and a half late: a damping of -3*k*h/2, to first order in h.
    limit = 0.02 / 3.0 / 100.0
    assert growth(0.005, 0.9 * limit, Jacobi()) < 1.0 < growth(0.005, 1.1 * limit, Jacobi())


def energy_made(step: float, master: Master, steps: int) -> float:
    """By the coupling, of 50 J of a mass set free: what it loses the spring says it absorbed [J]."""
    motion = run(RETURNING, one_mass(25.0), max(0.4, steps * step), step, master, speed=2.0)
    assert np.max(np.abs(motion.q)) < 0.08
    energy = 0.5 * 25.0 * motion.velocity[:, 0] ** 2 + motion.absorbed_energy[:, 0]
    return float(np.max(np.abs(energy - energy[0])))


def test_iterative_closes_the_energy_at_any_step_and_held_forces_make_some() -> None:
    """The steps go beyond what explicit masters bear."""
    for step in (1e-3, 1e-2, 0.1, 0.3):
        # Each step leaves at most 1e-12 m times the force of some kN; measured 4e-12 of 50 J.
        assert energy_made(step, Iterative(), 60) < 50e-9, step
    made = [energy_made(step, Jacobi(), 0) / 50.0 for step in (2e-3, 1e-3)]
    # The bounds are half and twice what was measured.
    assert 0.12 < made[1] < 0.5
    assert math.log2(made[0] / made[1]) == pytest.approx(1.0, abs=0.5), made


def test_flow_of_the_plant_is_exact_and_equilibrium_that_of_the_equations() -> None:
    from scipy.integrate import solve_ivp

    generator, step = np.random.default_rng(5), 0.7
    root = generator.normal(size=(3, 3))
    plant = Plant(root @ root.T + np.eye(3), [], damping=np.diag([0.3, 0.1, 0.2]), stiffness=np.diag([40.0, 9.0, 0.0]))
    q, speed, forces = generator.normal(size=3), generator.normal(size=3), generator.normal(size=(3, 3))

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        load = forces[0] + forces[1] * (t / step) + forces[2] * (t / step) ** 2
        return np.concatenate([z[3:], np.linalg.solve(plant.M, load - plant.C @ z[3:] - plant.K @ z[:3])])

    expected = solve_ivp(rate, (0.0, step), np.concatenate([q, speed]), "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(np.concatenate(LinearFlow(plant, step).advance(q, speed, forces)), expected, rtol=1e-10)
    lever = Attachment([2.0], 0.0475, lambda t: 0.01 * t)
    hung = Plant([[20.0]], [lever], lambda _: [300.0], stiffness=np.array([[900.0]]))
    with FmuSpring(fmu(Form(MOUNT))) as spring:
        equilibrium = apply_static_load(hung, [spring])
    # Computed to 1e-12 m here and with tolerance 1e-11 there.
    assert equilibrium == pytest.approx(loaded(hung, [MOUNT], [1]), rel=1e-8)


def test_trials_and_rollback_leave_no_trace_in_either_version_and_back_end() -> None:
    answers = []
    for name in ("co-simulation", "fmi3", "python"):
        for trials in ([], [0.045, 0.01, 0.031]):
            with FmuSpring(fmu(FORMS[name]), parameters={"omega_start": 0.3}) as spring:
                found = [spring.start(0.02, 2.0), spring.commit(2.0, 1e-3, 0.03)]
                for displacement in trials:
                    response = spring.trial(displacement)
                    with spring.rollback():
                        assert spring.commit(2.001, 1e-3, displacement) == response
                assert spring.committed_displacement == 0.03
                answers.append([*found, spring.commit(2.001, 1e-3, 0.025)])
                spring.warns = False
                spring.commit(2.002, 0.1, 0.2)
                assert "identified range" in spring.messages[-1]
                with pytest.raises(CosimulationError, match=r"got -0\.1|-0\.1 s"):  # its last message is the reason
                    spring.commit(2.2, -0.1, 0.2)
    for answer in answers[1:]:  # an energy asked for more often is integrated in more pieces
        assert np.array(answer) == pytest.approx(np.array(answers[0]), rel=1e-12)
    assert answers[0] == answers[2]  # to the bit by both versions


def _simulated(**changes: Any) -> Motion:
    given = {"stop": 0.01, "step": 1e-3, "master": Jacobi(), "springs": 1, **changes}
    with FmuSpring(fmu(Form(MOUNT)), "mount") as one:
        springs = [one] * given["springs"]
        return simulate(shaken(), springs, given["stop"], given["step"], given["master"], q=given.get("q"))


REFUSED: list[tuple[str, Callable[[], object]]] = [
    ("`mass` must be symmetric and positive definite, got [[0.0]].", lambda: one_mass(0.0)),
    ("`damping` must be a square matrix of 1 rows, got shape (2, 2).", lambda: Plant([[1.0]], [], damping=np.eye(2))),
    ("`direction` of attachment 0 must have 2 entries", lambda: Plant(np.eye(2), [Attachment([1.0])])),
    ("`mass` must be finite, got [[nan]].", lambda: one_mass(math.nan)),
    ("`series` must be >= 1, got 0.", lambda: one_mass(1.0, series=0)),
    ("`parallel` must be >= 1, got 0.", lambda: one_mass(1.0, parallel=0)),
    ("cannot be read as an FMU", lambda: FmuSpring(__file__)),
    ("`tolerance` must be > 0 [m], got 0.0.", lambda: Iterative(tolerance=0.0)),
    ("has no parameter `stiffness`", lambda: FmuSpring(fmu(Form(MOUNT)), parameters={"stiffness": 1.0})),
    ("1 attachments, but 2 springs", lambda: _simulated(springs=2)),
    ("`step` must be > 0 [s]", lambda: _simulated(step=0.0)),
    ("`q` must be 1 finite numbers, got [nan].", lambda: _simulated(q=[math.nan])),
    ("in 1 iterations, but differ by", lambda: _simulated(master=Iterative(max_iterations=1))),
    ("diverged in the step at", lambda: _simulated(stop=60.0, step=0.1)),
]


def test_refusals_say_what_is_wrong() -> None:
    for text, call in REFUSED:
        with pytest.raises(CosimulationError, match=re.escape(text)):
            call()


def test_leaving_the_identified_range_is_warned_of_once_a_run() -> None:
    outside = "`displacement` must be within the identified range, 0.02 to 0.08 m, got"
    with FmuSpring(fmu(Form(MOUNT)), "mount") as spring:
        for rows in ("48 of 101", "48 of 100"):  # where the second begins was counted in the first
            with pytest.warns(UserWarning, match=outside) as warned:
                simulate(one_mass(MASS, LOAD, offset=MIDDLE), [spring], 0.1, 1e-3, velocity=[4.0])
            (warning,) = warned
            assert f"in {rows} rows the force is extrapolated" in str(warning.message)
            assert warning.filename == __file__
        assert any("outside the identified range" in message for message in spring.messages)


# simulate_fmu


@pytest.mark.filterwarnings("ignore:`displacement` must be within the identified range")  # a wandering path leaves it
@pytest.mark.parametrize("name", ["co-simulation", "fmi3", "python"])
def test_every_row_is_the_model_at_that_displacement(name: str) -> None:
    path, built = wandering_path(SPRING, 200, seed=8), fmu(FORMS[name])
    time = 3.0 + np.cumsum(np.random.default_rng(8).uniform(1e-4, 1e-2, path.size))
    motion, spring = simulate_fmu(built, path, time), Spring(SPRING)
    np.testing.assert_array_equal((motion.time, motion.displacement), (time, path))
    for found, expected in (
        (motion.force, spring.response(path)), (motion.stiffness, spring.stiffness(path)),
        (motion.absorbed_energy, spring.absorbed_energy(path)),
    ):  # fmt: skip
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
    default = simulate_fmu(built, path.tolist())
    np.testing.assert_array_equal(default.force, motion.force)  # time does not matter and may be left out
    np.testing.assert_allclose(default.time, 1e-3 * np.arange(path.size), rtol=1e-15)
    changed = simulate_fmu(built, [0.02, 0.03, 0.015], parameters={"omega_start": 0.3}).force
    np.testing.assert_allclose(changed, spring.response([0.02, 0.03, 0.015], 0.3), rtol=1e-12)


def test_fmus_parameters_and_paths_that_do_not_fit(capfd: Any) -> None:
    refused = tomllib.loads(Path(__file__).with_name("masters.toml").read_text("utf-8"))
    for case in refused["unfit"]:
        with pytest.raises(CosimulationError) as refusal:
            simulate_fmu(fmu(FORMS[case["form"]]), [0.02, 0.03], parameters=case["parameters"])
        assert case["says"] in str(refusal.value)
        assert capfd.readouterr() == ("", "")
    for case in refused["paths"]:
        with pytest.raises(ValueError, match=re.escape(case["says"])):
            simulate_fmu(fmu(FORMS["co-simulation"]), case["displacement"], case.get("time"))
