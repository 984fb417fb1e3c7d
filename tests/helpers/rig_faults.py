"""The faults of real rigs: one table `FAULTS`, and what happens that no effect of the identification describes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import tomllib
from numpy.polynomial.polynomial import polyval

from rig import Action, Experiment, Fault, FloatArray, Generator, Run, Truth, amplitude_of, elastic_force, strokes_of
from strandspring import SpringParameters

SHIFTS = (0.0, 1.0, -0.7, 0.5)  # of the zeros of records
Truths = Callable[[SpringParameters, Experiment, float], tuple[Truth, ...]]


def changed(name: str, to: Callable[[Run, float], Any]) -> Action:
    """Replace an array of the run."""
    return lambda run, size, _: setattr(run, name, to(run, size))


def added(name: str, by: Callable[[Run, float], Any]) -> Action:
    return changed(name, lambda run, size: getattr(run, name) + by(run, size))


def measured(row: int, to: Callable[[FloatArray, Run, float, Generator], FloatArray]) -> Action:
    """Replace displacement (1) or force (2) of the samples."""

    def act(run: Run, size: float, generator: Generator) -> None:
        run.samples[row] = to(run.samples[row], run, size, generator)

    return act


# -- of the force


def _late(run: Run, seconds: float) -> FloatArray:
    return np.interp(run.time - seconds, run.time, run.force)


def _filtered(signal: FloatArray, gain: float, keep: float, start: float = 0.0) -> FloatArray:
    from scipy.signal import lfilter

    return np.asarray(lfilter([gain], [1.0, -keep], signal, zi=[keep * start])[0])


def _low_passed(run: Run, share: float) -> FloatArray:
    keep = np.exp(-run.step / (share * run.experiment.period))
    return _filtered(run.force, 1.0 - keep, keep, run.force[0])


def _maxwell(run: Run, share: float, seconds: float) -> FloatArray:
    """Of an element with this share of the elastic stiffness."""
    keep = np.exp(-run.step / seconds)
    moved = np.diff(run.path, prepend=run.path[0]) * share * run.elastic_scale / run.amplitude
    return _filtered(moved, keep, keep)


def _stored(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
    """Without the Maxwell element, or with its storage stiffness at the test's frequency, which FE cannot but hold."""
    turned = (2.0 * np.pi * 0.3) ** 2
    stiffness = share * elastic_force(spring) / amplitude_of(spring) * turned / (1.0 + turned)
    return Truth(spring), Truth(spring, stiffness=stiffness)


def _force_range(run: Run) -> tuple[float, float]:
    """Range of the force on the whole range of displacement [N]."""
    p = run.truth.spring
    force = run.truth.response(np.array([p.displacement_offset, *[p.displacement_min, p.displacement_max] * 2]))
    return float(force.min()), float(force.max())


def _clipped(force: FloatArray, run: Run, share: float, generator: Generator) -> FloatArray:
    """The range of the largest record ends below its largest force, or at both ends."""
    low, high = _force_range(run)
    reach = share * (high - low)
    return force.clip(low + reach if generator.random() < 0.5 else -np.inf, high - reach)


def _force_steps(force: FloatArray, run: Run, share: float, _: Generator) -> FloatArray:
    step = share * float(np.ptp(_force_range(run)))
    return step * np.round(force / step)


def _displacement_steps(path: FloatArray, run: Run, share: float, _: Generator) -> FloatArray:
    step = share * run.amplitude
    return step * np.round(path / step)


def _hum(run: Run, share: float, frequency: float, phase: float) -> FloatArray:
    """A sinusoid whose rms is this share of the force's deviation."""
    return share * np.sqrt(2.0) * float(np.std(run.force)) * np.sin(2.0 * np.pi * frequency * run.time + phase)


def _mains(run: Run, share: float, generator: Generator) -> None:
    run.force = run.force + _hum(run, share, 50.0, generator.uniform(0.0, 2.0 * np.pi))


# -- of the spring


def _parts_of(name: str, change: float) -> Truths:
    """The spring whose friction or stiffness changed by nothing, half of the share, and all of it."""

    def truths(spring: SpringParameters, _: Experiment, share: float) -> tuple[Truth, ...]:
        factors = [1.0 + change * share * part for part in (0.0, 0.5, 1.0)]
        if name == "kappa_omega":
            return tuple(Truth(replace(spring, kappa_omega=spring.kappa_omega * factor)) for factor in factors)
        return tuple(Truth(replace(spring, kE=(spring.kE[0], *(f * k for k in spring.kE[1:])))) for f in factors)

    return truths


def _softened(run: Run, left: Any) -> FloatArray:
    at_rest = run.truth.spring.kE[0]
    return np.asarray(at_rest + (run.elastic - at_rest) * left)


