"""A simulated test rig: drawn springs and the records of experiments with them, and whether a spring found is right.

A run is simulated on a fine grid of time that holds every reversal, so that the forces are exact, and is sampled at the
end. A fault acts at one stage of it: on the programme, on the motion, on the spring's force, on the measured signals of
the fine grid, or on the samples.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray

from strandspring import Record, Spring, SpringParameters

FloatArray = NDArray[np.float64]
Generator = np.random.Generator
Size = Literal["small", "large", "drawn"]

# Cautions that put the energy of small loops in doubt point to a wrong spring, whatever the fault; without a fault
# those do too that leave open which of several springs it is, or say that it does not fit.
DOUBTED = ("undecided", "small loops")
UNDECIDED = (*DOUBTED, "uncertain", "misfit", "poorly", "extrapolat", "span")


def log_uniform(generator: Generator, low: float, high: float) -> float:
    return float(np.exp(generator.uniform(np.log(low), np.log(high))))


def draw_spring(
    generator: Generator,
    n: tuple[float, float] = (0.1, 12.0),
    sigma: tuple[float, float] = (0.5, 10.0),
    saturations: tuple[float, float] = (4.0, 60.0),
    friction: tuple[float, float] = (0.03, 0.4),
    degrees: tuple[int, int] | None = None,
) -> SpringParameters:
    """A monotone, hardening spring of real size.

    n, sigma, rho*amplitude and kappa_omega as a share of the elastic force are drawn log-uniformly from these ranges;
    degrees of FE and FA that are None from 1 to 4 and 0 to 2.
    """
    amplitude = log_uniform(generator, 1e-3, 50e-3)
    elastic = log_uniform(generator, 10.0, 1000.0)
    share = log_uniform(generator, *friction)
    elastic_degree, amplifier_degree = degrees or (int(generator.integers(1, 5)), int(generator.integers(0, 3)))
    y = np.linspace(-1.0, 1.0, 201)
    while True:
        # Coefficients of powers of y = x/amplitude.
        shape = np.array([0.0, 1.0, *generator.uniform([-0.25, 0.1, -0.2], [0.25, 0.8, 0.2])])[: elastic_degree + 1]
        slope = polyval(y, np.arange(1, shape.size) * shape[1:])
        amplifier = np.array([1.0, *generator.uniform([-0.4, -0.3], [0.4, 0.5])])[: amplifier_degree + 1]
        if slope.min() > 0.2 and polyval(y, amplifier).min() > 0.3:
            break
    shape[0] = generator.uniform(-1.0, 1.5)
    centre = generator.uniform(-0.1, 0.3)
    rho, own_sigma = log_uniform(generator, *saturations) / amplitude, log_uniform(generator, *sigma)
    kE, kA = elastic * shape / amplitude ** np.arange(shape.size), amplifier / amplitude ** np.arange(amplifier.size)
    return SpringParameters(
        tuple(kE), tuple(kA), share * elastic, rho, own_sigma, log_uniform(generator, *n), centre,
        centre - amplitude, centre + amplitude,
    )  # fmt: skip


def amplitude_of(spring: SpringParameters) -> float:
    return 0.5 * (spring.displacement_max - spring.displacement_min)


def elastic_force(spring: SpringParameters) -> float:
    """Half the range of FE [N], the size that faults of the force are measured in."""
    return 0.5 * float(np.ptp(polyval(np.array([spring.x_min, spring.x_max]), spring.kE)))


@dataclass(frozen=True)
class Truth:
    """What is the spring and not the rig."""

    spring: SpringParameters
    backbone: Callable[[FloatArray], FloatArray] | None = None  # force [N] of y = (x - centre)/amplitude in place of FE
    stiffness: float = 0.0  # of a spring in parallel, about the centre [N/m]
    shift: float = 0.0  # where the record's coordinates see the spring's zero [m]

    def response(self, displacement: FloatArray) -> FloatArray:
        """Force along a path that starts with omega = 0 [N]."""
        return sum(self.parts(displacement - self.shift))

    def parts(self, path: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elastic and hysteretic force along a path in the spring's own coordinates [N]."""
        p = self.spring
        x = path - p.displacement_offset
        FE = Spring(replace(p, kappa_omega=1e-15)).response(path)
        elastic = FE if self.backbone is None else self.backbone(x / amplitude_of(p))
        return elastic + self.stiffness * x, Spring(p).response(path) - FE


