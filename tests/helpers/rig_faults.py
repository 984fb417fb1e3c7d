"""The faults of real rigs: one table `FAULTS`, and what each one does to a run of the simulated rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyval

from rig import Action, Experiment, Fault, FloatArray, Generator, Run, Truth, amplitude_of, elastic_force, strokes_of
from strandspring import SpringParameters

# A caution about the misfit as such points to shapes that no polynomial follows, and to no other fault.
MISFIT = ("misfit", "residual", "poorly", "lack of fit", "shape", "polynomial")
SHIFTS = (0.0, 1.0, -0.7, 0.5)  # of the zeros of records
Truths = Callable[[SpringParameters, Experiment, float], tuple[Truth, ...]]


def changed(name: str, to: Callable[[Run, float], Any]) -> Action:
    """Replace an array of the run."""

    def act(run: Run, share: float, _: Generator) -> None:
        setattr(run, name, to(run, share))

    return act


def added(name: str, by: Callable[[Run, float], Any]) -> Action:
    return changed(name, lambda run, share: getattr(run, name) + by(run, share))


# -- of the force


def _delayed(sign: float) -> Action:
    def force(run: Run, share: float) -> FloatArray:
        return np.interp(run.time - sign * share * run.experiment.period, run.time, run.force)

    return changed("force", force)


def _low_passed(run: Run, share: float) -> FloatArray:
    from scipy.signal import lfilter

    keep = np.exp(-run.step / (share * run.experiment.period))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], run.force, zi=[keep * run.force[0]])[0])


def _maxwell(run: Run, share: float) -> FloatArray:
    from scipy.signal import lfilter

    keep = np.exp(-run.step / (0.3 * run.experiment.period))
    moved = np.diff(run.path, prepend=run.path[0])
    return np.asarray(share * run.elastic_scale / run.amplitude * lfilter([keep], [1.0, -keep], moved))


def _stored(spring: SpringParameters, experiment: Experiment, share: float) -> tuple[Truth, ...]:
    """Without the Maxwell element, or with its storage stiffness at the test's frequency, which FE cannot but hold."""
    turned = (2.0 * np.pi * experiment.frequency * (0.3 * experiment.period)) ** 2
    stiffness = share * elastic_force(spring) / amplitude_of(spring) * turned / (1.0 + turned)
    return Truth(spring), Truth(spring, stiffness=stiffness)


def _force_range(run: Run) -> tuple[float, float]:
    """Range of the force on the whole range of displacement [N]."""
    p = run.truth.spring
    ends = np.array([p.displacement_offset, p.displacement_min, p.displacement_max])
    force = run.truth.response(np.concatenate([ends, ends[1:]]))
    return float(force.min()), float(force.max())


def _cubic_load_cell(run: Run, share: float) -> FloatArray:
    largest = max(map(abs, _force_range(run)))
    return run.force * (1.0 + share * (run.force / largest) ** 2)


def _clipped(run: Run, share: float, generator: Generator) -> None:
    """The range of the largest record ends below its largest force, or at both ends."""
    low, high = _force_range(run)
    reach = high - low
    both = generator.random() < 0.5
    run.samples[2] = run.samples[2].clip(low + share * reach if both else -np.inf, high - share * reach)


def _force_steps(run: Run, share: float, _: Generator) -> None:
    low, high = _force_range(run)
    step = share * (high - low)
    run.samples[2] = step * np.round(run.samples[2] / step)


def _hum(run: Run, share: float, generator: Generator) -> None:
    phase = generator.uniform(0.0, 2.0 * np.pi)
    scale = share * np.sqrt(2.0) * float(np.std(run.force))
    run.force = run.force + scale * np.sin(2.0 * np.pi * 50.0 * run.time + phase)