def _elapsed(run: Run) -> FloatArray:
    """Cycles since the start of the experiment as a share of all."""
    return run.cycle / sum(run.experiment.cycles)


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


def _shaped(shape: Callable[[FloatArray, float], FloatArray], beside_FE: bool = True) -> Truths:
    """A shape of y, times half the range of FE, on top of FE or in its place."""

    def truths(spring: SpringParameters, _: Experiment, size: float) -> tuple[Truth, ...]:
        kept = spring.kE if beside_FE else spring.kE[:1]
        scale, amplitude = elastic_force(spring), amplitude_of(spring)
        return (Truth(spring, lambda y: polyval(amplitude * y, kept) + scale * shape(y, size)),)

    return truths


# -- of the motion and the samples


def _displacement_zeros(spring: SpringParameters, experiment: Experiment, share: float) -> tuple[Truth, ...]:
    """The spring in the coordinates of each record and in those of their mean."""
    shifts = share * amplitude_of(spring) * np.array(SHIFTS[: len(experiment.amplitudes)])
    return tuple(Truth(spring, shift=float(shift)) for shift in (*shifts, shifts.mean()))


def _play(run: Run, share: float) -> FloatArray:
    """The spring follows the measured motion by a play operator."""
    half, follows, at = 0.5 * share * run.amplitude, np.empty_like(run.measured), float(run.measured[0])
    for begin, end in pairwise(strokes_of(run.measured)):
        piece = run.measured[begin : end + 1]
        rising = piece[-1] > piece[0]
        follows[begin : end + 1] = np.maximum(at, piece - half) if rising else np.minimum(at, piece + half)
        at = float(follows[end])
    return follows


def _dwell(run: Run, share: float, _: Generator) -> None:
    """A pause of a tenth of the period or more at each reversal."""
    repeats = np.ones(run.path.size, dtype=int)
    repeats[strokes_of(run.path)[1:-1]] += round((0.1 + share) * run.experiment.period / run.step)
    run.path = run.measured = np.repeat(run.path, repeats)
    run.cycle = np.repeat(run.cycle, repeats)


def _gaps(run: Run, share: float, generator: Generator) -> None:
    """Three times in each record samples are lost in the middle of a stroke."""
    count = max(2, round(share * run.experiment.period / (run.step * run.stride)))
    turns = strokes_of(run.path)
    chosen = generator.choice(np.arange(1, turns.size - 2), size=min(3, turns.size - 3), replace=False)
    keep = np.ones(run.samples.shape[1], dtype=bool)
    for middle in 0.5 * (turns[chosen] + turns[chosen + 1]) / run.stride:
        keep[max(round(middle - count / 2), 0) : round(middle + count / 2)] = False
    run.samples = run.samples[:, keep]


def _inertia(run: Run, share: float) -> FloatArray:
    """Of a sine only: the acceleration is -(2 pi f)^2 times the displacement."""
    return -share * run.elastic_scale * (run.path - run.truth.spring.displacement_offset) / run.amplitude


def _moving_mass(spring: SpringParameters, experiment: Experiment, share: float) -> dict[str, float]:
    stiffness = share * elastic_force(spring) / amplitude_of(spring)
    return {"moving_mass": stiffness / (2.0 * np.pi * experiment.frequency) ** 2}  # [kg]


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


