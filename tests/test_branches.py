"""Springs with a second mechanism and Maxwell branches: their paths, model files, isolation and comparison.

Their FMUs are rows of the conformance table, tests/fmi; bodies on them are in tests/systems.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from branched_springs import BASE, BRANCHED, uneven_motion
from mounts_with_branches import two_rates
from oracles import exact_maxwell, oracle_force
from strandspring import ModelError, RefinedOptions, Spring, SpringParameters, StrandspringError, compare, identify
from strandspring.core.branches import MaxwellBranch
from strandspring.kernel.branches import maxwell_columns
from strandspring.model.modelfile import model_of_text
from strandspring.vibration.one_mass.options import Excitation, Mount
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import IsolatedMass

pytestmark = pytest.mark.long

TIME, PATH = uneven_motion()


def test_the_force_is_that_of_an_ode_and_the_energy_that_of_all_parts() -> None:
    p, starts = BRANCHED["both"], (0.3, -0.2)
    spring = Spring(p)
    found, expected = spring.response(PATH, starts, time=TIME), oracle_force(p, PATH, TIME, starts)
    assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())  # table of W: 1e-13; the solver: 1e-11
    parts = [Spring(mechanism).absorbed_energy(PATH) for mechanism in p.mechanisms]
    of_branches = spring.absorbed_energy(PATH, time=TIME) - sum(parts)
    forces = [exact_maxwell(b, PATH, TIME).astype(float) for b in p.branches]
    stored = sum(0.5 * force**2 / branch.stiffness for force, branch in zip(forces, p.branches, strict=True))
    assert spring.stored_energy(PATH, TIME) == pytest.approx(stored, rel=1e-11, abs=1e-15)
    dissipated = of_branches - stored
    assert np.diff(dissipated).min() >= -1e-12 * dissipated[-1]  # a branch can only lose energy; rounding
    # Stiffness is that of fast motion: of a small jump onwards after the path.
    stiffness, jump = spring.stiffness(PATH), 1e-9 * np.sign(PATH[-1] - PATH[-2])
    of_mechanisms = sum(Spring(mechanism).stiffness(PATH) for mechanism in p.mechanisms)
    assert stiffness == pytest.approx(of_mechanisms + sum(b.stiffness for b in p.branches), rel=1e-14)
    force = spring.response([*PATH, PATH[-1] + jump], time=[*TIME, TIME[-1]])
    assert (force[-1] - force[-2]) / jump == pytest.approx(stiffness[-1], rel=1e-5)  # of a difference of 1e-9 m
    # One start is that of both mechanisms, and times change nothing without branches.
    assert np.array_equal(spring.response(PATH, 0.4, TIME), spring.response(PATH, (0.4, 0.4), TIME))
    assert np.array_equal(Spring(BASE).response(PATH), Spring(BASE).response(PATH, time=TIME))


@pytest.mark.parametrize("tau", [1e-5, 0.02, 0.7, 60.0])
def test_columns_and_their_derivatives_are_exact(tau: float) -> None:
    import mpmath

    columns, by_log = maxwell_columns([tau, 2.0 * tau], PATH, TIME)
    exact = exact_maxwell(MaxwellBranch(1.0, tau), PATH, TIME)
    assert columns[0] == pytest.approx([float(value) for value in exact], rel=1e-12, abs=1e-15 * np.ptp(PATH))
    assert np.array_equal(columns[1], maxwell_columns([2.0 * tau], PATH, TIME)[0][0])
    with mpmath.workdps(60):
        step = mpmath.mpf(10) ** -20  # 60 digits leave 40 of the difference
        low, high = (tau * mpmath.exp(side * step) for side in (-1, 1))
        pairs = zip(*(exact_maxwell(MaxwellBranch(1.0, end), PATH, TIME) for end in (low, high)), strict=True)
        expected = [float((b - a) / (2 * step)) for a, b in pairs]
    assert by_log[0] == pytest.approx(expected, rel=1e-11, abs=1e-14 * np.ptp(PATH))


@pytest.mark.parametrize("name", BRANCHED)
def test_a_saved_spring_is_loaded_as_it_was_and_refused_where_there_is_no_room(name: str, tmp_path: Path) -> None:
    p, field = BRANCHED[name], "second" if BRANCHED[name].second else "branches"
    spring = Spring(p, name)
    spring.save(tmp_path / "model.json")
    content = json.loads((tmp_path / "model.json").read_text(encoding="utf-8"))
    assert (content["format_version"], Spring.load(tmp_path / "model.json")) == (4, spring)
    with pytest.raises(ModelError, match=f'"parameters.{field}" is for files from format_version 3 on, and this is'):
        model_of_text(json.dumps({**content, "format_version": 1}), "model.json")
    content["parameters"][field] = {"kE": [1.0]} if p.second else [{"viscosity": 1.0}]
    with pytest.raises(ModelError, match="is not a key here"):
        model_of_text(json.dumps(content), "model.json")
    with pytest.raises(StrandspringError, match=r"(`second`|`branches`).*; "):
        spring.responses(PATH)
    if p.branches:
        with pytest.raises(StrandspringError, match=r"Maxwell branch(es)? .* give them \(`time`\)"):
            spring.response(PATH)
    slow = "Loops of the model are slow, as its Maxwell branches have relaxed"
    assert any(slow in caution for caution in spring.info().cautions) == bool(p.branches)


# ---- a mass: branches that bend the response at its resonance of 15 Hz, where omega*tau is 2 and 50 ---

BENDING = (MaxwellBranch(4000.0, 0.02), MaxwellBranch(900.0, 0.5))
LEVEL, MASS, SHAKEN = 5e-4, 2.0, Excitation.BASE_DISPLACEMENT


def test_branches_alone_follow_the_transfer_function() -> None:
    """A spring whose friction is lost beside its branches is linear."""
    p = SpringParameters((0.0, 9000.0), (1.0,), 1e-9, 100.0, 1.0, 1.0, 0.0, -0.05, 0.05, branches=BENDING)
    response = frequency_response(IsolatedMass(p, MASS, Mount(0.0)), SHAKEN, LEVEL, np.geomspace(2.0, 60.0, 30))
    omega = 2.0 * np.pi * response.columns["frequency"]
    turns = [(b.stiffness, 1j * omega * b.time_constant) for b in BENDING]
    dynamic = 9000.0 + sum(stiffness * turn / (1.0 + turn) for stiffness, turn in turns)
    expected = dynamic / (dynamic - MASS * omega**2)
    assert response.columns["transmissibility"] == pytest.approx(np.abs(expected), rel=1e-9)  # friction of 1e-9 N
    peak = response.resonance
    at_peak = 9000.0 + sum(branch.dynamic_stiffness(2.0 * np.pi * peak.frequency) for branch in BENDING)
    assert (peak.stiffness, peak.loss_factor) == pytest.approx((at_peak.real, at_peak.imag / at_peak.real), rel=1e-6)


# ---- comparison -----------------------------------------------------------------------------------


def of_class(stiffness: float, seed: int) -> Spring:
    options = RefinedOptions(degrees=(3, 1), mechanisms=1, branches=1)
    return identify(two_rates([(stiffness, 0.08)], seed=seed), options).spring()


def test_a_stiffer_branch_is_a_difference_though_slow_loops_are_alike() -> None:
    lot = of_class(1500.0, 1)
    comparison = compare(lot, of_class(1800.0, 20), draws=40)
    assert comparison.verdict.name == "DIFFERENT"
    assert not any(figure.differs for figure in comparison.figures)
    stiffer, slower = comparison.parameters[4:]
    assert (stiffer.quantity, slower.quantity) == ("branches[0].stiffness", "branches[0].time_constant")
    assert stiffer.change == pytest.approx(0.2, abs=0.04)
    assert stiffer.low < 0.2 < stiffer.high
    assert "branches[0].stiffness most clearly" in comparison.sentence
    assert any("branches have relaxed" in caution for caution in comparison.cautions)
    assert compare(lot, of_class(1500.0, 40), draws=40).verdict.name == "NOT_FOUND"
    plain = identify(two_rates(seed=9), RefinedOptions(degrees=(3, 1), mechanisms=1, branches=0)).spring()
    comparison = compare(lot, plain, draws=40)  # nothing is judged between classes
    assert "A has FE of degree 3 and FA of degree 1, mechanisms: 1, branches: 1; B has FE" in comparison.sentence
