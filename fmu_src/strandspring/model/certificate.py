"""The certificate of a spring: between samples and on other loops its force stays near the recorded ones.

A fit is held to its records at their samples only. Between these, and on other loops, an FE with more coefficients than
the records have displacements, or one that runs against kappa_omega*FA*omega, may give any force. So before a spring is
saved, it is driven along

- the path of each record, 20 times finer;
- nested strokes, from the whole identified range to a tenth of it;
- settled loops of 1, 0.6, 0.3 and 0.1 of half the range, about its middle and 0.6 of the half to either side of it, cut
  off at its ends,

and its force, and FE alone, must lie within the recorded forces and a quarter of their span, its loops must absorb
energy, its stiffness must be finite, and the slope of FE at most ten times the steepest secant of the records. Extremes
of FE and of its slope are those of its polynomials, and exact. FA > 0 is a condition of `SpringParameters`. Maxwell
branches count along the records; on other paths they have relaxed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..core.parameters import SpringParameters
from ..core.polynomials import derivative, least_value
from ..core.spline import pieces
from ..errors import ModelError, Reader
from ..findings import Outcome, detailed
from ..kernel.arrays import FloatArray
from ..kernel.path import OmegaStart, PathSolver
from .modelfile import ModelFile

_MARGIN = 0.25  # by which the force may leave the recorded one, share of its span
_FINER = 20
_MOST_SAMPLES = 4_000_000  # of a path made finer; long records are finely sampled as they are
_STRETCH = 0.02  # of a secant, share of the range
_STEEPER = 10.0  # slope of FE in the steepest secant
_LOOPS = (1.0, 0.6, 0.3, 0.1)
_MIDDLES = (0.0, -0.6, 0.6)
_CYCLES = 40  # until a loop is settled
_SAMPLES = 64  # of a stroke
_ROUNDING = 1e-9  # of the energy, in the largest force times the range
_NOISE = 0.01  # of the range, by which the samples of a record may leave it


class Driven(NamedTuple):
    """A record as the spring is driven along it: displacement [m], force [N] and time [s] of shape (K,)."""

    displacement: FloatArray
    force: FloatArray
    time: FloatArray | None
    omega_start: OmegaStart


class ForceRange(NamedTuple):
    """The range of recorded forces, and the margin by which a spring may leave it [N]."""

    force_min: float
    force_max: float
    margin: float

    @classmethod
    def of(cls, records: Sequence[Driven]) -> ForceRange:
        """That of records."""
        low = min(float(record.force.min()) for record in records)
        high = max(float(record.force.max()) for record in records)
        return cls(low, high, _MARGIN * (high - low))


def certified(model: ModelFile) -> str:
    """What is certain of the spring of a model file, in words.

    Raises
    ------
    ModelError   If the spring does not meet its certificate; without one, if it is not finite and dissipative.
    """
    stated = model.certificate
    held = None if stated is None else ForceRange(stated.force_min, stated.force_max, stated.margin)
    if numbers := shortcoming(model.parameters, held):
        text = detailed(Outcome.UNCERTIFIED, numbers, Reader.PYTHON)
        raise ModelError(f"The spring {model.name} does not meet its certificate: {text}; identify it again.")
    if held is None:
        return "finite and dissipative; not held to a record"
    return f"force and FE within {held.force_min:.4g} to {held.force_max:.4g} N as recorded, +- {held.margin:.3g} N"


def shortcoming(spring: SpringParameters, held: ForceRange | None, records: Sequence[Driven] = ()) -> dict[str, Any]:
    """What speaks against a spring, as numbers of UNCERTIFIED; none if it meets its certificate.

    Parameters
    ----------
    spring : SpringParameters
    held : ForceRange or None       That of its force; any finite one if None.
    records : sequence of Driven    Those it was identified from, as far as they are at hand.
    """
    bounds = -math.inf, math.inf
    if held is not None:
        bounds = held.force_min - held.margin, held.force_max + held.margin
    low, high = spring.displacement_min, spring.displacement_max
    steepest = _STEEPER * max((_steepest_secant(record, _STRETCH * (high - low)) for record in records), default=0.0)
    for coefficients, *ends in _elastic_polynomials(spring):
        if beyond := _beyond("elastic", _extremes(coefficients, *ends), bounds):
            return beyond
        slope = max(map(abs, _extremes(derivative(coefficients), *ends)))
        if slope > steepest > 0.0:
            return {"slope": slope, "recorded_slope": steepest / _STEEPER}
    solver = PathSolver(spring)
    for path, _, time, omega_start in map(_finer, records):
        noise = _NOISE * (high - low)
        inside = (path >= low - noise) & (path <= high + noise)
        force = solver.force(path, omega_start, time)[inside]
        if force.size and (beyond := _beyond("between", force, bounds)):
            return beyond
    settled = solver.slow
    for path, begin in _unrecorded_paths(low, high):
        force, energy = settled.force(path), settled.absorbed_energy(path)
        if beyond := _beyond("elsewhere", force, bounds):
            return beyond
        rounding = _ROUNDING * float(np.abs(force).max()) * (high - low)
        if begin is not None and not energy[-1] - energy[begin] >= -rounding:
            return {"loop": ((float(path.min()), float(path.max())),)}
        if not (finite := np.isfinite(settled.stiffness(path))).all():
            return {"infinite": float(path[np.argmin(finite)])}
    return {}


def _beyond(name: str, values: ArrayLike, bounds: tuple[float, float]) -> dict[str, Any]:
    """What reaches beyond the bounds, so called; NaN and infinity, which JSON lacks, always do, and are names."""
    for value in (float(np.min(values)), float(np.max(values))):
        if not (math.isfinite(value) and bounds[0] <= value <= bounds[1]):
            reached = {name: value if math.isfinite(value) else str(value)}
            return {**reached, "allowed": (bounds,)} if math.isfinite(bounds[0]) else reached
    return {}


def _elastic_polynomials(spring: SpringParameters) -> Iterator[tuple[tuple[float, ...], float, float]]:
    """Coefficients of FE by ascending powers, and between which arguments they hold."""
    if not spring.FE_knots:
        yield spring.kE, spring.x_min, spring.x_max
        return
    knots = [knot - spring.displacement_offset for knot in spring.FE_knots]
    for piece, (left, right) in zip(pieces(knots, spring.FE_forces), pairwise(knots), strict=True):
        yield piece.force, 0.0, right - left


def _extremes(coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float]:
    """Least and greatest value of a polynomial on [low, high]."""
    greatest, _ = least_value(tuple(-c for c in coefficients), low, high)
    return least_value(coefficients, low, high)[0], -greatest


def _steepest_secant(record: Driven, stretch: float) -> float:
    """Steepest secant of a record over a stretch of displacement without a reversal [N/m]; 0 if it has none."""
    travel = np.append(0.0, np.cumsum(np.abs(np.diff(record.displacement))))
    places = np.arange(0.0, min(travel[-1], _MOST_SAMPLES * stretch), stretch)
    displacement, force = (np.interp(places, travel, column) for column in (record.displacement, record.force))
    straight = np.abs(np.diff(displacement)) > 0.9 * stretch
    return float(np.abs(np.diff(force)[straight]).max(initial=0.0)) / stretch


def _finer(record: Driven) -> Driven:
    """A record with samples between its own, on straight lines."""
    count = record.displacement.size
    times = max(1, min(_FINER, _MOST_SAMPLES // count))
    places, samples = np.linspace(0.0, count - 1.0, (count - 1) * times + 1), np.arange(count)
    path, force = (np.interp(places, samples, column) for column in (record.displacement, record.force))
    return Driven(
        path, force, None if record.time is None else np.interp(places, samples, record.time), record.omega_start
    )


def _unrecorded_paths(low: float, high: float) -> Iterator[tuple[FloatArray, int | None]]:
    """Nested strokes and settled loops within the range [m]; of a loop, the sample at which its last cycle begins."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    turns = [low, high, *(middle + (-1.0) ** k * half * (1.0 - 0.1 * k) for k in range(1, 10))]
    nested = [np.linspace(*ends, _SAMPLES) for ends in pairwise([*turns, *turns[::-1]])]
    yield np.clip(np.concatenate(nested), low, high), None
    for at in _MIDDLES:
        for share in _LOOPS:
            ends = max(low, middle + (at - share) * half), min(high, middle + (at + share) * half)
            last = [np.linspace(*ends, _SAMPLES), np.linspace(*ends[::-1], _SAMPLES)]
            yield np.concatenate([np.tile(ends, _CYCLES), *last]), 2 * _CYCLES