ACTS: dict[str, dict[str, Any]] = {
    "force lags": {"signals": changed("force", lambda r, s: _late(r, s * r.experiment.period))},
    "force leads": {"signals": changed("force", lambda r, s: _late(r, -s * r.experiment.period))},
    "low-pass on the force": {"signals": changed("force", _low_passed)},
    "viscous damper": {"signals": added("force", lambda r, s: s * r.truth.spring.kappa_omega * r.velocity)},
    "Maxwell element": {
        "truths": _stored, "signals": added("force", lambda r, s: _maxwell(r, s, 0.3 * r.experiment.period)),
    },
    "displacement zero": {
        "truths": _displacement_zeros, "programme": _separate,
        "signals": added("measured", lambda r, s: s * r.amplitude * SHIFTS[r.index]),
    },
    "force zero": {
        "programme": _separate, "signals": added("force", lambda r, s: s * r.elastic_scale * SHIFTS[r.index]),
    },
    "linear drift": {"signals": added("force", lambda r, s: s * r.elastic_scale * _elapsed(r))},
    "warm-up": {"signals": added("force", lambda r, s: -s * r.elastic_scale * np.exp(-_elapsed(r) / 0.25))},
    "wear of friction": {
        "truths": _parts_of("kappa_omega", -1.0),
        "force": changed("hysteretic", lambda r, s: r.hysteretic * (1.0 - s * _elapsed(r))),
    },
    "wear of stiffness": {
        "truths": _parts_of("kE", -1.0), "force": changed("elastic", lambda r, s: _softened(r, 1.0 - s * _elapsed(r))),
    },
    "first cycle": {"force": changed("elastic", _first_cycle)},
    "displacement noise": {
        "sampled": measured(1, lambda x, r, s, g: x + s * r.amplitude * g.standard_normal(x.size)),
    },
    "displacement steps": {"sampled": measured(1, _displacement_steps)},
    "force steps": {"sampled": measured(2, _force_steps)},
    "clipped force": {"sampled": measured(2, _clipped)},
    "play": {"motion": changed("path", _play)},
    "dwells": {"motion": _dwell, "force": changed("hysteretic", _relaxed)},
    "gaps": {"sampled": _gaps},
    "reversals between samples": {"programme": lambda e, s: replace(e, synchronous=False, samples=round(s))},
    "single amplitude": {
        "programme": lambda e, s: replace(e, amplitudes=(1.0,), cycles=(round(s),), separate=False),
    },
    "moving mass": {
        "programme": lambda e, _: replace(e, shape="sine"), "options": _moving_mass,
        "signals": added("force", _inertia),
    },
    "fixture compliance": {
        "truths": _complied, "options": lambda p, _, s: {"fixture_stiffness": elastic_force(p) / (s * amplitude_of(p))},
        "signals": changed("measured", lambda r, s: r.path + r.force * s * r.amplitude / r.elastic_scale),
    },
    "kink": {"truths": _shaped(lambda y, s: s * np.maximum(y - 0.1, 0.0))},
    "tanh": {"truths": _shaped(lambda y, s: np.tanh(s * y) / np.tanh(s), False)},
    "bump stop": {"truths": _shaped(lambda y, s: s * (np.maximum(y - 0.75, 0.0) / 0.25) ** 1.5)},
    "mains hum": {"signals": _mains},
}  # fmt: skip
_SIZES = tomllib.loads(Path(__file__).with_name("rig_faults.toml").read_text("utf-8"))
FAULTS = {name: Fault(*_SIZES[name][:2], tuple(_SIZES[name][2:]), **acts) for name, acts in ACTS.items()}


# -- faults of a size of their own


def less_friction(share: float, record: int) -> Callable[[int, float], Fault]:
    """The hysteretic force of one record is lower by this share."""
    act = changed("hysteretic", lambda run, size: run.hysteretic * (1.0 - size))
    return lambda k, _: Fault(share, share if k == record else 0.0, force=act)


def moving_mass(share: float, highest: float) -> Callable[[int, float], Fault]:
    """The inertia of a mass in sine tests, this share of the elastic force at the highest frequency [Hz]."""
    return lambda _, f: Fault(share, share * (f / highest) ** 2, signals=added("force", _inertia))


def rubber(share: float) -> Callable[[int, float], Fault]:
    """Five Maxwell elements from 0.01 to 3 s, each with this share of the elastic stiffness."""
    times = (3.0, 0.8, 0.2, 0.05, 0.0125)
    act = added("force", lambda run, size: sum(_maxwell(run, size, seconds) for seconds in times))
    return lambda *_: Fault(share, share, signals=act)


def lagging(delay: float) -> Callable[[int, float], Fault]:
    """The force lags by so many seconds at every frequency."""
    return lambda *_: Fault(delay, delay, signals=changed("force", _late))


def wearing(share: float, records: int, stiffness: bool = False) -> Callable[[int, float], Fault]:
    """Friction or stiffness that is lost at a constant rate over all records."""

    def of(k: int, _: float) -> Fault:
        def left(run: Run, size: float) -> FloatArray:
            return 1.0 - size * (k + _elapsed(run)) / records

        if stiffness:
            return Fault(share, share, force=changed("elastic", lambda run, size: _softened(run, left(run, size))))
        return Fault(share, share, force=changed("hysteretic", lambda run, size: run.hysteretic * left(run, size)))

    return of


def humming(harmonic: float, share: float) -> Fault:
    """A sinusoid at a multiple of the test's frequency, its rms this share of the force's deviation."""
    return Fault(
        share, share, signals=added("force", lambda r, size: _hum(r, size, harmonic * r.experiment.frequency, 1.0))
    )


def gapped(share: float) -> Fault:
    """A gap about the middle, this share of the amplitude wide, in which the spring does not move."""

    def path(run: Run, size: float) -> FloatArray:
        centre = run.truth.spring.displacement_offset
        y = run.measured - centre
        return centre + np.sign(y) * np.maximum(np.abs(y) - 0.5 * size * run.amplitude, 0.0)

    return Fault(share, share, motion=changed("path", path))
