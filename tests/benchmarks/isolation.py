"""Harmonic balance against time stepping: python tests/benchmarks/isolation.py

A mass on a hardening spring, 200 frequencies at 3 levels of base displacement, H = 11 and K = 256. The baseline is
velocity Verlet in C on the same kernel, compiled alike (`tests/helpers/verlet.c`), with 512 steps a period, from rest
until three periods in a row repeat within 1e-5. Both are compared with SciPy's integration to 1e-7, every 20th
frequency (`--every 1` takes all of them, some ten minutes).
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))

from shaken import shaken
from springs import MOUNT
from strandspring.vibration.one_mass.harmonic_balance import HarmonicBalance
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, static_equilibrium
from verlet import Verlet

LEVELS = (2e-4, 6e-4, 1.2e-3)
BAND = np.geomspace(2.5, 40.0, 200)
# Without some viscous damping small free vibrations take thousands of periods to die out.
SYSTEM = IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0)
ROUNDS = 5  # the fastest counts
console = Console(width=118)


def time_of_a_balance() -> float:
    """Time of one balance with its Jacobian, ctypes included [s]."""
    balance, omega = HarmonicBalance(SYSTEM, Excitation.BASE_DISPLACEMENT, LEVELS[1]), 2.0 * np.pi * 5.0
    guess = np.zeros(balance.basis.order.size)
    guess[:2] = static_equilibrium(SYSTEM).displacement, LEVELS[1]
    solved = balance.solve(guess, omega)
    assert solved is not None
    times = []
    for _ in range(5000):
        begin = time.perf_counter()
        balance.solve(solved[0], omega)  # finds the motion balanced, and ends
        times.append(time.perf_counter() - begin)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=20, help="take every so many frequencies with SciPy")
    every = parser.parse_args().every
    verlet = Verlet(SYSTEM)
    table = Table(title=f"{BAND.size} frequencies from {BAND[0]:g} to {BAND[-1]:g} Hz, times of all of them")
    for column in (
        "level [mm]", "balance [ms]", "Verlet [ms]", "ratio", "periods", "balance: amplitude off [%]", "phase [deg]",
        "Verlet: amplitude off [%]", "phase [deg]",
    ):  # fmt: skip
        table.add_column(column, justify="right")
    frequency_response(SYSTEM, Excitation.BASE_DISPLACEMENT, LEVELS[0], BAND[:2])  # imports and tables
    for level in LEVELS:
        balance, integration = [], []
        for _ in range(ROUNDS):
            begin = time.perf_counter()
            found = frequency_response(SYSTEM, Excitation.BASE_DISPLACEMENT, level, BAND)
            balance.append(time.perf_counter() - begin)
            begin = time.perf_counter()
            stepped = [verlet.run(level, frequency) for frequency in BAND.tolist()]
            integration.append(time.perf_counter() - begin)
        points = [point for point in found.points if point.wanted]
        errors = np.array(
            [
                (
                    point.amplitude / reference.amplitude - 1.0,
                    point.relative_phase - np.degrees(np.angle(reference.relative)),
                    other.amplitude / reference.amplitude - 1.0,
                    np.degrees(np.angle(other.relative / reference.relative)),
                )
                for point, other in track(
                    list(zip(points, stepped, strict=True))[::every],
                    f"SciPy, {1e3 * level:g} mm",
                    console=Console(stderr=True),
                    transient=True,
                )
                for reference in [shaken(SYSTEM, Excitation.BASE_DISPLACEMENT, level, point.frequency)]
            ]
        )
        errors[:, 1] = (errors[:, 1] + 180.0) % 360.0 - 180.0
        largest = np.abs(errors).max(axis=0)
        table.add_row(
            f"{1e3 * level:g}",
            f"{1e3 * min(balance):.1f}",
            f"{1e3 * min(integration):.0f}",
            f"{min(integration) / min(balance):.1f}",
            f"{np.median([one.periods for one in stepped]):.0f}",
            f"{100.0 * largest[0]:.4f}",
            f"{largest[1]:.4f}",
            f"{100.0 * largest[2]:.4f}",
            f"{largest[3]:.4f}",
        )
    console.print(table)
    console.print(f"One balance of a period with its Jacobian: {1e6 * time_of_a_balance():.1f} us")


if __name__ == "__main__":
    main()
