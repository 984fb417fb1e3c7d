"""A simulated test rig: drawn springs, their experiments, faults of real rigs, and a judgement of what was identified.

A run is simulated on a fine grid of time that holds every reversal, so that the forces are exact, and is sampled at the
end. A fault acts at one stage of it: on the programme, on the motion, on the spring's force, on the measured signals of
the fine grid, or on the samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal, Protocol

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray
from scipy.integrate import trapezoid
from scipy.signal import lfilter

from strandspring import Record, Spring, SpringParameters

FloatArray = NDArray[np.float64]
Generator = np.random.Generator
Size = Literal["small", "large", "drawn"]

WRONG_ENERGY = 0.10  # of loops at 30 % of the amplitude
WRONG_FORCE = 0.05  # share of the force's standard deviation on minor loops
SMALL_LOOP = 0.3
# A caution about the misfit as such points to shapes that no polynomial follows, and to no other fault.
MISFIT = ("misfit", "residual", "poorly", "lack of fit", "shape", "polynomial")
# Cautions that put the energy of small loops in doubt point to a wrong spring, whatever the fault; without a fault those
# do too that leave open which of several springs it is, or say that it does not fit.
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

    Parameters
    ----------
    generator : Generator
    n, sigma, saturations, friction : (float, float)   Ranges of n, sigma, rho*amplitude and kappa_omega as a share of the
                                             elastic force [-], drawn log-uniformly.
    degrees : (int, int) or None             Of FE and FA; None draws 1 to 4 and 0 to 2.
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
    return SpringParameters(
        kE=tuple(elastic * shape / amplitude ** np.arange(shape.size)),
        kA=tuple(amplifier / amplitude ** np.arange(amplifier.size)),
        kappa_omega=share * elastic,
        rho=log_uniform(generator, *saturations) / amplitude,
        sigma=log_uniform(generator, *sigma),
        n=log_uniform(generator, *n),
        displacement_offset=centre,
        displacement_min=centre - amplitude,
        displacement_max=centre + amplitude,
    )


def amplitude_of(spring: SpringParameters) -> float:
    return 0.5 * (spring.displacement_max - spring.displacement_min)


def elastic_force(spring: SpringParameters) -> float:
    """Half the range of FE [N], the size that faults of the force are measured in."""
    return 0.5 * float(np.ptp(polyval(np.array([spring.x_min, spring.x_max]), spring.kE)))


@dataclass(frozen=True)
class Truth:
    """What is the spring and not the rig.

    Parameters
    ----------
    spring : SpringParameters
    backbone : callable or None   Elastic force [N] of y = (x - centre)/amplitude in place of FE.
    stiffness : float             Of a spring in parallel, about the centre [N/m].
    shift : float                 Where the record's coordinates see the spring's zero [m].
    """

    spring: SpringParameters
    backbone: Callable[[FloatArray], FloatArray] | None = None
    stiffness: float = 0.0
    shift: float = 0.0

    def response(self, displacement: FloatArray) -> FloatArray:
        """Force along a path that starts with omega = 0 [N]."""
        return sum(self.parts(displacement - self.shift))

    def parts(self, path: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elastic and hysteretic force along a path in the spring's own coordinates [N]."""
        p = self.spring
        x = path - p.displacement_offset
        FE = Spring(replace(p, kappa_omega=1e-300)).response(path)
        elastic = FE if self.backbone is None else self.backbone(x / amplitude_of(p))
        return elastic + self.stiffness * x, Spring(p).response(path) - FE


