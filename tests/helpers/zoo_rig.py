"""Records of the mounts of the zoo on a rig, with or without one of the faults of `rig_faults`, and what is true."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig import Experiment, Fault, FloatArray, Generator, Run, Truth, log_uniform
from rig_faults import FAULTS
from strandspring import Record, SpringParameters
from zoo_mounts import Mount, draw_mount

FINE = 1200  # steps of the fine grid in a cycle, at least
SMALL = 0.3  # amplitude of small loops, share of the largest
# Faults of the rig alone: the mount beside them stays what it is. The two zeros need several records.
RIG_FAULTS = (
    "force lags", "force leads", "low-pass on the force", "linear drift", "warm-up", "displacement noise",
    "displacement steps", "force steps", "sampling jitter", "clipped force", "play", "dwells", "gaps", "duplicates",
    "mains hum", "outliers",
)  # fmt: skip
ZEROS = ("displacement zero", "force zero")
FORCE_SHIFTS = ("linear drift", "warm-up", "force zero")  # what the force is counted from is open
NO_FAULT = Fault(0.0, 0.0, "", ())


@dataclass(frozen=True)
class MountTruth(Truth):
    """A mount in place of a spring, as far as the faults ask: the ends of its force [N]."""

    ends: tuple[float, float] = (0.0, 0.0)

    def response(self, _: FloatArray) -> FloatArray:
        return np.array(self.ends)


@dataclass(frozen=True, eq=False)
class ZooCase:
    """Records of one mount, and the truth.

    Attributes
    ----------
    name : str
    mount : Mount
    experiment : Experiment
    fault : str                         "" without one.
    magnitude : float                   Size of the fault in its unit.
    records : tuple of Record
    path, time : ndarray, shape (F,)    Displacement of the mount [m] on the fine grid of time [s], all records.
    clean : tuple of ndarray, (3, K)    For the samples of each record: true displacement [m], the mount's force without
                                        noise and fault [N], number of cycles since the beginning.
    """

    name: str
    mount: Mount
    experiment: Experiment
    fault: str
    magnitude: float
    records: tuple[Record, ...]
    path: FloatArray
    time: FloatArray
    clean: tuple[FloatArray, ...]

    @property
    def amplitudes(self) -> int:
        return len(self.experiment.amplitudes)

    @property
    def scale(self) -> float:
        """Standard deviation of the mount's force on the records [N]."""
        return float(np.std(np.concatenate([clean[1] for clean in self.clean])))

    def after(self, turns: Sequence[float]) -> tuple[FloatArray, FloatArray, slice]:
        """The path of the test and after it strokes to these displacements, over the amplitude about the centre.

        Returns
        -------
        path, time : ndarray   [m], [s]
        added : slice          What comes after the test; each of its strokes takes half a period.
        """
        half = round(0.5 * self.experiment.period / (self.time[1] - self.time[0]))
        ways = np.arange(1, half + 1) / half
        if self.experiment.shape == "sine":
            ways = 0.5 - 0.5 * np.cos(np.pi * ways)
        begin = float(self.path[-1] - self.mount.centre) / self.mount.amplitude
        places = np.array([begin, *turns])
        y = np.concatenate([a + (b - a) * ways for a, b in pairwise(places)])
        path = np.concatenate([self.path, self.mount.centre + self.mount.amplitude * y])
        return path, (self.time[1] - self.time[0]) * np.arange(path.size), slice(self.path.size, None)

    def small_energy(self) -> float:
        """Energy of the mount's loop of SMALL amplitude about the centre after the test [J]."""
        # A mount that changes goes on changing.
        cycles = 3 if self.mount.changes else 12
        path, time, _ = self.after([SMALL, -SMALL] * cycles + [SMALL])
        force = self.mount.force(path, time)
        stroke = round(0.5 * self.experiment.period / (time[1] - time[0]))
        last = slice(path.size - 2 * stroke - 1, None)
        return float(np.trapezoid(force[last], path[last]))

    def loops(self) -> Iterator[list[list[NDArray[np.intp]]]]:
        """By amplitude, for each record the samples of every steady cycle."""
        begun = 0
        for cycles in self.experiment.cycles:
            numbers, begun = range(begun + 1, begun + cycles), begun + cycles
            yield [[np.flatnonzero((c[2] >= number) & (c[2] <= number + 1)) for number in numbers] for c in self.clean]


def draw_case(name: str, seed: int, index: int) -> ZooCase:
    """Case number `index` of a mount: one, two and three amplitudes in turn, every second three with a fault."""
    generator = np.random.default_rng([seed, zlib.crc32(name.encode()), index])
    frequency = log_uniform(generator, 0.1, 5.0)
    mount = draw_mount(name, generator, frequency)
    experiment = draw_programme(generator, 1 + index % 3, frequency)
    faulty = index // 3 % 2 == 1
    fault = str(generator.choice((*RIG_FAULTS, *ZEROS) if experiment.separate else RIG_FAULTS)) if faulty else ""
    return recorded(name, mount, experiment, generator, fault)


