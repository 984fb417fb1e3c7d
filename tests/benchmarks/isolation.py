"""Harmonic balance against time integration to the steady state: python tests/benchmarks/isolation.py

A mass on a hardening spring, 200 frequencies at 3 levels of base displacement: greatest difference in amplitude and
phase, and the time of each. Time integration starts from rest and ends when three periods in a row repeat within 1e-5.
It takes some five minutes; `--every 10` takes every tenth frequency.
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
from strandspring.isolation.response import frequency_response
from strandspring.isolation.system import Excitation, IsolatedMass

LEVELS = (2e-4, 6e-4, 1.2e-3)
BAND = np.geomspace(2.5, 40.0, 200)
console = Console(width=118)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="take every so many frequencies in time integration")
    every = parser.parse_args().every
    # Without some viscous damping small free vibrations take thousands of periods to die out.
    system = IsolatedMass(MOUNT, 5.0, 50.0, damping=15.0)
    table = Table(title=f"{BAND.size} frequencies from {BAND[0]:g} to {BAND[-1]:g} Hz, times per point")
    for column in (
        "level [mm]", "amplitude off [%]", "phase off [deg]", "periods", "balance [ms]", "integration [ms]", "ratio",
    ):  # fmt: skip
        table.add_column(column, justify="right")
    frequency_response(system, Excitation.BASE_DISPLACEMENT, LEVELS[0], BAND[:2])  # imports and tables
    for level in LEVELS:
        begin = time.perf_counter()
        found = frequency_response(system, Excitation.BASE_DISPLACEMENT, level, BAND)
        balance = (time.perf_counter() - begin) / BAND.size
        points = [point for point in found.points if point.wanted][::every]
        begin = time.perf_counter()
        references = [
            shaken(system, Excitation.BASE_DISPLACEMENT, level, point.frequency)
            for point in track(points, f"{1e3 * level:g} mm", console=Console(stderr=True), transient=True)
        ]
        integration = (time.perf_counter() - begin) / len(points)
        amplitude = [r.amplitude / p.amplitude - 1.0 for r, p in zip(references, points, strict=True)]
        phase = [np.degrees(np.angle(r.relative)) - p.relative_phase for r, p in zip(references, points, strict=True)]
        table.add_row(
            f"{1e3 * level:g}",
            f"{100.0 * np.abs(amplitude).max():.4f}",
            f"{np.abs((np.array(phase) + 180.0) % 360.0 - 180.0).max():.4f}",
            f"{np.median([r.periods for r in references]):.0f}",
            f"{1e3 * balance:.2f}",
            f"{1e3 * integration:.0f}",
            f"{integration / balance:.0f}",
        )
    console.print(table)


if __name__ == "__main__":
    main()