@dataclass(frozen=True)
class Experiment:
    """Displacement programme, sampling and noise.

    Parameters
    ----------
    shape : "sine" or "triangle"
    amplitudes : tuple of float    Shares of the largest amplitude.
    cycles : tuple of int          Of each amplitude.
    separate : bool                One record for each amplitude instead of one of all.
    frequency : float              [Hz]
    samples : int                  Of all records together, about.
    noise : float                  Standard deviation of the force's noise, share of the force's.
    correlation : float            AR(1) coefficient of the noise.
    synchronous : bool             Every reversal is sampled; otherwise reversals fall between the samples.
    """

    shape: Literal["sine", "triangle"] = "sine"
    amplitudes: tuple[float, ...] = (0.4, 0.7, 1.0)
    cycles: tuple[int, ...] = (3, 3, 3)
    separate: bool = False
    frequency: float = 0.5
    samples: int = 1000
    noise: float = 0.005
    correlation: float = 0.0
    synchronous: bool = True

    @property
    def period(self) -> float:
        return 1.0 / self.frequency

    @property
    def segments(self) -> tuple[tuple[tuple[float, int], ...], ...]:
        """(amplitude, cycles) of the parts of each record."""
        pairs = tuple(zip(self.amplitudes, self.cycles, strict=True))
        return tuple((pair,) for pair in pairs) if self.separate else (pairs,)


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
    """One record while it is simulated; the faults change it in place.

    Attributes
    ----------
    truth : Truth
    experiment : Experiment
    index : int                    Of the record among those of the experiment.
    clock, duration : float        When the record starts within the experiment, and how long all records are [s].
    step : float                   Of the fine grid [s].
    stride : int                   Fine steps from sample to sample.
    path : ndarray, shape (F,)     Displacement of the spring on the fine grid [m].
    cycle : ndarray, shape (F,)    Cycles since the start of the experiment.
    elastic, hysteretic : ndarray  Parts of the spring's force on the fine grid [N].
    measured, force : ndarray      Signals that are sampled, on the fine grid [m], [N].
    at : ndarray, shape (K,)       Samples on the fine grid.
    samples : ndarray, (3, K)      Time [s], displacement [m] and force [N] as recorded.
    """

    truth: Truth
    experiment: Experiment
    index: int
    clock: float
    duration: float
    step: float
    stride: int
    path: FloatArray
    cycle: FloatArray
    elastic: FloatArray = field(default_factory=lambda: np.empty(0))
    hysteretic: FloatArray = field(default_factory=lambda: np.empty(0))
    measured: FloatArray = field(default_factory=lambda: np.empty(0))
    force: FloatArray = field(default_factory=lambda: np.empty(0))
    at: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    samples: FloatArray = field(default_factory=lambda: np.empty((3, 0)))

    @property
    def time(self) -> FloatArray:
        return self.step * np.arange(self.path.size)

    @property
    def elapsed(self) -> FloatArray:
        """Time since the start of the experiment as a share of its duration."""
        return (self.clock + self.time) / self.duration

    @property
    def velocity(self) -> FloatArray:
        """Velocity of the spring as a share of the largest [-]."""
        velocity = np.gradient(self.path, self.step)
        return velocity / (2.0 * np.pi * self.experiment.frequency * self.amplitude)

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


@dataclass(frozen=True)
class Fault:
    """One fault of a rig.

    Parameters
    ----------
    small, large : float     Sizes: barely worth correcting, and what a bad rig does; in the unit of `size`.
    size : str               What the size is measured in.
    points_to : tuple of str Beginnings of words in lower case; a caution that points to it has one of them in its name
                             or sentence.
    motion, force, signals, sampled : callable   What it does to a run at that stage.
    truths : callable        The springs that are right; any of them will do, the spring itself by default.
    programme : callable     What the experiment must be.
    options : callable       What a user would know and give as options.
    """

    small: float
    large: float
    size: str
    points_to: tuple[str, ...]
    motion: Action | None = None
    force: Action | None = None
    signals: Action | None = None
    sampled: Action | None = None
    truths: Callable[[SpringParameters, Experiment, float], tuple[Truth, ...]] = lambda spring, *_: (Truth(spring),)
    programme: Callable[[Experiment, float], Experiment] = lambda experiment, _: experiment
    options: Callable[[SpringParameters, Experiment, float], dict[str, float]] = lambda *_: {}

    def magnitude(self, size: Size, generator: Generator) -> float:
        """The size; a drawn one may lie somewhat beyond either of them."""
        if size == "drawn":
            low, high = sorted((self.small, self.large))
            return log_uniform(generator, low / 1.5, high * 1.2)
        return self.small if size == "small" else self.large