def draw_programme(generator: Generator, amplitudes: int, frequency: float) -> Experiment:
    """An experiment with this many amplitudes; `samples` are those of a cycle times the cycles."""
    low, middle = generator.uniform(0.25, 0.4), generator.uniform(0.5, 0.75)
    shares = {1: (1.0,), 2: (generator.uniform(0.3, 0.6), 1.0), 3: (low, middle, 1.0)}[amplitudes]
    order = generator.choice(["ascending", "descending", "mixed"])
    if order == "mixed":
        shares = tuple(generator.permutation(shares).tolist())
    elif order == "descending":
        shares = shares[::-1]
    cycles = tuple(generator.integers(3 if amplitudes == 1 else 2, 6 if amplitudes == 1 else 5, amplitudes).tolist())
    return Experiment(
        shape="triangle" if generator.random() < 1.0 / 3.0 else "sine",
        amplitudes=shares,
        cycles=cycles,
        separate=amplitudes == 3 and bool(generator.random() < 0.5),
        frequency=frequency,
        samples=int(generator.integers(150, 601)) * sum(cycles),
        noise=generator.uniform(0.001, 0.005),
        synchronous=bool(generator.random() < 0.5),
    )


def recorded(name: str, mount: Mount, experiment: Experiment, generator: Generator, fault_name: str = "") -> ZooCase:
    """The records that a rig gives: one mount that goes through them one after another."""
    fault = FAULTS[fault_name] if fault_name else NO_FAULT
    # Between the small size and the geometric mean of small and large.
    magnitude = fault.small and log_uniform(generator, fault.small, (fault.small * fault.large) ** 0.5)
    quarter = max(2, round(experiment.samples / (4 * sum(experiment.cycles))))
    stride = -(-FINE // (4 * quarter))
    fine = 4 * quarter * stride
    if not experiment.synchronous:
        stride += 1

    def act(stage: str, run: Run) -> None:
        action = getattr(fault, stage)
        if action is not None:
            action(run, magnitude, generator)

    duration, begun = sum(experiment.cycles) * experiment.period, 0
    runs: list[Run] = []
    for segments in experiment.segments:
        path, cycle = wave(experiment.shape, segments, fine)
        run = Run(
            Truth(_stand_in(mount)), experiment, len(runs), begun * experiment.period, duration,
            experiment.period / fine, stride, mount.centre + mount.amplitude * path, begun + cycle,
        )  # fmt: skip
        run.measured = run.path
        begun += sum(cycles for _, cycles in segments)
        act("motion", run)
        runs.append(run)
    # The last sample of a record is the first one of the next.
    begins = np.cumsum([0, *(run.path.size - 1 for run in runs)])
    path = np.concatenate([runs[0].path, *(run.path[1:] for run in runs[1:])])
    time = runs[0].step * np.arange(path.size)
    elastic, hysteretic = mount.parts(path, time)
    clean = elastic + hysteretic
    scale, ends = float(np.std(clean)), (float(clean.min()), float(clean.max()))
    for run, begin in zip(runs, begins, strict=False):
        piece = slice(begin, begin + run.path.size)
        run.truth = MountTruth(run.truth.spring, ends=ends)
        run.elastic, run.hysteretic = elastic[piece], hysteretic[piece]
        act("force", run)
        run.force = run.elastic + run.hysteretic
        act("signals", run)
        first = 0 if experiment.synchronous else int(generator.integers(stride))
        run.at = np.arange(first, run.path.size, stride)
        noise = scale * experiment.noise * generator.standard_normal(run.at.size)
        # What is true goes along with the samples, some of which a fault may lose or repeat.
        run.samples = np.stack(
            [
                run.time[run.at], run.measured[run.at], run.force[run.at] + noise,
                run.path[run.at], clean[piece][run.at], run.cycle[run.at],
            ]
        )  # fmt: skip
        act("sampled", run)
    records = [Record(run.samples[1], run.samples[2], run.samples[0], f"zoo_{run.index + 1}.csv") for run in runs]
    truths = tuple(run.samples[3:] for run in runs)
    return ZooCase(name, mount, experiment, fault_name, magnitude, tuple(records), path, time, truths)


def _stand_in(mount: Mount) -> SpringParameters:
    """A linear spring of the mount's size, which faults take their unit from."""
    elastic = max(abs(sum(mount.elastic[1:])), 1e-3 * mount.friction)
    return SpringParameters(
        (mount.elastic[0], elastic / mount.amplitude), (1.0,), mount.friction, 10.0 / mount.amplitude, 1.0, 1.0,
        mount.centre, mount.centre - mount.amplitude, mount.centre + mount.amplitude,
    )  # fmt: skip


def wave(shape: str, segments: Sequence[tuple[float, int]], fine: int) -> tuple[FloatArray, FloatArray]:
    """Displacement over the largest amplitude and the number of cycles, on the fine grid of one record."""
    phase = np.arange(fine) / fine
    period = np.sin(2.0 * np.pi * phase) if shape == "sine" else np.interp(phase, [0, 0.25, 0.75, 1], [0, 1, -1, 0])
    path = np.concatenate([*(amplitude * np.tile(period, cycles) for amplitude, cycles in segments), [0.0]])
    return path, np.arange(path.size) / fine
