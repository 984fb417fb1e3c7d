"""What bodies on mounts cost in time, as ratios within one run: python tests/benchmarks/systems.py

A step of six degrees of freedom on twelve springs is compared with a sample of the same kind of spring along a path
(`Spring.response`). Machines are noisy, so nothing here is asserted; each figure is the best of several, on one core.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from mounted_examples import COMPRESSION, GRAVITY, box, unit
from strandspring import Spring, SpringParameters, examples, isolate_system
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.simulation import run_case
from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.pulses import HalfSine
from strandspring.vibration.signals.random_signal import RandomVibration

ROUNDS, DRAWS = 5, 1000
SHOCK_STEP, RANDOM_STEP = 1e-4, 1.0 / 20_000
console = Console(width=110)


def fastest(work: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Shortest processor time [s]."""
    times = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def case(name: str, duration: float, signal: Signal) -> LoadCase:
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, signal, unit(1.0, 2.0, 3.0))
    return LoadCase(name, "pulse", duration, (channel,))


SHOCK = case("shock", 1.0, HalfSine(15.0 * GRAVITY, 0.011))


def runs() -> list[tuple[str, float, int, float]]:
    """Name, processor time [s], steps and target [s] of a 1 s shock, 1000 drawn ones and 60 s at random."""
    system = box()
    start = rest(system)
    count = round(SHOCK.duration / SHOCK_STEP)
    density = LevelTable(((10.0, 0.01 * GRAVITY**2), (200.0, 0.01 * GRAVITY**2)))
    shaken = case("random", 60.0, RandomVibration(density, 60.0, 1))
    long = round(shaken.duration / RANDOM_STEP)
    factors = np.random.default_rng(1).lognormal(0.0, 0.1, DRAWS).tolist()

    def drawn() -> None:
        """Each with springs of its own: tables of their laws, rest and motion."""
        for factor in factors:

            def change(spring: SpringParameters, factor: float = factor) -> SpringParameters:
                return SpringParameters(
                    tuple(factor * k for k in spring.kE), spring.kA, factor * spring.kappa_omega, spring.rho,
                    spring.sigma, spring.n, spring.displacement_offset, spring.displacement_min,
                    spring.displacement_max,
                )  # fmt: skip

            one = system.with_springs(change)
            run_case(one, SHOCK, rest(one), SHOCK_STEP)

    shock = fastest(lambda: run_case(system, SHOCK, start, SHOCK_STEP))
    random = fastest(lambda: run_case(system, shaken, start, RANDOM_STEP))
    return [
        ("1 s shock", shock, count, 500e-9 * count),
        ("60 s random at 20 kHz", random, long, 2.0),
        (f"{DRAWS} draws of a 1 s shock", fastest(drawn, 1), DRAWS * count, 15.0),
    ]


def isolation() -> None:
    """Steady vibration of the electronics box: two candidates, three directions, three levels."""
    box_file = Path(examples.__file__).parent / "systems" / "electronics_box.toml"
    seconds = fastest(lambda: isolate_system(box_file), 2)
    curves = len(list(isolate_system(box_file).every))
    console.print(f"isolate, {curves} curves of 200 frequencies: {seconds:.1f} s of processor time on all cores")


def main() -> None:
    isolation()
    path = 0.02 * np.sin(np.linspace(0.0, 40.0 * np.pi, 1_000_000))
    spring = Spring(COMPRESSION)
    sample = fastest(lambda: spring.response(path)) / path.size
    table = Table(title=f"Six degrees of freedom on 12 springs; a sample of `response` takes {1e9 * sample:.1f} ns")
    for column in ("run", "s", "target s", "ns/step", "samples/step"):
        table.add_column(column, justify="right")
    for name, seconds, steps, target in runs():
        each = seconds / steps
        table.add_row(name, f"{seconds:.3f}", f"{target:g}", f"{1e9 * each:.0f}", f"{each / sample:.1f}")
    console.print(table)


if __name__ == "__main__":
    console.print(f"Python {platform.python_version()}, NumPy {np.__version__}, {os.cpu_count()} cores")
    main()