def _outliers(run: Run, count: float, generator: Generator) -> None:
    where = generator.choice(run.at.size, size=min(round(count), run.at.size // 20), replace=False)
    jumps = generator.uniform(0.5, 3.0, where.size) * generator.choice([-1.0, 1.0], where.size)
    run.samples[2, where] += jumps * float(np.std(run.force))


# -- of the spring


def _scaled(change: float) -> Truths:
    """The spring whose friction changed by nothing, half of the share, and all of it."""
    return lambda spring, _, share: tuple(
        Truth(replace(spring, kappa_omega=spring.kappa_omega * (1.0 + change * share * part)))
        for part in (0.0, 0.5, 1.0)
    )


def _softened(run: Run, left: Any) -> FloatArray:
    at_rest = run.truth.spring.kE[0]
    return np.asarray(at_rest + (run.elastic - at_rest) * left)


def _worn_stiffness(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
    left = [1.0 - share * part for part in (0.0, 0.5, 1.0)]
    return tuple(Truth(replace(spring, kE=(spring.kE[0], *(rest * k for k in spring.kE[1:])))) for rest in left)


def _worn(run: Run, share: float) -> FloatArray:
    return 1.0 - share * run.cycle / sum(run.experiment.cycles)


def _first_cycle(run: Run, share: float) -> FloatArray:
    """The first cycle of each amplitude is stiffer (Mullins)."""
    first = np.isin(np.floor(run.cycle), np.cumsum([0, *run.experiment.cycles]))
    return _softened(run, np.where(first, 1.0 + share, 1.0))


def _relaxed(run: Run, share: float) -> FloatArray:
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
    return run.hysteretic - lost


def _shaped(shape: Callable[[FloatArray, float], FloatArray]) -> Truths:
    """A shape of y, times half the range of FE, on top of FE."""

    def truths(spring: SpringParameters, _: Experiment, size: float) -> tuple[Truth, ...]:
        scale, amplitude = elastic_force(spring), amplitude_of(spring)
        return (Truth(spring, lambda y: polyval(amplitude * y, spring.kE) + scale * shape(y, size)),)

    return truths


def _tanh(spring: SpringParameters, _: Experiment, size: float) -> tuple[Truth, ...]:
    scale = elastic_force(spring)
    return (Truth(spring, lambda y: spring.kE[0] + scale * np.tanh(size * y) / np.tanh(size)),)


# -- of the motion and the samples


def _displacement_zeros(spring: SpringParameters, experiment: Experiment, share: float) -> tuple[Truth, ...]:
    """The spring in the coordinates of each record and in those of their mean."""
    shifts = share * amplitude_of(spring) * np.array(SHIFTS[: len(experiment.amplitudes)])
    return tuple(Truth(spring, shift=float(shift)) for shift in (*shifts, shifts.mean()))


def _displacement_noise(run: Run, share: float, generator: Generator) -> None:
    run.samples[1] += share * run.amplitude * generator.standard_normal(run.at.size)


def _displacement_steps(run: Run, share: float, _: Generator) -> None:
    step = share * run.amplitude
    run.samples[1] = step * np.round(run.samples[1] / step)


def _play(run: Run, share: float) -> FloatArray:
    """The spring follows the measured motion by a play operator."""
    half, follows, at = 0.5 * share * run.amplitude, np.empty_like(run.measured), float(run.measured[0])
    for begin, end in pairwise(strokes_of(run.measured)):
        piece = run.measured[begin : end + 1]
        follows[begin : end + 1] = (
            np.maximum(at, piece - half) if piece[-1] > piece[0] else np.minimum(at, piece + half)
        )
        at = float(follows[end])
    return follows


def _dwell(run: Run, share: float, _: Generator) -> None:
    """A pause of a tenth of the period or more at each reversal."""
    repeats = np.ones(run.path.size, dtype=int)
    repeats[strokes_of(run.path)[1:-1]] += round((0.1 + share) * run.experiment.period / run.step)
    run.path = run.measured = np.repeat(run.path, repeats)
    run.cycle = np.repeat(run.cycle, repeats)


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
    again = generator.random(run.samples.shape[1]) < share
    run.samples = np.repeat(run.samples, 1 + again, axis=1)


def _jitter(run: Run, share: float, generator: Generator) -> None:
    """Each column is sampled at moments of its own about those recorded."""
    noise = run.samples[2] - run.force[run.at]
    for row, signal in ((1, run.measured), (2, run.force)):
        moments = run.samples[0] + share * run.step * run.stride * generator.standard_normal(run.at.size)
        run.samples[row] = np.interp(moments, run.time, signal)
    run.samples[2] += noise


def _inertia(run: Run, share: float) -> FloatArray:
    """Of a sine only: the acceleration is -(2 pi f)^2 times the displacement."""
    return -share * run.elastic_scale * (run.path - run.truth.spring.displacement_offset) / run.amplitude


def _moving_mass(spring: SpringParameters, experiment: Experiment, share: float) -> dict[str, float]:
    stiffness = share * elastic_force(spring) / amplitude_of(spring)
    return {"moving_mass": stiffness / (2.0 * np.pi * experiment.frequency) ** 2}  # [kg]


def _fixture_stiffness(spring: SpringParameters, _: Experiment, share: float) -> dict[str, float]:
    return {"fixture_stiffness": elastic_force(spring) / (share * amplitude_of(spring))}  # [N/m]


def _complied(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
    """The fixture's deflection under the preload only moves the zero; it is measured, and goes into the coordinates."""
    middle = 0.5 * sum(polyval(np.array([spring.x_min, spring.x_max]), spring.kE))
    shifts = (0.0, spring.kE[0], middle)
    return tuple(Truth(spring, shift=force * share * amplitude_of(spring) / elastic_force(spring)) for force in shifts)


def _separate(experiment: Experiment, _: float) -> Experiment:
    """Several records, at least three."""
    if len(experiment.amplitudes) < 3:
        experiment = replace(experiment, amplitudes=(0.4, 0.7, 1.0), cycles=(3, 3, 3))
    return replace(experiment, separate=True)


def _asynchronous(experiment: Experiment, samples: float) -> Experiment:
    return replace(experiment, synchronous=False, samples=round(samples))


def _single(experiment: Experiment, cycles: float) -> Experiment:
    return replace(experiment, amplitudes=(1.0,), cycles=(round(cycles),), separate=False)


_PERIOD, _AMPLITUDE = "of the period", "of the amplitude"
_ELASTIC, _FRICTION = "of the elastic force", "of kappa_omega"
_SYNCHRONY = ("delay", "lag", "synchron", "rate", "velocity", "viscous")

FAULTS: dict[str, Fault] = {
    "force lags": Fault(0.0005, 0.01, _PERIOD, _SYNCHRONY, signals=_delayed(1.0)),
    "force leads": Fault(0.0005, 0.01, _PERIOD, _SYNCHRONY, signals=_delayed(-1.0)),
    "low-pass on the force": Fault(
        0.0005, 0.01, _PERIOD, (*_SYNCHRONY, "filter"), signals=changed("force", _low_passed)
    ),
    "viscous damper": Fault(
        0.05, 1.0, _FRICTION, _SYNCHRONY,
        signals=added("force", lambda run, share: share * run.truth.spring.kappa_omega * run.velocity),
    ),
    "Maxwell element": Fault(
        0.02, 0.4, _ELASTIC, (*_SYNCHRONY, "relax", "creep"), signals=added("force", _maxwell), truths=_stored
    ),
    "Stribeck friction": Fault(
        0.05, 0.6, _FRICTION, (*_SYNCHRONY, "stick"), truths=_scaled(1.0),
        force=changed("hysteretic", lambda r, share: r.hysteretic * (1.0 + share * np.exp(-np.abs(r.velocity) / 0.3))),
    ),
    "displacement zero": Fault(
        0.003, 0.05, _AMPLITUDE, ("zero", "shift", "offset"), truths=_displacement_zeros, programme=_separate,
        signals=added("measured", lambda run, share: share * run.amplitude * SHIFTS[run.index]),
    ),
    "force zero": Fault(
        0.005, 0.1, _ELASTIC, ("zero", "shift", "offset", "drift"), programme=_separate,
        signals=added("force", lambda run, share: share * run.elastic_scale * SHIFTS[run.index]),
    ),
    "linear drift": Fault(
        0.01, 0.2, _ELASTIC, ("drift", "zero"),
        signals=added("force", lambda run, share: share * run.elastic_scale * run.elapsed),
    ),
    "warm-up": Fault(
        0.01, 0.2, _ELASTIC, ("drift", "zero"),
        signals=added("force", lambda run, share: -share * run.elastic_scale * np.exp(-run.elapsed / 0.25)),
    ),
    "wear of friction": Fault(
        0.05, 0.5, _FRICTION, ("wear", "cycle to cycle"), truths=_scaled(-1.0),
        force=changed("hysteretic", lambda run, share: run.hysteretic * _worn(run, share)),
    ),
    "wear of stiffness": Fault(
        0.01, 0.15, "of FE", ("wear", "cycle to cycle", "soften"), truths=_worn_stiffness,
        force=changed("elastic", lambda run, share: _softened(run, _worn(run, share))),
    ),
    "first cycle": Fault(
        0.03, 0.4, "of FE", ("first cycle", "cycle to cycle"), force=changed("elastic", _first_cycle)
    ),
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
        0.05, 0.6, "of the sampling interval", ("jitter", "displacement noise", "irregular"), sampled=_jitter
    ),
    "clipped force": Fault(0.01, 0.15, "of the force's range", ("clip", "extreme"), sampled=_clipped),
    "play": Fault(0.003, 0.05, _AMPLITUDE, ("play", "backlash"), motion=changed("path", _play)),
    "dwells": Fault(
        0.05, 0.5, "of hysteresis", ("dwell", "relax", "pause"), motion=_dwell, force=changed("hysteretic", _relaxed)
    ),
    "gaps": Fault(0.03, 0.15, _PERIOD, ("gap", "lost", "missing"), sampled=_gaps),
    "lost reversals": Fault(0.02, 0.2, _PERIOD, ("gap", "lost", "missing"), sampled=_lost_reversals),
    "reversals between samples": Fault(2000.0, 500.0, "samples", ("reversal",), programme=_asynchronous),
    "duplicates": Fault(0.01, 0.2, "of the samples", ("duplicate", "repeated", "twice"), sampled=_duplicates),
    "single amplitude": Fault(
        4.0, 2.0, "cycles", ("amplitude", "extrapolat", "small loops"), programme=_single
    ),
    "moving mass": Fault(
        0.003, 0.1, _ELASTIC, ("mass", "inertia"), signals=added("force", _inertia), options=_moving_mass,
        programme=lambda experiment, _: replace(experiment, shape="sine"),
    ),
    "fixture compliance": Fault(
        0.005, 0.15, _AMPLITUDE, ("fixture", "complian"), truths=_complied, options=_fixture_stiffness,
        signals=changed("measured", lambda r, share: r.path + r.force * share * r.amplitude / r.elastic_scale),
    ),
    "kink": Fault(
        0.15, 1.5, "of the slope", (*MISFIT, "kink"), truths=_shaped(lambda y, size: size * np.maximum(y - 0.1, 0.0))
    ),
    "tanh": Fault(1.5, 5.0, "y in tanh", MISFIT, truths=_tanh),
    "bump stop": Fault(
        0.1, 2.0, _ELASTIC, (*MISFIT, "bump stop", "end stop"),
        truths=_shaped(lambda y, size: size * (np.maximum(y - 0.75, 0.0) / 0.25) ** 1.5),
    ),
    "closing coils": Fault(
        0.1, 1.5, _ELASTIC, MISFIT, truths=_shaped(lambda y, size: size * np.exp((y - 1.0) / 0.12))
    ),
    "cubic load cell": Fault(
        0.002, 0.03, "of the force", (*MISFIT, "linearity"), signals=changed("force", _cubic_load_cell)
    ),
    "mains hum": Fault(0.005, 0.05, "of the force's deviation", ("hum", "mains", "periodic", "noise"), signals=_hum),
    "outliers": Fault(1.0, 8.0, "outliers", ("outlier", "spike"), sampled=_outliers),
}  # fmt: skip
