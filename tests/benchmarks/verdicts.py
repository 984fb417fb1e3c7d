"""How far ranges and verdicts of `simulate` hold, on drawn systems:

    python tests/benchmarks/verdicts.py [ranges] [verdicts] [random] [errors] [--seed N] [--share 0.2]

`ranges`: ten systems, each with 200 draws of omega by axis (uniform, or +-1): the share of draws beyond the printed
range, of every figure. `verdicts`: 100 limits within +-15 % of the largest value of such draws and of steps four times
finer: no "pass" may be contradicted. `random`: rms and peak of 100 seeds beside the printed range. `errors`: the
printed numerical error of 40 systems against steps eight times finer. `--share` takes that share of the systems,
limits and seeds.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

from mounted_examples import GRAVITY, FloatArray, hysteretic, unit
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import Mount, MountAxis, Point, RigidBody
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.run_figures import RunFigures
from strandspring.vibration.bodies.simulation import run_case, simulate_case
from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.pulses import CORNERS, HalfSine, StraightPulse
from strandspring.vibration.signals.random_signal import RandomVibration
from strandspring.vibration.verdicts.answers import CaseAnswer, answer_case
from strandspring.vibration.verdicts.figures import CaseFigures
from strandspring.vibration.verdicts.verdicts import CaseVerdict, FigureKind, Limits

console = Console(width=110)
CHECKED = ("acceleration", "sway", "tilt", "force")
ANY_STROKE = {FigureKind.STROKE: math.inf}
JUDGED = (FigureKind.ACCELERATION, FigureKind.SWAY)


def drawn_system(generator: np.random.Generator) -> MountedSystem:
    """A body of 10 to 40 kg on four to eight mounts of three axes with friction of 20 to 60 N."""
    size = generator.uniform(0.1, 0.25, 3)
    mass = float(generator.uniform(10.0, 40.0))
    moments = mass / 3.0 * (np.sum(size**2) - size**2)
    tensor = np.diag(moments)
    body = RigidBody("body", mass, inertia=tuple(map(tuple, tensor.tolist())))
    mounts = []
    springs = [hysteretic(float(generator.uniform(0.4, 1.5)), float(generator.uniform(20.0, 60.0))) for _ in range(3)]
    directions = ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    for k in range(int(generator.integers(4, 9))):
        sides = np.array([(-1) ** k, (-1) ** (k // 2), -1.0])
        place = sides * size * generator.uniform(0.7, 1.0, 3)
        axes = tuple(MountAxis(spring, axis, 0.0) for spring, axis in zip(springs, directions, strict=True))
        mounts.append(Mount(f"mount {k + 1}", 0, tuple(place.tolist()), axes))
    points = tuple(Point(f"point {k}", 0, tuple((size * generator.uniform(-1.0, 1.0, 3)).tolist())) for k in range(2))
    return MountedSystem((body,), tuple(mounts), points)


def drawn_shock(generator: np.random.Generator, strongest: float = 20.0) -> LoadCase:
    """A half-sine or a sawtooth of 5 g to the strongest along any direction."""
    peak, duration = GRAVITY * float(generator.uniform(5.0, strongest)), float(generator.uniform(0.006, 0.02))
    sawtooth = StraightPulse(peak, duration, CORNERS["terminal-sawtooth"])
    signal: Signal = (HalfSine(peak, duration), sawtooth)[int(generator.integers(2))]
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, signal, unit(*generator.standard_normal(3)))
    return LoadCase("shock", "pulse", 0.4, (channel,))


def values_of_draws(answer: CaseAnswer, generator: np.random.Generator, count: int, finer: float = 1.0) -> FloatArray:
    """Figures with omega drawn by axis, half of the draws uniform and half +-1, shape (count, N)."""
    system, case, known = answer.system, answer.case, CaseFigures(answer.system, answer.case)
    values = []
    for k in range(count):
        omega = generator.uniform(-1.0, 1.0, len(system.axes))
        start = rest(system, 0.0, case.weightless, np.sign(omega) if k % 2 else omega)
        values.append(known.of_run(run_case(system, case, start, answer.runs[0].step / finer)))
    return np.array(values)


def ranges(seed: int, share: float) -> None:
    table = Table(title="Draws beyond the printed range (both ends, 200 draws of omega by axis)")
    for heading in ("system", "axes", "figures", "largest share %", "of", "beyond three omegas %"):
        table.add_column(heading)
    for number in range(math.ceil(10 * share)):
        generator = np.random.default_rng((seed, number))
        answer = answer_case("drawn", drawn_system(generator), drawn_shock(generator), Limits())
        values = values_of_draws(answer, generator, 200)
        low, high = (np.array([getattr(figure, end) for figure in answer.figures]) for end in ("low", "high"))
        beyond = ((values < low) | (values > high)).mean(axis=0)
        system = answer.system
        poses = [rest(system, share) for share in (0.0, 1.0, -1.0)]
        known = CaseFigures(system, answer.case)
        step = answer.runs[0].step
        three = np.array([known.of_run(run_case(system, answer.case, pose, step)) for pose in poses])
        before = (values > 1.001 * three.max(axis=0)).mean(axis=0)
        worst = int(np.argmax(beyond))
        figure = answer.figures[worst]
        table.add_row(
            str(number), str(len(system.axes)), str(len(low)), f"{100.0 * beyond[worst]:.1f}",
            f"{figure.quantity.value} of {figure.subject}", f"{100.0 * before.max():.0f}",
        )  # fmt: skip
    console.print(table)


def verdicts(seed: int, share: float) -> None:
    counts: dict[CaseVerdict, int] = {}
    contradicted = 0
    for number in range(math.ceil(100 * share)):
        generator = np.random.default_rng((seed, 1000 + number))
        system, case = drawn_system(generator), drawn_shock(generator, 10.0)
        free = answer_case("drawn", system, case, Limits({}, ANY_STROKE))
        values = values_of_draws(free, generator, 60, 4.0)
        kind = JUDGED[number % 2]
        place = next(k for k, figure in enumerate(free.figures) if figure.quantity is kind)
        true = float(values[:, place].max())
        limit = true * float(generator.uniform(0.85, 1.15))
        subject = free.figures[place].subject
        answer = answer_case("drawn", system, case, Limits({kind: {subject: limit}}, ANY_STROKE))
        counts[answer.verdict] = counts.get(answer.verdict, 0) + 1
        figure = answer.figures[place]
        if answer.verdict is CaseVerdict.PASSES and true > limit + figure.high - figure.low:
            contradicted += 1
        elif answer.verdict is CaseVerdict.PASSES and true > limit:
            console.print(
                f"{number}: pass at {limit:.4g}, true {true:.4g}, range {figure.low:.4g} to {figure.high:.4g}"
            )
        if answer.verdict is CaseVerdict.FAILS and float(values[:, place].min()) < 0.9 * limit:
            console.print(f"{number}: fail at {limit:.4g}, but some draw has {values[:, place].min():.4g}")
    console.print({verdict.value: count for verdict, count in counts.items()}, f"contradicted passes: {contradicted}")


def random_vibration(seed: int, share: float) -> None:
    table = Table(title="30 s of random vibration: printed, and other seeds with steps four times finer")
    for heading in ("figure", "value", "mean of seeds", "standard error %", "low to high", "seeds 5 to 95 %", "beyond"):
        table.add_column(heading)
    generator = np.random.default_rng((seed, 3))
    system = drawn_system(generator)
    density = LevelTable(((10.0, 0.02 * GRAVITY**2), (500.0, 0.02 * GRAVITY**2)))
    signal = RandomVibration(density, 30.0, 1)
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, signal, unit(*generator.standard_normal(3)))
    case = LoadCase("random", "random", 30.0, (channel,), 3.0)
    answer = answer_case("drawn", system, case, Limits())
    known = CaseFigures(system, case)
    values = []
    for k in range(math.ceil(100 * share)):
        omega = generator.uniform(-1.0, 1.0, len(system.axes))
        another = replace(case, channels=(replace(channel, signal=replace(signal, seed=10_000 + k)),))
        start = rest(system, 0.0, False, omega)
        values.append(known.of_run(run_case(system, another, start, 0.25 * answer.runs[0].step)))
    of_seeds = np.array(values)
    for k, figure in enumerate(answer.figures):
        if figure.quantity in (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.THREE_SIGMA):
            factor, column = figure.quantity.column.factor, of_seeds[:, k]
            error = column.std(ddof=1) / np.sqrt(len(answer.runs) - 1) / column.mean()
            ends = factor * np.quantile(column, (0.05, 0.95))
            table.add_row(
                f"{figure.quantity.value} of {figure.subject}", f"{factor * figure.value:.4g}",
                f"{factor * column.mean():.4g}", f"{100 * error:.2g}",
                f"{factor * figure.low:.4g} to {factor * figure.high:.4g}", f"{ends[0]:.4g} to {ends[1]:.4g}",
                f"{np.mean((column < figure.low) | (column > figure.high)):.2f}",
            )  # fmt: skip
    console.print(
        f"steps of {1e6 * answer.runs[0].step:.4g} us, and of {1e6 * answer.runs[1].step:.4g} us for the draws"
    )
    console.print(table)


def errors(seed: int, share: float) -> None:
    ratios: dict[str, list[float]] = {name: [] for name in CHECKED}
    for number in range(math.ceil(40 * share)):
        generator = np.random.default_rng((seed, 2000 + number))
        system, case = drawn_system(generator), drawn_shock(generator)
        run = simulate_case(system, case)
        finer: RunFigures = run_case(system, case, run.start, 0.125 * run.step).figures
        for name in CHECKED:
            true = np.abs(getattr(run.figures, name) - getattr(finer, name))
            printed = getattr(run.errors, name)
            worst = int(np.argmax(true))
            ratios[name].append(float(true[worst] / max(printed[worst], 1e-12)))
    table = Table(title=f"True error of the worst subject over the printed one, {len(ratios['tilt'])} systems")
    for heading in ("figure", "median", "90 %", "largest", "above 1"):
        table.add_column(heading)
    for name, of_systems in ratios.items():
        quantiles = np.quantile(of_systems, (0.5, 0.9, 1.0))
        table.add_row(name, *(f"{value:.2f}" for value in quantiles), str(sum(ratio > 1.0 for ratio in of_systems)))
    console.print(table)


CHECKS = {"ranges": ranges, "verdicts": verdicts, "random": random_vibration, "errors": errors}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checks", nargs="*", choices=[*CHECKS, []])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--share", type=float, default=1.0, help="of the systems, limits and seeds, 0 to 1")
    given = parser.parse_args()
    for name in given.checks or CHECKS:
        CHECKS[name](given.seed, given.share)


if __name__ == "__main__":
    main()
