"""The two-stage identification: no iteration, no initial values.

Where the steady section begins is not known beforehand. Both stages are linear and take about a millisecond, so
they are run for each of a few distances from the reversal, the misfit of stage 2 ranks them, and one closing linear
least squares with that omega gives FE and FA over the whole range. Nothing is started from a guess and nothing is
repeated until it converges.
"""

from __future__ import annotations

import numpy as np

from ..least_squares.stages import fit_backbone, fit_hysteresis
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints
from .degrees import choose_degrees
from .solution import Solution, is_distinct

# Distances from a reversal, as shares of the longest stroke, at which the steady section is taken to begin.
_STEADY_SHARES = (0.1, 0.25, 0.45, 0.65, 0.8)
# The best few by the misfit of stage 2 are carried through to the closing fit.
_CARRIED = 2


def two_stage(loops: SamplePoints, degrees: tuple[int, int] | None) -> Solution | None:
    """Identify the spring on the steady points of its records; None if there is no steady section.

    Parameters
    ----------
    loops : SamplePoints
    degrees : (int, int) or None   Chosen from the data if None.
    """

    def solve(degrees: tuple[int, int]) -> Solution | None:
        return _solve(loops, degrees)

    return choose_degrees(loops, solve) if degrees is None else solve(degrees)


def _solve(loops: SamplePoints, degrees: tuple[int, int]) -> Solution | None:
    """Both stages for every candidate steady section, the best by the rms misfit of the closing fit."""
    basis = Basis(*loops.reach, *degrees)
    columns = basis.columns(loops.displacement)
    side = loops.side.astype(np.float64)
    travels = [share * loops.longest for share in _STEADY_SHARES]
    results = fit_hysteresis(loops, [fit_backbone(loops, columns, side, loops.travel >= travel) for travel in travels])
    ranked = [
        (result[1], share, result[0])
        for share, result in zip(_STEADY_SHARES, results, strict=True)
        if result is not None
    ]
    ranked.sort(key=lambda entry: entry[:2])
    solutions: list[Solution] = []
    for _, share, hysteresis in ranked:
        if len(solutions) == _CARRIED:
            break
        omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
        backbone = fit_backbone(loops, columns, omega)
        if backbone is not None and is_distinct(omega):
            solutions.append(Solution(basis, backbone, hysteresis, omega, share))
    return min(solutions, key=lambda s: loops.rms(s.backbone.misfit(loops.force, s.omega)), default=None)