@dataclass(frozen=True)
class Experiment:
    """Displacement programme, sampling and noise."""

    shape: Literal["sine", "triangle"] = "sine"
    amplitudes: tuple[float, ...] = (0.4, 0.7, 1.0)  # shares of the largest amplitude
    cycles: tuple[int, ...] = (3, 3, 3)  # of each amplitude
    separate: bool = False  # one record for each amplitude instead of one of all
    frequency: float = 0.5  # [Hz]
    samples: int = 1000  # of all records together, about
    noise: float = 0.005  # standard deviation of the force's noise, share of the force's
    synchronous: bool = True  # every reversal is sampled; otherwise reversals fall between the samples

    @property
    def period(self) -> float:
        return 1.0 / self.frequency


def draw_experiment(generator: Generator, **fixed: Any) -> Experiment:
    """An experiment with one to four amplitudes; `fixed` are fields of Experiment that are not drawn."""
    choices = ((1.0,), (1.0,), (0.5, 1.0), (0.4, 0.7, 1.0), (0.3, 0.6, 1.0), (0.35, 0.55, 0.75, 1.0))
    amplitudes = choices[int(generator.integers(len(choices)))]
    drawn = Experiment(
        shape="sine" if generator.random() < 0.5 else "triangle",
        amplitudes=amplitudes,
        cycles=tuple(int(c) for c in generator.integers(2 if len(amplitudes) > 1 else 3, 5, len(amplitudes))),
        separate=bool(generator.random() < 0.5),
        frequency=log_uniform(generator, 0.1, 2.0),
    )
    return replace(drawn, **fixed)


@dataclass
class Run:
    """One record while it is simulated; the faults change it in place. The fine grid has F points, the record K."""

    truth: Truth
    experiment: Experiment
    index: int  # of the record among those of the experiment
    step: float  # of the fine grid [s]
    stride: int  # fine steps from sample to sample
    path: FloatArray  # displacement of the spring on the fine grid [m]
    cycle: FloatArray  # cycles since the start of the experiment
    # Parts of the spring's force on the fine grid [N], and the signals that are sampled there [m], [N].
    elastic: FloatArray = field(init=False)
    hysteretic: FloatArray = field(init=False)
    measured: FloatArray = field(init=False)
    force: FloatArray = field(init=False)
    at: NDArray[np.intp] = field(init=False)  # samples on the fine grid
    samples: FloatArray = field(init=False)  # time [s], displacement [m] and force [N] as recorded, shape (3, K)

    @property
    def time(self) -> FloatArray:
        return self.step * np.arange(self.path.size)

    @property
    def velocity(self) -> FloatArray:
        """Velocity of the spring as a share of the largest [-]."""
        return np.gradient(self.path, self.step) / (2.0 * np.pi * self.experiment.frequency * self.amplitude)

    @property
    def amplitude(self) -> float:
        return amplitude_of(self.truth.spring)

    @property
    def elastic_scale(self) -> float:
        return elastic_force(self.truth.spring)


def strokes_of(path: FloatArray) -> NDArray[np.intp]:
    """Indices of the first sample, the reversals and the last sample; a dwell reverses where it ends."""
    moving = np.flatnonzero(np.diff(path))
    side = np.sign(np.diff(path)[moving])
    turns = moving[1:][side[1:] != side[:-1]]
    return np.concatenate([[0], turns, [path.size - 1]])


Action = Callable[[Run, float, Generator], None]


def nothing(_run: Run, _size: float, _generator: Generator) -> None:
    """The action of a fault where it does not act."""


