"""Choice of the degrees N of FE and M of FA, never by the error of the samples they were fitted to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...kernel.arrays import FloatArray
from ..points.noise import force_noise
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints
from .solution import Solution

# Candidate degrees N, M for an automatic choice, in the order of preference.
_DEGREES = ((1, 0), (2, 1), (3, 2), (4, 3), (5, 3), (6, 4), (8, 6))
# Degrees tried first.
_PILOT = (4, 3)
# Error in terms of the noise up to which the pilot explains the records; a leaner pair may err by this much more.
_EXPLAINED = 1.3
_AS_WELL = 1.04
# A richer pair must lower the error of the samples not fitted by more than this.
_WORTH = 0.85
# Errors below this share of the rms force about its mean are equally good: high degrees would spend them on
# imitating the hysteresis of the one amplitude they have seen.
_GOOD_ENOUGH = 0.005


def choose_degrees(loops: SamplePoints, solve: Callable[[tuple[int, int]], Solution | None]) -> Solution | None:
    """The leanest degrees that predict samples they were not fitted to nearly as well as the best.

    If the residuals of a pilot at middling degrees are noise, its omega serves to look for leaner degrees that do as
    well, by linear least squares alone. Otherwise the method is applied at all degrees.
    """
    floor = _GOOD_ENOUGH * loops.force_deviation
    noise = loops.rms(np.sqrt(force_noise(loops.force).variance(loops.force)))
    pilot = solve(_PILOT)
    if pilot is not None:
        reached = max(prediction_error(loops, pilot.basis, pilot.omega), floor)
        if reached <= max(floor, _EXPLAINED * noise):
            leaner = _DEGREES[: _DEGREES.index(_PILOT)]
            bases = (replace(pilot.basis, elastic=n, amplifier=m) for n, m in leaner)
            errors = (prediction_error(loops, basis, pilot.omega) for basis in bases)
            chosen = next((d for d, e in zip(leaner, errors, strict=True) if e <= _AS_WELL * reached), _PILOT)
            return pilot if chosen == _PILOT else solve(chosen) or pilot
    best: Solution | None = None
    least = np.inf
    for degrees in _DEGREES:
        solution = pilot if degrees == _PILOT else solve(degrees)
        if solution is None:
            continue
        error = max(prediction_error(loops, solution.basis, solution.omega), floor)
        if error < _WORTH * least:
            best, least = solution, error
        if least == floor:
            break
    return best


def prediction_error(loops: SamplePoints, basis: Basis, omega: FloatArray) -> float:
    """rms error [N] of FE and FA on the cycles they were not fitted to, cycles being halved by parity.

    With a single cycle Akaike's final prediction error takes its place.
    """
    columns = basis.columns(loops.displacement)
    root = np.sqrt(loops.weight)
    matrix = np.hstack([columns.elastic, omega[:, None] * columns.amplifier]) * root[:, None]
    target = loops.force * root
    cycle = loops.cycles()
    odd = cycle % 2 == 1
    size, terms = matrix.shape
    if cycle.max() < 1 or min(odd.sum(), (~odd).sum()) < 0.3 * size:
        residuals = target - matrix @ np.linalg.lstsq(matrix, target, rcond=1e-12)[0]
        final = (size + terms) / max(size - terms, 1)
        return float(np.sqrt(final * (residuals @ residuals) / loops.weight.sum()))
    total = 0.0
    for fitted in (odd, ~odd):
        coefficients = np.linalg.lstsq(matrix[fitted], target[fitted], rcond=1e-12)[0]
        total += float(np.sum((target[~fitted] - matrix[~fitted] @ coefficients) ** 2))
    return float(np.sqrt(total / loops.weight.sum()))
