"""How far verdicts of `simulate` hold, on drawn systems of a body on four to eight mounts."""

from __future__ import annotations

import numpy as np
from tables import console

from mounted_examples import GRAVITY, FloatArray, hysteretic, unit
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import Mount, MountAxis, Point, RigidBody
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.simulation import run_case
from strandspring.vibration.signals.pulses import CORNERS, HalfSine, StraightPulse
from strandspring.vibration.verdicts.answers import CaseAnswer, answer_case
from strandspring.vibration.verdicts.figures import CaseFigures
from strandspring.vibration.verdicts.verdicts import CaseVerdict, FigureKind, Limits

FINER = 4.0  # steps of the draws
JUDGED = (FigureKind.ACCELERATION, FigureKind.SWAY)


def drawn_system(generator: np.random.Generator) -> MountedSystem:
    """A body of 10 to 40 kg on four to eight mounts of three axes with friction of 20 to 60 N."""
    size, mass = generator.uniform(0.1, 0.25, 3), float(generator.uniform(10.0, 40.0))
    tensor = np.diag(mass / 3.0 * (np.sum(size**2) - size**2))
    body = RigidBody("body", mass, inertia=tuple(map(tuple, tensor.tolist())))
    springs = [hysteretic(float(generator.uniform(0.4, 1.5)), float(generator.uniform(20.0, 60.0))) for _ in range(3)]
    directions = ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    mounts = []
    for k in range(int(generator.integers(4, 9))):
        place = np.array([(-1) ** k, (-1) ** (k // 2), -1.0]) * size * generator.uniform(0.7, 1.0, 3)
        axes = tuple(MountAxis(spring, axis, 0.0) for spring, axis in zip(springs, directions, strict=True))
        mounts.append(Mount(f"mount {k + 1}", 0, tuple(place.tolist()), axes))
    points = tuple(Point(f"point {k}", 0, tuple((size * generator.uniform(-1.0, 1.0, 3)).tolist())) for k in range(2))
    return MountedSystem((body,), tuple(mounts), points)


def drawn_shock(generator: np.random.Generator, strongest: float = 20.0) -> LoadCase:
    """A half-sine or a sawtooth of 5 g to the strongest along any direction."""
    peak, duration = GRAVITY * float(generator.uniform(5.0, strongest)), float(generator.uniform(0.006, 0.02))
    pulses: tuple[Signal, ...] = HalfSine(peak, duration), StraightPulse(peak, duration, CORNERS["terminal-sawtooth"])
    signal = pulses[int(generator.integers(2))]
    channel = LoadChannel(ChannelKind.BASE_ACCELERATION, signal, unit(*generator.standard_normal(3)))
    return LoadCase("shock", "pulse", 0.4, (channel,))


def values_of_draws(answer: CaseAnswer, generator: np.random.Generator, count: int) -> FloatArray:
    """Figures by finer steps with omega drawn by axis, half of the draws uniform and half +-1, shape (count, N)."""
    system, case, known = answer.system, answer.case, CaseFigures(answer.system, answer.case)
    values = []
    for k in range(count):
        omega = generator.uniform(-1.0, 1.0, len(system.axes))
        start = rest(system, 0.0, case.weightless, np.sign(omega) if k % 2 else omega)
        values.append(known.of_run(run_case(system, case, start, answer.runs[0].step / FINER)))
    return np.array(values)


def verdicts(count: int = 100, seed: int = 0) -> None:
    """Verdicts at limits within 15 % of the largest of 60 draws with steps four times finer, which may contradict."""
    rows = []
    for number in range(count):
        generator = np.random.default_rng((seed, 1000 + number))
        system, case = drawn_system(generator), drawn_shock(generator, 10.0)
        any_stroke = {FigureKind.STROKE: np.inf}
        free = answer_case("drawn", system, case, Limits({}, any_stroke))
        kind = JUDGED[number % 2]
        place = next(k for k, figure in enumerate(free.figures) if figure.quantity is kind)
        values = values_of_draws(free, generator, 60)[:, place]
        limit = values.max() * float(generator.uniform(0.85, 1.15))
        limits = Limits({kind: {free.figures[place].subject: limit}}, any_stroke)
        answer = answer_case("drawn", system, case, limits)
        figure = answer.figures[place]
        passes, fails = answer.verdict is CaseVerdict.PASSES, answer.verdict is CaseVerdict.FAILS
        rows.append((answer.verdict.value, passes and values.max() > limit,
                     passes and values.max() > limit + figure.high - figure.low,
                     fails and values.min() < 0.9 * limit))  # fmt: skip
    names = [row[0] for row in rows]
    above, further, failed = np.sum([row[1:] for row in rows], axis=0)
    console.print({name: names.count(name) for name in sorted(set(names))})
    console.print(
        f"passes with a draw above the limit: {above}, by more than the range: {further}; fails below: {failed}"
    )