@dataclass(frozen=True)
class Fault:
    """One fault of a rig."""

    small: float  # size that is barely worth correcting
    large: float  # what a bad rig does
    points_to: tuple[str, ...] = ()  # beginnings of words; a caution that points to it has one in its name or sentence
    # What it does to a run at that stage.
    motion: Action = nothing
    force: Action = nothing
    signals: Action = nothing
    sampled: Action = nothing
    # The springs that are right, any of which will do; what the experiment must be; what a user would give as options.
    truths: Callable[[SpringParameters, Experiment, float], tuple[Truth, ...]] = lambda spring, *_: (Truth(spring),)
    programme: Callable[[Experiment, float], Experiment] = lambda experiment, _: experiment
    options: Callable[[SpringParameters, Experiment, float], dict[str, float]] = lambda *_: {}

    def magnitude(self, size: Size, generator: Generator) -> float:
        """The size; a drawn one may lie somewhat beyond either of them."""
        if size == "drawn":
            low, high = sorted((self.small, self.large))
            return log_uniform(generator, low / 1.5, high * 1.2)
        return self.small if size == "small" else self.large


NO_FAULT = Fault(0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Case:
    """Records of a spring on a rig with at most one fault, and the truth."""

    records: tuple[Record, ...]
    truths: tuple[Truth, ...]  # springs that are right, the first one in the coordinates of the first record
    experiment: Experiment
    magnitude: float  # size of the fault in the fault's unit
    options: dict[str, float]  # what a user would give
    deviation: float  # of the spring's force at the samples [N]

    @property
    def spring(self) -> SpringParameters:
        return self.truths[0].spring


def simulate(
    spring: SpringParameters | Truth,
    experiment: Experiment,
    generator: Generator,
    fault: Fault = NO_FAULT,
    size: Size = "small",
) -> Case:
    """The records that a rig with this fault gives of a spring, or of a mount that the fault leaves as it is."""
    magnitude = fault.magnitude(size, generator)
    experiment = fault.programme(experiment, magnitude)
    mount, p = (spring, spring.spring) if isinstance(spring, Truth) else (None, spring)
    truths = fault.truths(p, experiment, magnitude) if mount is None else (mount,)
    quarter = max(2, round(experiment.samples / (4 * sum(experiment.cycles))))  # samples
    stride = -(-800 // quarter)
    fine = 4 * quarter * stride
    stride += not experiment.synchronous
    pairs = tuple(zip(experiment.amplitudes, experiment.cycles, strict=True))
    runs: list[Run] = []
    clean, begun = [], 0
    for index, segments in enumerate([(pair,) for pair in pairs] if experiment.separate else [pairs]):
        path, cycle = _programme(experiment.shape, segments, fine)
        run = Run(
            replace(truths[0], shift=0.0), experiment, index, experiment.period / fine, stride,
            p.displacement_offset + amplitude_of(p) * path, begun + cycle,
        )  # fmt: skip
        begun += sum(cycles for _, cycles in segments)
        run.measured = run.path
        fault.motion(run, magnitude, generator)
        run.elastic, run.hysteretic = run.truth.parts(run.path)
        fault.force(run, magnitude, generator)
        run.force = run.elastic + run.hysteretic
        fault.signals(run, magnitude, generator)
        run.at = np.arange(0 if experiment.synchronous else int(generator.integers(stride)), run.path.size, stride)
        runs.append(run)
        clean.append(run.truth.response(run.path)[run.at])
    scale = float(np.std(np.concatenate([run.force[run.at] for run in runs])))
    for run in runs:
        noise = scale * experiment.noise * generator.standard_normal(run.at.size)
        run.samples = np.stack([run.time[run.at], run.measured[run.at], run.force[run.at] + noise])
        fault.sampled(run, magnitude, generator)
    records = [Record(run.samples[1], run.samples[2], run.samples[0], f"rig_{run.index + 1}.csv") for run in runs]
    options, deviation = fault.options(p, experiment, magnitude), float(np.std(np.concatenate(clean)))
    return Case(tuple(records), truths, experiment, magnitude, options, deviation)


def _programme(shape: str, segments: tuple[tuple[float, int], ...], fine: int) -> tuple[FloatArray, FloatArray]:
    """Displacement over the largest amplitude, and the number of the cycle, on the fine grid of one record."""
    phase = np.arange(fine) / fine
    wave = np.interp(phase, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])
    if shape == "sine":
        wave = np.sin(2.0 * np.pi * phase)
    path = np.concatenate([*(amplitude * np.tile(wave, cycles) for amplitude, cycles in segments), [0.0]])
    return path, np.arange(path.size) / fine


OfRecord = Callable[[int, float], Fault]  # of the record's number and frequency [Hz]


def drawn_case(fault: Fault, seed: int, index: int, **fixed: Any) -> Case:
    """Records of a drawn spring and experiment with such a fault, of its large size, 400 samples in a cycle."""
    generator = np.random.default_rng([seed, index])
    spring, experiment = draw_spring(generator), draw_experiment(generator, **fixed)
    experiment = fault.programme(experiment, fault.large)
    experiment = replace(experiment, samples=400 * sum(experiment.cycles))
    return simulate(spring, experiment, generator, replace(fault, programme=lambda given, _: given), "large")


def at_frequencies(
    generator: Generator, frequencies: Sequence[float], fault: OfRecord, shape: Literal["sine", "triangle"] = "sine"
) -> tuple[SpringParameters, tuple[Record, ...]]:
    """A drawn spring and a record of it with three amplitudes at each frequency [Hz]."""
    spring = draw_spring(generator)
    records = []
    for k, frequency in enumerate(frequencies):
        experiment = Experiment(shape, frequency=frequency, samples=2700)
        case = simulate(spring, experiment, generator, fault(k, frequency), "large")
        records += [replace(record, path=f"record_{k + 1}.csv") for record in case.records]
    return spring, tuple(records)


# -- whether a spring is right

SAMPLES = 2000  # a cycle, of the paths that are judged
WRONG_ENERGY, WRONG_FORCE = 0.10, 0.05  # of loops at 30 % of the amplitude; of the deviation on minor loops


@dataclass(frozen=True)
class Judgement:
    """Errors of an identified spring against the truth.

    Attributes
    ----------
    energy : float   Relative error of the energy of the steady loop at 30 % of the amplitude, with its sign.
    force : float    rms error on minor loops, means removed, as a share of the force's standard deviation.
    """

    energy: float
    force: float

    @property
    def excess(self) -> float:
        """The larger error in units of what is allowed."""
        return max(abs(self.energy) / WRONG_ENERGY, self.force / WRONG_FORCE)

    @property
    def wrong(self) -> bool:
        return not self.excess <= 1.0


def judge_case(case: Case, identified: Spring) -> Judgement:
    """The judgement by that of the right springs which comes closest, at the rate of the records.

    Loops lie about the centre of the programme, and offsets of the force are left aside.
    """
    phase = 2.0 * np.pi * np.arange(10 * SAMPLES + 1) / SAMPLES
    small, last, nested = 0.3 * np.sin(phase), slice(-SAMPLES - 1, None), np.linspace(0.0, 6.0 * np.pi, 3 * SAMPLES + 1)
    # A full cycle that sets the memory, and nested minor loops.
    minor = np.concatenate([0.9 * np.sin(nested[:SAMPLES]), 0.55 * np.sin(nested) + 0.35 * np.sin(4.6 * nested)])
    timed, judgements = bool(identified.parameters.branches), []
    for truth in case.truths:
        energies, forces = [], []
        for y, found in ((small, energies), (minor, forces)):
            path = case.spring.displacement_offset + truth.shift + amplitude_of(case.spring) * y
            times = np.arange(y.size) * case.experiment.period / SAMPLES
            own = truth.response(path), identified.response(path, time=times if timed else None)
            found += [float(np.trapezoid(f[last], path[last])) if y is small else f[SAMPLES:] for f in own]
        error = float(np.std(forces[1] - forces[0]) / np.std(forces[0]))
        judgements.append(Judgement(energies[1] / energies[0] - 1.0, error))
    return min(judgements, key=lambda judgement: judgement.excess)
