"""Harmonic balance against time stepping: python tests/benchmarks/isolation.py

A mass on a hardening spring, 200 frequencies at 3 levels of base displacement, H = 11 and K = 256. The baselines are
velocity Verlet in C on the same kernel, compiled alike (`tests/helpers/verlet.c`): with 512 steps a period from rest
until three periods in a row repeat within 1e-5, and, the fairest, with 512, 256 and 128 steps by Anderson's
acceleration of the map over one period, from the motion at the frequency before until a period repeats within 1e-5.
All are compared with SciPy's integration to 1e-7, every 20th frequency (`--every 1` takes all of them, some ten
minutes).
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "helpers"))

from shaken import shaken
from springs import MOUNT
from strandspring.vibration.one_mass.curve_points import ResponsePoint
from strandspring.vibration.one_mass.harmonic_balance import mass_balance
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, static_equilibrium
from verlet import Stepped, Verlet

LEVELS = (2e-4, 6e-4, 1.2e-3)
BAND = np.geomspace(2.5, 40.0, 200)
# Without some viscous damping small free vibrations take thousands of periods to die out.
SYSTEM = IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0)
ROUNDS = 5  # the fastest counts
console = Console(width=118)


def time_of_a_balance() -> float:
    """Time of one balance with its Jacobian, ctypes included [s]."""
    balance = mass_balance(SYSTEM, static_equilibrium(SYSTEM), Excitation.BASE_DISPLACEMENT, LEVELS[1])
    guess, omega = np.zeros(balance.basis.order.size), 2.0 * np.pi * 5.0
    guess[1] = LEVELS[1]
    solved = balance.solve(guess, omega)
    assert solved is not None
    times = []
    for _ in range(5000):
        begin = time.perf_counter()
        balance.solve(solved.z, omega)  # finds the motion balanced, and ends
        times.append(time.perf_counter() - begin)
    return min(times)


def _each(run: Callable[[float, float], Stepped], level: float, frequencies: list[float]) -> list[Stepped]:
    return [run(level, frequency) for frequency in frequencies]


def _relative(point: ResponsePoint) -> complex:
    return complex(point.relative * np.exp(1j * np.radians(point.relative_phase)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=20, help="take every so many frequencies with SciPy")
    every = parser.parse_args().every
    verlet, frequencies = Verlet(SYSTEM), BAND.tolist()
    table = Table(title=f"{BAND.size} frequencies from {BAND[0]:g} to {BAND[-1]:g} Hz, times of all of them")
    for column in ("level [mm]", "method", "time [ms]", "balances", "periods", "amplitude off [%]", "phase [deg]"):
        table.add_column(column, justify="right")
    frequency_response(SYSTEM, Excitation.BASE_DISPLACEMENT, LEVELS[0], BAND[:2])  # imports and tables
    for level in LEVELS:
        methods: dict[str, Callable[[], Any]] = {
            "balance": partial(frequency_response, SYSTEM, Excitation.BASE_DISPLACEMENT, level, BAND),
            "Verlet, 512, from rest": partial(_each, verlet.run, level, frequencies),
            **{f"Anderson, {steps}": partial(verlet.sweep, level, frequencies, steps) for steps in (512, 256, 128)},
        }
        times, found = dict.fromkeys(methods, np.inf), {}
        for _ in range(ROUNDS):
            for name, method in methods.items():
                begin = time.process_time()
                found[name] = method()
                times[name] = min(times[name], time.process_time() - begin)
        points = [point for point in found.pop("balance").points if point.requested]
        found = {"balance": [Stepped(_relative(point), point.amplitude, 0) for point in points], **found}
        references = [
            shaken(SYSTEM, Excitation.BASE_DISPLACEMENT, level, frequency)
            for frequency in track(
                frequencies[::every], f"SciPy, {1e3 * level:g} mm", console=Console(stderr=True), transient=True
            )
        ]
        for name, motions in found.items():
            pairs = list(zip(motions[::every], references, strict=True))
            phases = [np.degrees(np.angle(one.relative / reference.relative)) for one, reference in pairs]
            table.add_row(
                f"{1e3 * level:g}" if name == "balance" else "",
                name,
                f"{1e3 * times[name]:.1f}",
                f"{times[name] / times['balance']:.2f}",
                f"{np.median([one.periods for one in motions]):.0f}" if name != "balance" else "",
                f"{100.0 * max(abs(one.amplitude / reference.amplitude - 1.0) for one, reference in pairs):.4f}",
                f"{np.abs(phases).max():.4f}",
            )
    console.print(table)
    console.print(f"One balance of a period with its Jacobian: {1e6 * time_of_a_balance():.1f} us")


if __name__ == "__main__":
    main()
