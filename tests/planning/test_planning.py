"""What `plan` chooses, and whether the test then decides what it promised."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from branched_springs import BRANCHED
from strandspring import Record, Spring, identify, plan, read_record
from strandspring.errors import StrandspringError
from synthetic import AMPLITUDE, MEAN, spring_of

pytestmark = pytest.mark.long

RIG = {"velocity": 0.3, "duration": 40.0, "sample_rate": 200.0}
TRUE = spring_of(1.0, 1.2, strokes_in_steady=4.0)


def recorded(path: np.ndarray, time: np.ndarray, seed: int, name: str = "test.csv") -> Record:
    force = Spring(TRUE).response(path)
    return Record(path, force + 0.3 * np.random.default_rng(seed).standard_normal(force.size), time, name)


def sines(amplitude: float, frequency: float, seed: int) -> Record:
    time = np.arange(round(4.0 / frequency * 200.0)) / 200.0
    return recorded(MEAN + amplitude * np.sin(2.0 * np.pi * frequency * time), time, seed, f"{frequency:g}_{seed}.csv")


@pytest.fixture(scope="module")
def first() -> Record:
    return sines(AMPLITUDE, 1.0, 1)


def test_one_amplitude_calls_for_small_loops_and_another_rate(first: Record) -> None:
    test = plan(first, **RIG)
    assert any(block.amplitude <= 0.5 * AMPLITUDE for block in test.blocks)
    assert any(block.block.kind in ("rate", "dwell") for block in test.blocks)
    assert test.blocks[0].amplitude == pytest.approx(AMPLITUDE, rel=0.02)
    energy = {f.of: (b, a) for f, b, a in zip(test.plan.figures, test.plan.before, test.plan.after, strict=True)
              if f.quantity == "energy"}  # fmt: skip
    before, after = energy["10 % loops"]
    assert before > 0.2
    assert after < 0.1
    assert np.all(test.plan.after <= test.plan.before * (1.0 + 1e-9))


def test_recorded_rates_call_for_none(first: Record) -> None:
    test = plan([first, sines(AMPLITUDE, 0.2, 2)], **RIG)
    assert {block.block.kind for block in test.blocks} <= {"loops", "minor loops"}
    assert test.plan.speeds == ()


def test_the_promised_intervals_are_those_of_the_identification(first: Record) -> None:
    """Errors of rho, sigma and n as identified from both records, by an identification that knows of no plan."""
    test = plan(first, **RIG)
    time, path = test.program()
    found = identify([first, recorded(path, time, 3)])
    promised = {f.of: a for f, a in zip(test.plan.figures, test.plan.after, strict=True) if f.quantity == "parameter"}
    for name in ("kappa_omega", "rho", "sigma", "n"):
        stated = 1.96 * found.uncertainty[name] / getattr(found.parameters, name)
        # The plan counts some 24 independent samples in a stroke, and fewer unknowns than the identification.
        assert 0.25 < promised[name] / stated < 4.0
        error = abs(getattr(found.parameters, name) / getattr(TRUE, name) - 1.0)
        assert error < 2.0 * promised[name]  # 4 standard deviations


def test_a_rough_stiffness_is_enough() -> None:
    test = plan(stiffness=20e3, stroke=(-0.02, 0.02), velocity=0.1, duration=60.0, force_limit=1500.0)
    time, displacement = test.program()
    assert time[-1] <= 60.0
    assert -0.02 <= displacement.min() < -0.019
    assert test.plan.before.max() > 1.0 > test.plan.after.max()
    assert test.plan.force[0] >= -1500.0
    assert test.plan.force[1] <= 1500.0


def test_a_force_limit_narrows_the_range() -> None:
    free = plan(Spring(TRUE), **RIG)
    held = plan(Spring(TRUE), force_limit=0.7 * max(map(abs, free.plan.force)), **RIG)
    assert np.ptp(held.program().displacement) < 0.95 * np.ptp(free.program().displacement)
    assert "force limit" in " ".join(held.notes)


def test_the_same_plan_from_a_spring_its_file_and_its_identification(first: Record, tmp_path: Path) -> None:
    found = identify(first)
    found.spring("one").save(tmp_path / "one.json")
    plans = [plan(source, **RIG) for source in (found.spring("one"), tmp_path / "one.json", str(tmp_path / "one.json"))]
    for other in plans[1:]:
        assert np.array_equal(other.program().displacement, plans[0].program().displacement)
    same = [[block.decides for block in plan(source, **RIG).blocks] for source in (found, first)]
    assert same[0] == same[1]


def test_results_in_all_forms(first: Record, tmp_path: Path) -> None:
    test = plan(first, **RIG)
    lines = test.text_lines(80)
    assert len(lines) <= 25
    assert all(len(line) <= 80 for line in lines[1:-1])
    frame = test.to_frame()
    assert len(frame) == len(test.blocks)
    assert frame["duration"].sum() == pytest.approx(test.plan.duration)
    told = test.as_json()
    assert told["figures"][0]["before"] == test.plan.before[0]
    axes = test.plot()
    assert len(axes.lines) == len(test.blocks)
    test.save_csv(tmp_path / "program.csv")
    time, displacement = np.loadtxt(tmp_path / "program.csv", delimiter=",", skiprows=1).T
    assert displacement * 1e-3 == pytest.approx(test.program().displacement, rel=1e-8)
    assert time == pytest.approx(test.program().time, abs=1e-8)
    assert (tmp_path / "program.csv").read_text(encoding="utf-8").startswith("time [s],displacement [mm]\n")
    # What was recorded along it is read as it is.
    forces = Spring(TRUE).response(displacement * 1e-3)
    Record(displacement * 1e-3, forces, time).save(tmp_path / "second.csv")
    assert len(read_record(tmp_path / "second.csv")) == time.size


def test_without_a_velocity_that_of_the_records_is_taken(first: Record) -> None:
    test = plan(first, duration=40.0)
    assert max(block.velocity for block in test.blocks) <= 4.0 * AMPLITUDE * 1.01
    assert "assumed" in test.notes[0]
    assert "velocity=..." in test.notes[0]
    assert "assumed" in plan(Spring(TRUE)).notes[0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "takes either a model"),
        ({"stiffness": 1e3}, "needs the `stroke"),
        ({"stiffness": -1.0, "stroke": (0.0, 0.1)}, "`stiffness` must be > 0"),
        ({"stiffness": 1e15, "stroke": (-1e3, 1e3)}, "makes a force of 1e\\+18 N"),
        ({"source": Spring(TRUE), "stiffness": 1e3}, "takes either a model"),
        ({"source": Spring(TRUE), "duration": 1e-3}, "give a longer `duration=...`"),
        ({"source": Spring(TRUE), "stroke": (1.0, 2.0)}, "holds too little of the model's range"),
        ({"source": Spring(TRUE), "velocity": 0.1, "force_limit": 1e-6}, "give a larger `force_limit=...`"),
        ({"source": Spring(TRUE), "duration": 1e6, "sample_rate": 1e6}, "samples, more than"),
    ],
)
def test_what_cannot_be_planned_is_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        plan(**arguments)


def test_a_model_that_ended_at_a_bound_is_planned() -> None:
    """An open parameter has no standard error in the file: it is not known for that."""
    first = sines(AMPLITUDE, 1.0, 1)
    model = identify(first).model_file()
    root = [list(row) for row in model.uncertainty["joint"]["root"]]
    root[-1] = [0.0] * len(root)
    joint = {**model.uncertainty["joint"], "root": root}
    bound = replace(model, uncertainty={**model.uncertainty, "joint": joint})
    before = {f.of: b for f, b in zip(plan(bound, **RIG).plan.figures, plan(bound, **RIG).plan.before, strict=True)}
    assert before["n"] > 0.5


def test_branches_and_a_second_mechanism_are_planned_for() -> None:
    """The time constants are among the figures, and dwells or other rates among the blocks, at any rate recorded."""
    known = plan(Spring(BRANCHED["both"]), velocity=0.2, duration=200.0).plan
    decided = {f.of: (b, a) for f, b, a in zip(known.figures, known.before, known.after, strict=True)}
    for name in ("second.kappa_omega", "branches[1].stiffness", "branches[1].time_constant"):
        before, after = decided[name]
        assert after < 0.4 * before, name
    assert any(block.block.rest or block.block.speed != 1.0 for block in known.blocks)


def test_a_stroke_beyond_the_model_is_said() -> None:
    test = plan(Spring(TRUE), stroke=(MEAN - 2.0 * AMPLITUDE, MEAN + 0.5 * AMPLITUDE), **RIG)
    assert "stays within the range" in " ".join(test.notes)
    assert test.program().displacement.max() <= MEAN + 0.5 * AMPLITUDE + 1e-12
    with pytest.raises(StrandspringError, match="too little"):
        plan(Spring(TRUE), stroke=(MEAN + 0.9 * AMPLITUDE, MEAN + 2.0 * AMPLITUDE), **RIG)
