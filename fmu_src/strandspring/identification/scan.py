"""A start without start values: an exhaustive coarse grid over rho, sigma and n.

For each grid point omega follows in closed form and FE, FA by linear least squares, so nothing is iterated. rho is
gridded through what it means: the share of the longest stroke within which the hysteresis saturates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernel.arrays import FloatArray
from ..kernel.table import table
from .degrees import choose_degrees
from .loops import Loops
from .polynomials import Basis
from .spring_of_fit import Solution, is_distinct
from .stages import Hysteresis, fit_backbone
from .two_stage import TwoStageOptions

_N = (0.1, 0.2, 0.4, 0.8, 1.6, 4.0, 10.0)
_SIGMA = (0.5, 1.0, 2.5, 8.0)
_SHARES = (0.03, 0.06, 0.12, 0.25, 0.4, 0.6, 0.8, 1.1, 1.6)
_SATURATED = 0.98  # omega that counts as saturated, coming from -1


@dataclass(frozen=True)
class ScanOptions:
    """Options of the scan.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen from the data if None.
    """

    degrees: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        TwoStageOptions(self.degrees)


def scan(loops: Loops, options: ScanOptions) -> Solution | None:
    """The best point of the grid; None if none swings omega to both sides."""
    grid = _Grid(loops)
    return choose_degrees(loops, grid.best) if options.degrees is None else grid.best(options.degrees)


class _Grid:
    """omega of every grid point on a set of loops; serves all degrees."""

    def __init__(self, loops: Loops) -> None:
        self.loops = loops
        longest = float(loops.length[np.unique(loops.stroke)].max())
        self.points: list[tuple[Hysteresis, float]] = []
        for n in _N:
            for sigma in _SIGMA:
                saturated, reversed_ = table(n, sigma).inverse(np.array([_SATURATED, -1.0]))
                needed = float(saturated - reversed_)
                self.points += [(Hysteresis(needed / (share * longest), sigma, n), share) for share in _SHARES]
        self.omega = [loops.omega(h.rho, h.sigma, h.n) for h, _ in self.points]

    def best(self, degrees: tuple[int, int]) -> Solution | None:
        """The grid point with the least squared misfit for these degrees."""
        loops = self.loops
        basis = Basis(*loops.reach, *degrees)
        columns_E, columns_A = basis.columns(loops.displacement)
        root = np.sqrt(loops.weight)
        target = loops.force * root
        misfits = [
            _projected(np.hstack([columns_E, omega[:, None] * columns_A]) * root[:, None], target)
            if is_distinct(omega)
            else np.inf
            for omega in self.omega
        ]
        pick = int(np.argmin(misfits))
        if not np.isfinite(misfits[pick]):
            return None
        hysteresis, share = self.points[pick]
        backbone = fit_backbone(loops, basis, self.omega[pick])
        if backbone is None:
            return None
        misfit = float(np.sqrt(misfits[pick] / loops.weight.sum()))
        return Solution(basis, backbone, hysteresis, self.omega[pick], share, misfit)


def _projected(matrix: FloatArray, target: FloatArray) -> float:
    """Squared misfit of linear least squares by the normal equations, accurate enough to rank."""
    try:
        coefficients = np.linalg.solve(matrix.T @ matrix, matrix.T @ target)
    except np.linalg.LinAlgError:
        return float(np.inf)
    return float(np.sum((target - matrix @ coefficients) ** 2))
