"""The examples of co-simulation against a monolithic solution of the same equations.

Errors are in units of each quantity's range and fall fourfold when the step is halved.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from coupled_energy import energy_balance
from oracles import Reference, loaded, monolithic
from strandspring.cosimulation import Motion, Plant
from strandspring.examples import recoil, rigid_platform
from system_fmus import fmu

pytestmark = pytest.mark.slow

QUANTITIES = ("q", "force", "absorbed_energy")


def errors(motion: Motion, reference: Reference, every: int) -> np.ndarray:
    """Largest error of each quantity in units of its range, shape (3,)."""
    found = []
    for name in QUANTITIES:
        expected = getattr(reference, name)
        found.append(np.max(np.abs(getattr(motion, name)[::every] - expected) / np.ptp(expected, axis=0)))
    return np.array(found)


def check(runs: Sequence[Motion], reference: Reference, bound: float) -> None:
    """Runs with a step, its half and its quarter are of second order, and the last errs by less than the bound.

    The order scatters, because the error of a turn depends on where it lies within its step: measured 1.73 to 2.45.
    """
    coarse, _, fine = (errors(motion, reference, 2**k) for k, motion in enumerate(runs))
    orders = 0.5 * np.log2(coarse / fine)
    np.testing.assert_allclose(orders, 2.0, atol=0.5, err_msg=f"{coarse} -> {fine}")
    assert fine.max() < bound, fine


def check_energy(plant: Plant, motion: Motion) -> None:
    """The iterative master closes the balance; measured 1e-11 and below."""
    assert energy_balance(plant, motion).relative_error < 1e-9


# Bounds are twice what was measured at a quarter of the coarse step.
def test_recoil() -> None:
    times = np.linspace(0.0, recoil.STOP, 401)
    reference = monolithic(recoil.plant(), [recoil.SPRING] * 2, times, velocity=[recoil.IMPULSE / recoil.MASS])
    runs = [recoil.fire(fmu(recoil.SPRING), 1e-3 / 2**k) for k in range(3)]
    check(runs, reference, 4e-5)
    check_energy(recoil.plant(), runs[0])
    # Energy of recoil is either absorbed or still kinetic.
    energy = 0.5 * recoil.IMPULSE**2 / recoil.MASS
    left = 0.5 * recoil.MASS * runs[0].velocity[:, 0] ** 2 + runs[0].absorbed_energy.sum(axis=1)
    np.testing.assert_allclose(left, energy, rtol=1e-10)


def test_rigid_platform_on_four_springs() -> None:
    plant, corners = rigid_platform.plant(), rigid_platform.CORNERS
    models = [corner.spring for corner in corners]
    fmus = fmu(rigid_platform.SOFT), fmu(rigid_platform.STIFF)
    results = [rigid_platform.drive(*fmus, 1e-3 / 2**k) for k in range(3)]
    (found, _), *_ = results
    equilibrium = loaded(plant, models, np.sign(plant.G.T @ found).astype(int).tolist())
    np.testing.assert_allclose(found, equilibrium.q, rtol=1e-8, atol=1e-12)
    times = np.linspace(0.0, rigid_platform.STOP, round(rigid_platform.STOP / 1e-3) + 1)

    def velocity(corner: rigid_platform.Corner, t: float) -> float:
        omega = rigid_platform.FREQUENCY
        return corner.share * rigid_platform.WAVE * omega * float(np.cos(omega * (t - corner.lag)))

    velocities = [partial(velocity, corner) for corner in corners]
    reference = monolithic(plant, models, times, base_velocities=velocities, equilibrium=equilibrium)
    motions = [motion for _, motion in results]
    check(motions, reference, 1.8e-4)
    check_energy(plant, motions[0])


@pytest.mark.parametrize(
    ("example", "says"),
    [
        ("recoil", "recoil                  28.6 mm after 47 ms"),
        ("rigid_platform", "rear right   stroke  19.06 mm"),
        ("ssp_system", "steps of 0.1 ms: largest excursion 2.658 mm"),
    ],
)
def test_examples_print_what_an_engineer_reads_and_draw_it(example: str, says: str, tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error", "-m", f"strandspring.examples.{example}"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert says in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == [f"{example}.png"]
