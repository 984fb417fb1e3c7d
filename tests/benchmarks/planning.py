"""Whether a planned test decides more than the same time of repeated full loops: python tests/benchmarks/planning.py

Springs of the own class and mounts of five others (tests/helpers/zoo_mounts.py) are recorded at one amplitude and
identified; mounts with a Maxwell branch, a second mechanism or both (added.py) at two rates. Then the programme that is
planned for the model file is recorded, or full loops for the same time. The truth is the mount itself, without noise.

worst: largest 95 % interval of all figures that the plan promises, before and after; of full loops by the same rule.
tenth: error of the energy of loops at a tenth of the amplitude, by the spring of the first record with the forces of a
wider class that the second record adds to it: the mean of what the plan takes the standard deviation of.
identified: errors of the energy at a tenth and at 30 %, of the one spring identified from both records.
"""

from __future__ import annotations

import argparse
import sys
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "helpers"))

from added import KINDS, drawn

from rig import FloatArray, Generator, amplitude_of, draw_spring, log_uniform, strokes_of
from strandspring import Record, Spring, SpringParameters, identify
from strandspring.campaigns.planning.choice import Setting
from strandspring.campaigns.planning.forces import Force, force_along
from strandspring.campaigns.planning.knowledge import Knowledge
from strandspring.campaigns.planning.limits import Limits
from strandspring.campaigns.planning.motion import Motion
from strandspring.campaigns.planning.planned import planned, prepared
from strandspring.campaigns.planning.prior import prior_of_model
from strandspring.errors import StrandspringError
from zoo_mounts import draw_mount

FOREIGN = ("preisach", "iwan", "two mechanisms", "generalised bouc-wen", "vaiana-rosati")
ADDED = {(1, 1): "branch", (2, 0): "second mechanism", (2, 1): "second and branch"}
SLOW = 0.2  # rate of the first test's other loops, where something is added [Hz]
SHARES = (0.1, 0.3)  # amplitudes of small loops, shares of the largest
PER_LOOP = 300  # samples
LOOPS = 16  # time of the second test at most, in full loops of the first one
FASTER = 3.0  # largest velocity of the rig in that of the first test
FACTOR = 2.0  # by which a planned test has to be better
console = Console(width=150)

Response = Callable[[FloatArray, FloatArray], FloatArray]


@dataclass(frozen=True)
class Specimen:
    """A mount: its force along displacements [m] and times [s], from the virgin state [N]."""

    name: str
    force: Response
    centre: float
    amplitude: float

    @property
    def kind(self) -> str:
        """ "own", "added" or "foreign"."""
        return "own" if self.name == "own" else "added" if self.name in ADDED.values() else "foreign"

    def loop(self, share: float) -> tuple[FloatArray, FloatArray, slice]:
        """Path [m] and times [s] of loops about the centre, and the last of them, which is steady."""
        points, cycles = 1000, 12
        time = np.arange(points * cycles + 1) / points
        return self.centre + share * self.amplitude * np.sin(2.0 * np.pi * time), time, slice(-points - 1, None)

    def energy(self, response: Response, share: float) -> float:
        """Energy of the steady loop by a response [J]."""
        path, time, last = self.loop(share)
        return float(np.trapezoid(response(path, time)[last], path[last]))


def of_spring(spring: SpringParameters) -> Response:
    solver = Spring(spring)
    return lambda path, time: solver.response(path, time=time if spring.branches else None)