@dataclass(frozen=True, eq=False)
class Case:
    """Records of a spring on a rig with at most one fault, and the truth.

    Attributes
    ----------
    records : tuple of Record
    truths : tuple of Truth           Springs that are right, the first one in the coordinates of the first record.
    experiment : Experiment
    magnitude : float                 Size of the fault in the fault's unit.
    options : dict                    What a user would give.
    points_to : tuple of str
    paths, forces : tuple of ndarray  Noise-free displacement of the spring and its response at the samples, without
                                      duplicates and before samples are lost [m], [N].
    """

    records: tuple[Record, ...]
    truths: tuple[Truth, ...]
    experiment: Experiment
    magnitude: float
    options: dict[str, float]
    points_to: tuple[str, ...]
    paths: tuple[FloatArray, ...]
    forces: tuple[FloatArray, ...]

    @property
    def spring(self) -> SpringParameters:
        return self.truths[0].spring

    @property
    def centre(self) -> float:
        return self.spring.displacement_offset

    @property
    def amplitude(self) -> float:
        return amplitude_of(self.spring)


_NO_FAULT = Fault(0.0, 0.0, "", UNDECIDED)


def simulate(
    spring: SpringParameters,
    experiment: Experiment,
    generator: Generator,
    fault: Fault = _NO_FAULT,
    size: Size = "small",
) -> Case:
    """The records that a rig with this fault gives."""
    magnitude = fault.magnitude(size, generator)
    experiment = fault.programme(experiment, magnitude)
    truths = fault.truths(spring, experiment, magnitude)
    quarter = max(2, round(experiment.samples / (4 * sum(experiment.cycles))))  # samples
    stride = -(-800 // quarter)
    fine = 4 * quarter * stride
    if not experiment.synchronous:
        stride += 1
    runs: list[Run] = []
    duration = sum(experiment.cycles) * experiment.period
    begun = 0
    for index, segments in enumerate(experiment.segments):
        path, cycle = _programme(experiment, segments, fine)
        run = Run(
            truths[0] if truths[0].shift == 0.0 else replace(truths[0], shift=0.0),
            experiment, index, begun * experiment.period, duration, experiment.period / fine, stride,
            spring.displacement_offset + amplitude_of(spring) * path, begun + cycle,
        )  # fmt: skip
        begun += sum(cycles for _, cycles in segments)
        run.measured = run.path
        _act(fault.motion, run, magnitude, generator)
        run.elastic, run.hysteretic = run.truth.parts(run.path)
        _act(fault.force, run, magnitude, generator)
        run.force = run.elastic + run.hysteretic
        _act(fault.signals, run, magnitude, generator)
        first = 0 if experiment.synchronous else int(generator.integers(stride))
        run.at = np.arange(first, run.path.size, stride)
        runs.append(run)
    scale = float(np.std(np.concatenate([run.force[run.at] for run in runs])))
    for run in runs:
        noise = scale * experiment.noise * coloured(generator, run.at.size, experiment.correlation)
        run.samples = np.stack([run.time[run.at], run.measured[run.at], run.force[run.at] + noise])
        _act(fault.sampled, run, magnitude, generator)
    return Case(
        tuple(Record(run.samples[1], run.samples[2], run.samples[0], f"rig_{run.index + 1}.csv") for run in runs),
        truths,
        experiment,
        magnitude,
        fault.options(spring, experiment, magnitude),
        fault.points_to,
        tuple(run.path[run.at] for run in runs),
        tuple(Spring(spring).response(run.path)[run.at] for run in runs),
    )


def _act(action: Action | None, run: Run, magnitude: float, generator: Generator) -> None:
    if action is not None:
        action(run, magnitude, generator)


def _programme(
    experiment: Experiment, segments: tuple[tuple[float, int], ...], fine: int
) -> tuple[FloatArray, FloatArray]:
    """Displacement over the largest amplitude, and the number of the cycle, on the fine grid of one record."""
    quarter = fine // 4
    if experiment.shape == "sine":
        wave = np.sin(2.0 * np.pi * np.arange(fine) / fine)
    else:
        wave = np.interp(np.arange(fine), np.array([0, 1, 3, 4]) * quarter, [0.0, 1.0, -1.0, 0.0])
    path = np.concatenate([*(amplitude * np.tile(wave, cycles) for amplitude, cycles in segments), [0.0]])
    return path, np.arange(path.size) / fine


def coloured(generator: Generator, count: int, correlation: float) -> FloatArray:
    """Stationary AR(1) noise of unit standard deviation."""
    white = generator.standard_normal(count)
    if correlation == 0.0:
        return white
    white[0] /= np.sqrt(1.0 - correlation**2)
    return np.asarray(np.sqrt(1.0 - correlation**2) * lfilter([1.0], [1.0, -correlation], white))


# Judgement


class Responds(Protocol):
    def response(self, displacement: FloatArray) -> FloatArray: ...


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
    def wrong(self) -> bool:
        return not (abs(self.energy) <= WRONG_ENERGY and self.force <= WRONG_FORCE)

    @property
    def excess(self) -> float:
        """The larger error in units of what is allowed."""
        return max(abs(self.energy) / WRONG_ENERGY, self.force / WRONG_FORCE)


def judge(truth: Responds, identified: Responds, amplitude: float, centre: float) -> Judgement:
    """Compare a spring with the truth about the centre of the programme, offsets of the force left aside."""
    cycles, points = 10, 2000
    small = centre + SMALL_LOOP * amplitude * np.sin(2.0 * np.pi * np.arange(cycles * points + 1) / points)
    last = slice(-points - 1, None)
    energies = [float(trapezoid(s.response(small)[last], small[last])) for s in (truth, identified)]
    minor, judged = minor_loops(amplitude, centre)
    forces = [s.response(minor)[judged] for s in (truth, identified)]
    error = float(np.std(forces[1] - forces[0]) / np.std(forces[0]))
    return Judgement(energies[1] / energies[0] - 1.0, error)


def minor_loops(amplitude: float, centre: float) -> tuple[FloatArray, slice]:
    """A path with a full cycle that sets the memory and nested minor loops, and which part of it these are."""
    phase = np.linspace(0.0, 6.0 * np.pi, 6001)
    full = 0.9 * np.sin(phase[:2000])
    nested = 0.55 * np.sin(phase) + 0.35 * np.sin(4.6 * phase)
    return centre + amplitude * np.concatenate([full, nested]), slice(full.size, None)


def judge_case(case: Case, identified: Responds) -> Judgement:
    """The judgement by that of the right springs which comes closest."""
    return min(
        (judge(truth, identified, case.amplitude, case.centre + truth.shift) for truth in case.truths),
        key=lambda judgement: judgement.excess,
    )


# Faults


def _delayed(sign: float) -> Action:
    def act(run: Run, share: float, _: Generator) -> None:
        run.force = np.interp(run.time - sign * share * run.experiment.period, run.time, run.force)

    return act


def _low_pass(run: Run, share: float, _: Generator) -> None:
    keep = np.exp(-run.step / (share * run.experiment.period))
    run.force, _state = lfilter([1.0 - keep], [1.0, -keep], run.force, zi=[keep * run.force[0]])


def _viscous(run: Run, share: float, _: Generator) -> None:
    run.force = run.force + share * run.truth.spring.kappa_omega * run.velocity


_SHIFTS = (0.0, 1.0, -0.7, 0.5)


def _displacement_zero(run: Run, share: float, _: Generator) -> None:
    run.measured = run.measured + share * run.amplitude * _SHIFTS[run.index]


def _displacement_zeros(spring: SpringParameters, experiment: Experiment, share: float) -> tuple[Truth, ...]:
    """The spring in the coordinates of each record and in those of their mean."""
    shifts = share * amplitude_of(spring) * np.array(_SHIFTS[: len(experiment.amplitudes)])
    return tuple(Truth(spring, shift=float(shift)) for shift in (*shifts, shifts.mean()))


def _force_zero(run: Run, share: float, _: Generator) -> None:
    run.force = run.force + share * run.elastic_scale * _SHIFTS[run.index]


def _linear_drift(run: Run, share: float, _: Generator) -> None:
    run.force = run.force + share * run.elastic_scale * run.elapsed


def _warm_up(run: Run, share: float, _: Generator) -> None:
    run.force = run.force - share * run.elastic_scale * np.exp(-run.elapsed / 0.25)


def _total_cycles(run: Run) -> int:
    return sum(run.experiment.cycles)


def _friction_wear(run: Run, share: float, _: Generator) -> None:
    run.hysteretic = run.hysteretic * (1.0 - share * run.cycle / _total_cycles(run))


def _worn_friction(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
    """The spring at the beginning, in the mean and at the end."""
    return tuple(
        Truth(replace(spring, kappa_omega=spring.kappa_omega * (1.0 - share * part))) for part in (0.0, 0.5, 1.0)
    )


def _stiffness_wear(run: Run, share: float, _: Generator) -> None:
    at_rest = run.truth.spring.kE[0]
    run.elastic = at_rest + (run.elastic - at_rest) * (1.0 - share * run.cycle / _total_cycles(run))


def _worn_stiffness(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
    left = [1.0 - share * part for part in (0.0, 0.5, 1.0)]
    return tuple(Truth(replace(spring, kE=(spring.kE[0], *(rest * k for k in spring.kE[1:])))) for rest in left)


def _displacement_noise(run: Run, share: float, generator: Generator) -> None:
    run.samples[1] += share * run.amplitude * generator.standard_normal(run.at.size)


def _clipped(run: Run, share: float, generator: Generator) -> None:
    """The range of the largest record ends below its largest force, or at both ends."""
    low, high = _force_range(run)
    reach = high - low
    both = generator.random() < 0.5
    run.samples[2] = run.samples[2].clip(low + share * reach if both else -np.inf, high - share * reach)


def _force_range(run: Run) -> tuple[float, float]:
    """Range of the force on the whole range of displacement [N]."""
    p = run.truth.spring
    ends = np.array([p.displacement_offset, p.displacement_min, p.displacement_max])
    force = run.truth.response(np.concatenate([ends, ends[1:]]))
    return float(force.min()), float(force.max())


def _force_steps(run: Run, share: float, _: Generator) -> None:
    low, high = _force_range(run)
    step = share * (high - low)
    run.samples[2] = step * np.round(run.samples[2] / step)


def _displacement_steps(run: Run, share: float, _: Generator) -> None:
    step = share * run.amplitude
    run.samples[1] = step * np.round(run.samples[1] / step)


def _play(run: Run, share: float, _: Generator) -> None:
    """The spring follows the measured motion by a play operator."""
    half = 0.5 * share * run.amplitude
    turns = strokes_of(run.measured)
    follows = np.empty_like(run.measured)
    at = float(run.measured[0])
    for begin, end in pairwise(turns):
        piece = run.measured[begin : end + 1]
        follows[begin : end + 1] = (
            np.maximum(at, piece - half) if piece[-1] > piece[0] else np.minimum(at, piece + half)
        )
        at = float(follows[end])
    run.path = follows


def _dwell(run: Run, share: float, _: Generator) -> None:
    """A pause of a tenth of the period or more at each reversal."""
    turns = strokes_of(run.path)[1:-1]
    pause = round((0.1 + share) * run.experiment.period / run.step)
    repeats = np.ones(run.path.size, dtype=int)
    repeats[turns] += pause
    run.path = np.repeat(run.path, repeats)
    run.measured = run.path
    run.cycle = np.repeat(run.cycle, repeats)


def _relaxation(run: Run, share: float, _: Generator) -> None:
    """The hysteretic force relaxes while the spring rests and comes back over a twentieth of the amplitude."""
    moves = np.abs(np.diff(run.path, prepend=run.path[0]))
    rests = np.flatnonzero(moves == 0.0)
    rests = rests[rests > 0]
    starts = rests[np.diff(rests, prepend=-2) > 1]
    lost = np.zeros(run.path.size)
    for start, stop in zip(starts, [*starts[1:], run.path.size], strict=True):
        still = slice(start, start + int(np.argmax(moves[start:stop] > 0.0)))
        lost[still] = share * -np.expm1(-run.step * np.arange(still.stop - start) / (0.1 * run.experiment.period))
        way = np.cumsum(moves[still.stop : stop])
        lost[still.stop : stop] = lost[still.stop - 1] * np.exp(-way / (0.05 * run.amplitude))
        lost[start:stop] *= run.hysteretic[start - 1]
    run.hysteretic = run.hysteretic - lost


def _lose(run: Run, lost: list[tuple[int, int]]) -> None:
    keep = np.ones(run.samples.shape[1], dtype=bool)
    for begin, end in lost:
        keep[max(begin, 0) : end] = False
    run.samples = run.samples[:, keep]


def _gaps(run: Run, share: float, generator: Generator) -> None:
    """Three times in each record samples are lost in the middle of a stroke."""
    count = max(2, round(share * run.experiment.period / (run.step * run.stride)))
    turns = strokes_of(run.path)
    chosen = generator.choice(np.arange(1, turns.size - 2), size=min(3, turns.size - 3), replace=False)
    middles = 0.5 * (turns[chosen] + turns[chosen + 1]) / run.stride
    _lose(run, [(round(m - count / 2), round(m + count / 2)) for m in middles])


def _lost_reversals(run: Run, share: float, generator: Generator) -> None:
    """Two reversals of each record are lost."""
    half = max(1, round(0.5 * share * run.experiment.period / (run.step * run.stride)))
    turns = strokes_of(run.path)[1:-1]
    chosen = generator.choice(turns, size=min(2, turns.size), replace=False) // run.stride
    _lose(run, [(int(k) - half, int(k) + half + 1) for k in chosen])


def _duplicates(run: Run, share: float, generator: Generator) -> None:
    count = run.samples.shape[1]
    again = generator.random(count) < share
    run.samples = np.repeat(run.samples, 1 + again, axis=1)


def _inertia(run: Run, share: float, _: Generator) -> None:
    """Of a sine only: the acceleration is -(2 pi f)^2 times the displacement."""
    x = run.path - run.truth.spring.displacement_offset
    run.force = run.force - share * run.elastic_scale * x / run.amplitude


def _moving_mass(spring: SpringParameters, experiment: Experiment, share: float) -> dict[str, float]:
    """[kg]"""
    stiffness = share * elastic_force(spring) / amplitude_of(spring)
    return {"moving_mass": stiffness / (2.0 * np.pi * experiment.frequency) ** 2}


def _compliance(run: Run, share: float, _: Generator) -> None:
    run.measured = run.path + run.force * share * run.amplitude / run.elastic_scale


def _fixture_stiffness(spring: SpringParameters, _: Experiment, share: float) -> dict[str, float]:
    """[N/m]"""
    return {"fixture_stiffness": elastic_force(spring) / (share * amplitude_of(spring))}


def _complied(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
    """The fixture's deflection under the preload only moves the zero; it is measured, and goes into the coordinates."""
    middle = 0.5 * sum(polyval(np.array([spring.x_min, spring.x_max]), spring.kE))
    shifts = (0.0, spring.kE[0], middle)
    return tuple(Truth(spring, shift=force * share * amplitude_of(spring) / elastic_force(spring)) for force in shifts)


Shape = Callable[[FloatArray, float], FloatArray]


def _added(shape: Shape) -> Callable[[SpringParameters, Experiment, float], tuple[Truth, ...]]:
    """A shape of y, times half the range of FE, on top of FE."""

    def truths(spring: SpringParameters, _: Experiment, size: float) -> tuple[Truth, ...]:
        scale, amplitude = elastic_force(spring), amplitude_of(spring)
        return (Truth(spring, lambda y: polyval(amplitude * y, spring.kE) + scale * shape(y, size)),)

    return truths


def _tanh(spring: SpringParameters, _: Experiment, size: float) -> tuple[Truth, ...]:
    scale = elastic_force(spring)
    return (Truth(spring, lambda y: spring.kE[0] + scale * np.tanh(size * y) / np.tanh(size)),)


def _single(experiment: Experiment, cycles: float) -> Experiment:
    return replace(experiment, amplitudes=(1.0,), cycles=(round(cycles),), separate=False)


def _hum(run: Run, share: float, generator: Generator) -> None:
    phase = generator.uniform(0.0, 2.0 * np.pi)
    scale = share * np.sqrt(2.0) * float(np.std(run.force))
    run.force = run.force + scale * np.sin(2.0 * np.pi * 50.0 * run.time + phase)


def _maxwell(run: Run, share: float, _: Generator) -> None:
    keep = np.exp(-run.step / _relaxation_time(run.experiment))
    moved = np.diff(run.path, prepend=run.path[0])
    run.force = run.force + share * run.elastic_scale / run.amplitude * lfilter([keep], [1.0, -keep], moved)


def _relaxation_time(experiment: Experiment) -> float:
    return 0.3 * experiment.period


def _stored(spring: SpringParameters, experiment: Experiment, share: float) -> tuple[Truth, ...]:
    """Without the Maxwell element, or with its storage stiffness at the test's frequency, which FE cannot but hold."""
    turned = (2.0 * np.pi * experiment.frequency * _relaxation_time(experiment)) ** 2
    stiffness = share * elastic_force(spring) / amplitude_of(spring) * turned / (1.0 + turned)
    return Truth(spring), Truth(spring, stiffness=stiffness)


def _first_cycle(run: Run, share: float, _: Generator) -> None:
    """The first cycle of each amplitude is stiffer (Mullins)."""
    begins = np.cumsum([0, *run.experiment.cycles])
    first = np.isin(np.floor(run.cycle), begins)
    at_rest = run.truth.spring.kE[0]
    run.elastic = at_rest + (run.elastic - at_rest) * np.where(first, 1.0 + share, 1.0)


def _outliers(run: Run, count: float, generator: Generator) -> None:
    where = generator.choice(run.at.size, size=min(round(count), run.at.size // 20), replace=False)
    jumps = generator.uniform(0.5, 3.0, where.size) * generator.choice([-1.0, 1.0], where.size)
    run.samples[2, where] += jumps * float(np.std(run.force))


def _jitter(run: Run, share: float, generator: Generator) -> None:
    """Each column is sampled at moments of its own about those recorded."""
    interval = run.step * run.stride
    noise = run.samples[2] - run.force[run.at]
    for row, signal in ((1, run.measured), (2, run.force)):
        moments = run.samples[0] + share * interval * generator.standard_normal(run.at.size)
        run.samples[row] = np.interp(moments, run.time, signal)
    run.samples[2] += noise


def _cubic_load_cell(run: Run, share: float, _: Generator) -> None:
    largest = max(map(abs, _force_range(run)))
    run.force = run.force * (1.0 + share * (run.force / largest) ** 2)


def _stribeck(run: Run, share: float, _: Generator) -> None:
    run.hysteretic = run.hysteretic * (1.0 + share * np.exp(-np.abs(run.velocity) / 0.3))


def _slower_friction(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
    """Friction of high, middle and low velocity."""
    return tuple(
        Truth(replace(spring, kappa_omega=spring.kappa_omega * (1.0 + share * part))) for part in (0.0, 0.5, 1.0)
    )


def _separate(experiment: Experiment, _: float) -> Experiment:
    """Several records, at least three."""
    if len(experiment.amplitudes) < 3:
        experiment = replace(experiment, amplitudes=(0.4, 0.7, 1.0), cycles=(3, 3, 3))
    return replace(experiment, separate=True)


def _asynchronous(experiment: Experiment, samples: float) -> Experiment:
    return replace(experiment, synchronous=False, samples=round(samples))


def _sine(experiment: Experiment, _: float) -> Experiment:
    return replace(experiment, shape="sine")


_PERIOD, _AMPLITUDE = "of the period", "of the amplitude"
_ELASTIC, _FRICTION = "of the elastic force", "of kappa_omega"
_SYNCHRONY = ("delay", "lag", "synchron", "rate", "velocity", "viscous")

FAULTS: dict[str, Fault] = {
    "force lags": Fault(0.0005, 0.01, _PERIOD, _SYNCHRONY, signals=_delayed(1.0)),
    "force leads": Fault(0.0005, 0.01, _PERIOD, _SYNCHRONY, signals=_delayed(-1.0)),
    "low-pass on the force": Fault(0.0005, 0.01, _PERIOD, (*_SYNCHRONY, "filter"), signals=_low_pass),
    "viscous damper": Fault(0.05, 1.0, _FRICTION, _SYNCHRONY, signals=_viscous),
    "Maxwell element": Fault(
        0.02, 0.4, _ELASTIC, (*_SYNCHRONY, "relax", "creep"), signals=_maxwell, truths=_stored
    ),
    "Stribeck friction": Fault(
        0.05, 0.6, _FRICTION, (*_SYNCHRONY, "stick"), force=_stribeck, truths=_slower_friction
    ),
    "displacement zero": Fault(
        0.003, 0.05, _AMPLITUDE, ("zero", "shift", "offset"), signals=_displacement_zero,
        truths=_displacement_zeros, programme=_separate,
    ),
    "force zero": Fault(
        0.005, 0.1, _ELASTIC, ("zero", "shift", "offset", "drift"), signals=_force_zero, programme=_separate
    ),
    "linear drift": Fault(0.01, 0.2, _ELASTIC, ("drift", "zero"), signals=_linear_drift),
    "warm-up": Fault(0.01, 0.2, _ELASTIC, ("drift", "zero"), signals=_warm_up),
    "wear of friction": Fault(
        0.05, 0.5, _FRICTION, ("wear", "cycle to cycle"), force=_friction_wear, truths=_worn_friction
    ),
    "wear of stiffness": Fault(
        0.01, 0.15, "of FE", ("wear", "cycle to cycle", "soften"), force=_stiffness_wear, truths=_worn_stiffness
    ),
    "first cycle": Fault(0.03, 0.4, "of FE", ("first cycle", "cycle to cycle"), force=_first_cycle),
    "displacement noise": Fault(
        0.0005, 0.005, _AMPLITUDE, ("noise of the displacement", "displacement noise", "displacement is noisy"),
        sampled=_displacement_noise,
    ),
    "displacement steps": Fault(
        0.001, 0.02, _AMPLITUDE, ("resolution", "quanti", "steps", "coarse", "displacement noise"),
        sampled=_displacement_steps,
    ),
    "force steps": Fault(
        0.003, 0.04, "of the force's range", ("resolution", "quanti", "steps", "coarse"), sampled=_force_steps
    ),
    "sampling jitter": Fault(
        0.05, 0.6, "of the sampling interval", ("jitter", "displacement noise", "irregular"),
        sampled=_jitter,
    ),
    "clipped force": Fault(0.01, 0.15, "of the force's range", ("clip", "extreme"), sampled=_clipped),
    "play": Fault(0.003, 0.05, _AMPLITUDE, ("play", "backlash"), motion=_play),
    "dwells": Fault(0.05, 0.5, "of hysteresis", ("dwell", "relax", "pause"), motion=_dwell, force=_relaxation),
    "gaps": Fault(0.03, 0.15, _PERIOD, ("gap", "lost", "missing"), sampled=_gaps),
    "lost reversals": Fault(0.02, 0.2, _PERIOD, ("gap", "lost", "missing"), sampled=_lost_reversals),
    "reversals between samples": Fault(2000.0, 500.0, "samples", ("reversal",), programme=_asynchronous),
    "duplicates": Fault(0.01, 0.2, "of the samples", ("duplicate", "repeated", "twice"), sampled=_duplicates),
    "single amplitude": Fault(
        4.0, 2.0, "cycles", ("amplitude", "extrapolat", "small loops"), programme=_single
    ),
    "moving mass": Fault(
        0.003, 0.1, _ELASTIC, ("mass", "inertia"), signals=_inertia, programme=_sine, options=_moving_mass
    ),
    "fixture compliance": Fault(
        0.005, 0.15, _AMPLITUDE, ("fixture", "complian"), signals=_compliance, truths=_complied,
        options=_fixture_stiffness,
    ),
    "kink": Fault(
        0.15, 1.5, "of the slope", (*MISFIT, "kink"), truths=_added(lambda y, size: size * np.maximum(y - 0.1, 0.0))
    ),
    "tanh": Fault(1.5, 5.0, "y in tanh", MISFIT, truths=_tanh),
    "bump stop": Fault(
        0.1, 2.0, _ELASTIC, (*MISFIT, "bump stop", "end stop"),
        truths=_added(lambda y, size: size * (np.maximum(y - 0.75, 0.0) / 0.25) ** 1.5),
    ),
    "closing coils": Fault(
        0.1, 1.5, _ELASTIC, MISFIT, truths=_added(lambda y, size: size * np.exp((y - 1.0) / 0.12))
    ),
    "cubic load cell": Fault(0.002, 0.03, "of the force", (*MISFIT, "linearity"), signals=_cubic_load_cell),
    "mains hum": Fault(0.005, 0.05, "of the force's deviation", ("hum", "mains", "periodic", "noise"), signals=_hum),
    "outliers": Fault(1.0, 8.0, "outliers", ("outlier", "spike"), sampled=_outliers),
}  # fmt: skip
