"""Whether a planned test decides more than the same time of repeated full loops.

Springs of the own class and mounts of five others (tests/helpers/zoo_mounts.py) in turn are recorded at one amplitude
and identified. Then the programme that is planned for the result is recorded, or full loops for the same time, and the
spring is identified from both records. The truth is the mount itself, without noise.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from tables import console, show

from rig import FloatArray, Generator, Truth, amplitude_of, draw_spring, log_uniform
from strandspring import Record, identify, plan
from strandspring.errors import StrandspringError
from zoo_mounts import draw_mount

FOREIGN = ("preisach", "iwan", "two mechanisms", "generalised bouc-wen", "maxwell rubber")
SHARES = (0.1, 0.3)  # amplitudes of small loops, shares of the largest
PER_LOOP = 300  # samples
LOOPS = 16  # time of the second test at most, in full loops of 1 s
FASTER = 3.0  # largest velocity of the rig in that of the first test


Force = Callable[[FloatArray, FloatArray], FloatArray]  # along displacements [m] and times [s]


class Specimen(NamedTuple):
    """A mount in the virgin state."""

    name: str
    truth: Truth

    def sines(self, share: float, cycles: float, per_cycle: int) -> tuple[FloatArray, FloatArray]:
        """Path [m] and times [s] of loops about the centre."""
        time, p = np.arange(round(cycles * per_cycle) + 1) / per_cycle, self.truth.spring
        return p.displacement_offset + share * amplitude_of(p) * np.sin(2.0 * np.pi * time), time

    def energies(self, force: Force) -> FloatArray:
        """Energy of the steady small loops by a force [J]."""
        found = []
        for share in SHARES:
            path, time = self.sines(share, 12, 1000)
            found.append(np.trapezoid(force(path, time)[-1001:], path[-1001:]))
        return np.array(found)

    def recorded(self, path: FloatArray, time: FloatArray, noise: float, generator: Generator, name: str) -> Record:
        """A record with noise of so much of the force's standard deviation; the path is simulated finely."""
        times = np.interp(np.arange(8 * (time.size - 1) + 1) / 8, np.arange(time.size), time)
        force = self.truth.response(np.interp(times, time, path), times)[::8]
        return Record(path, force + noise * np.std(force) * generator.standard_normal(force.size), time, f"{name}.csv")


def drawn(seed: int, index: int) -> Specimen:
    """Every second one of the own class."""
    name = "own" if index % 2 == 0 else FOREIGN[index // 2 % len(FOREIGN)]
    generator = np.random.default_rng([seed, zlib.crc32(name.encode()), index])
    return Specimen(name, Truth(draw_spring(generator)) if name == "own" else draw_mount(name, generator, 1.0))


def tested(specimen: Specimen, generator: Generator) -> tuple[FloatArray, FloatArray]:
    """Widest interval before and after the plan, and errors of energies before, after full loops, after the plan."""
    noise = log_uniform(generator, 0.001, 0.005)
    first = specimen.recorded(*specimen.sines(1.0, 4, PER_LOOP), noise, generator, "first")
    before = identify(first)
    velocity = FASTER * 4.0 * amplitude_of(specimen.truth.spring)
    chosen = plan(before, velocity=velocity, duration=float(LOOPS), sample_rate=float(PER_LOOP))
    springs = [before.spring()]
    full = specimen.sines(1.0, chosen.plan.duration, PER_LOOP)
    for name, (path, time) in {"repeated": full, "planned": chosen.program()[::-1]}.items():
        springs.append(identify([first, specimen.recorded(path, time, noise, generator, name)]).spring())
    truths = specimen.energies(specimen.truth.response)
    errors = []
    for spring in springs:
        branches = spring.parameters.branches
        energies = specimen.energies(lambda x, t, s=spring, b=branches: s.response(x, time=t if b else None))
        errors.append(np.abs(energies / truths - 1.0))
    return np.array([chosen.plan.before.max(), chosen.plan.after.max()]), np.array(errors).T


def planning(count: int = 30, seed: int = 0) -> None:
    """The planned second test against full loops for the same time, of `count` mounts."""
    found: dict[str, list[tuple[FloatArray, FloatArray]]] = {"own class": [], "other classes": []}
    for index in range(count):
        specimen = drawn(seed, index)
        try:
            one = tested(specimen, np.random.default_rng([seed, index]))
        except StrandspringError as problem:
            console.print(f"{index} {specimen.name}: {problem}", soft_wrap=True)
            continue
        found["own class" if specimen.name == "own" else "other classes"].append(one)
        console.print(index, specimen.name, *(np.array2string(100.0 * part, precision=2) for part in one))

    def medians(parts: list[FloatArray]) -> str:
        return " / ".join(f"{100.0 * value:.2g}" for value in np.median(parts, axis=0))

    rows = [
        {"medians [%]": name, "widest interval, before / planned": medians([widths for widths, _ in each])}
        | {f"energy at {100 * share:g} %, before / full / planned": medians([errors[k] for _, errors in each])
           for k, share in enumerate(SHARES)}
        for name, each in found.items() if each
    ]  # fmt: skip
    show(f"Planned tests, {count} mounts", rows)