def specimens(seed: int, count: int) -> list[Specimen]:
    """Every second one of the own class."""
    found = []
    for index in range(count):
        name = "own" if index % 2 == 0 else FOREIGN[index // 2 % len(FOREIGN)]
        generator = np.random.default_rng([seed, zlib.crc32(name.encode()), index])
        if name == "own":
            spring = draw_spring(generator)
            found.append(Specimen(name, of_spring(spring), spring.displacement_offset, amplitude_of(spring)))
        else:
            mount = draw_mount(name, generator, 1.0)
            found.append(Specimen(name, mount.force, mount.centre, mount.amplitude))
    return found


def with_something_added(seed: int, count: int) -> list[Specimen]:
    """Mounts with a Maxwell branch, a second mechanism or both."""
    found = []
    for index in range(count):
        kind = KINDS[1 + index % len(ADDED)]
        mount, amplitude, centre = drawn(np.random.default_rng([seed, index]), kind)
        found.append(Specimen(ADDED[kind], mount.force, centre, amplitude))
    return found


def recorded(
    specimen: Specimen, path: FloatArray, time: FloatArray, noise: float, generator: Generator, name: str
) -> Record:
    """A record with noise of so much of the force's standard deviation; the path is simulated finely."""
    fine = 8
    times = np.interp(np.arange(fine * (time.size - 1) + 1) / fine, np.arange(time.size), time)
    force = specimen.force(np.interp(times, time, path), times)[::fine]
    return Record(path, force + noise * np.std(force) * generator.standard_normal(force.size), time, f"{name}.csv")


def full_loops(specimen: Specimen, duration: float, rate: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Sines of a rate [Hz]."""
    phase = np.arange(round(duration * rate * PER_LOOP) + 1) / PER_LOOP
    return specimen.centre + specimen.amplitude * np.sin(2.0 * np.pi * phase), phase / rate


@dataclass(frozen=True, eq=False)
class Learned:
    """What a second record adds to the knowledge of a spring.

    Attributes
    ----------
    tenth : float       Energy at a tenth of the amplitude [J].
    intervals : ndarray Halves of the 95 % intervals of the figures, shares of their values.
    """

    tenth: float
    intervals: FloatArray


def learned(specimen: Specimen, setting: Setting, known: Sequence[Knowledge], record: Record) -> Learned:
    """The knowledge of springs after a record: the mean is that of the first one, the identified spring."""
    motion = motion_of(record.displacement, record.time)
    after = []
    for knowledge in known:
        force = force_along(knowledge.spring, motion, setting.span, setting.period)
        after.append(knowledge.after(*knowledge.gained(motion, force)))
    loops = setting.loops
    intervals = loops.intervals(after, [loops.gradients(knowledge.spring) for knowledge in known])
    first, then = known[0], after[0]
    force = force_along(first.spring, motion, setting.span, setting.period)
    weights = first.noise.weights(motion, force)
    columns = weights[:, None] * columns_of(first, force)
    change = np.linalg.solve(
        np.eye(len(first.root)) + then.information, columns.T @ (weights * (record.force - force.value))
    )
    path, time, last = specimen.loop(SHARES[0])
    small = force_along(first.spring, motion_of(path, time), setting.span, setting.period)
    corrected = small.value + columns_of(first, small) @ change
    return Learned(float(np.trapezoid(corrected[last], path[last])), intervals)


def columns_of(knowledge: Knowledge, force: Force) -> FloatArray:
    return np.hstack([force.own, force.wider]) @ knowledge.root


def motion_of(path: FloatArray, time: FloatArray) -> Motion:
    """A path of single samples, whose legs are its strokes."""
    leg = np.searchsorted(strokes_of(path)[1:], np.arange(path.size))
    return Motion(path, time - time[0], leg, np.ones(path.size))


@dataclass(frozen=True, eq=False)
class Row:
    """A mount before its second test, after repeated loops, and after the planned test.

    Attributes
    ----------
    kind, name : str
    seconds : float
    worst : tuple of float         Of these three.
    tenth : tuple of float         Likewise, shares of the energy.
    identified : ndarray, (3, 2)   Likewise.
    """

    kind: str
    name: str
    seconds: float
    worst: tuple[float, ...]
    tenth: tuple[float, ...]
    identified: FloatArray

    @property
    def better(self) -> tuple[float, float, float, float]:
        """By how much the planned test is better: worst, tenth, and both of identified."""
        ratios = self.identified[1] / np.maximum(self.identified[2], 1e-4)
        return self.worst[1] / self.worst[2], self.tenth[1] / max(self.tenth[2], 1e-4), *ratios

    @property
    def line(self) -> str:
        parts = [" ".join(f"{100.0 * value:6.1f}" for value in values) for values in (self.worst, self.tenth)]
        parts += [" ".join(f"{100.0 * value:6.1f}" for value in column) for column in self.identified.T]
        return f"{self.name:22} {self.seconds:5.1f} s  " + " | ".join(parts)


def tested(specimen: Specimen, generator: Generator) -> Row:
    """Both second tests of a mount."""
    noise = log_uniform(generator, 0.001, 0.005)
    first = [recorded(specimen, *full_loops(specimen, 4.0), noise, generator, "first")]
    if specimen.kind == "added":
        first.append(recorded(specimen, *full_loops(specimen, 4.0 / SLOW, SLOW), noise, generator, "slow"))
    before = identify(first)
    velocity = 4.0 * specimen.amplitude  # mean of the first test
    prior = prior_of_model(before.model_file(), velocity=velocity)
    limits = Limits(FASTER * velocity, duration=float(LOOPS), sample_rate=float(PER_LOOP))
    setting, known, _ = prepared(prior, limits)
    plan = planned(prior, limits)
    times, programme = plan.path
    truths = [specimen.energy(specimen.force, share) for share in SHARES]
    worst, springs = [float(plan.before.max())], [before.parameters]
    tenth = [abs(specimen.energy(of_spring(before.parameters), SHARES[0]) / truths[0] - 1.0)]
    for name, (path, time) in {
        "repeated": full_loops(specimen, plan.duration),
        "planned": (programme, times),
    }.items():
        record = recorded(specimen, path, time, noise, generator, name)
        result = learned(specimen, setting, known, record)
        worst.append(float(result.intervals.max()))
        tenth.append(abs(result.tenth / truths[0] - 1.0))
        springs.append(identify([*first, record]).parameters)
    identified = [
        [
            abs(specimen.energy(of_spring(spring), share) / truth - 1.0)
            for share, truth in zip(SHARES, truths, strict=True)
        ]
        for spring in springs
    ]
    spring = before.parameters
    found = f" ({1 + (spring.second is not None)}+{len(spring.branches)})" if specimen.kind == "added" else ""
    return Row(specimen.kind, specimen.name + found, plan.duration, tuple(worst), tuple(tenth), np.array(identified))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--added", type=int, default=12, help="mounts with branches and second mechanisms")
    arguments = parser.parse_args()
    console.print(
        f"seed {arguments.seed}, {arguments.count} + {arguments.added} mounts, second test up to {LOOPS} loops"
    )
    console.print("before, repeated, planned [%]: worst | tenth | identified, tenth | identified, 30 %")
    rows = []
    mounts = [*specimens(arguments.seed, arguments.count), *with_something_added(arguments.seed, arguments.added)]
    for index, specimen in enumerate(mounts):
        try:
            rows.append(tested(specimen, np.random.default_rng([arguments.seed, index])))
        except StrandspringError as problem:
            console.print(f"{index:3} {specimen.name}: {problem}", soft_wrap=True)
            continue
        console.print(f"{index:3} {rows[-1].line}", soft_wrap=True)
    table = Table(title="Medians before, after repeated loops, after the planned test [%], and how often twice as good")
    for column in ("mounts", "worst", "twice", "tenth", "twice", "identified, tenth", "identified, 30 %"):
        table.add_column(column)
    for name in ("own", "foreign", "added"):
        part = [row for row in rows if row.kind == name]
        if not part:
            continue
        twice = [f"{sum(row.better[k] >= FACTOR for row in part)} of {len(part)}" for k in range(2)]
        medians = [np.median([getattr(row, key) for row in part], axis=0) for key in ("worst", "tenth", "identified")]
        cells = [" ".join(f"{100.0 * value:.2g}" for value in values) for values in (*medians[:2], *medians[2].T)]
        table.add_row(name, cells[0], twice[0], cells[1], twice[1], *cells[2:])
    console.print(table)


if __name__ == "__main__":
    main()
