"""A start without start values: an exhaustive coarse grid over rho, sigma and n.

For each grid point omega follows in closed form and FE, FA by linear least squares, so nothing is iterated. rho is
gridded through what it means: the share of the longest stroke within which the hysteresis saturates.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...kernel.arrays import FloatArray
from ..least_squares.stages import Hysteresis, fit_backbone
from ..points.polynomials import Basis, Columns
from ..points.sample_points import SamplePoints
from .degrees import choose_degrees
from .solution import Solution, is_distinct, saturation_distance

_N = (0.1, 0.2, 0.4, 0.8, 1.6, 4.0, 10.0)
_SIGMA = (0.5, 1.0, 2.5, 8.0)
_SCANNED = 300  # points on which local minima are looked for
_SHARES = (0.03, 0.06, 0.12, 0.25, 0.4, 0.6, 0.8, 1.1, 1.6)


def scan(loops: SamplePoints, degrees: tuple[int, int] | None) -> Solution | None:
    """The best point of the grid; None if none swings omega to both sides.

    Parameters
    ----------
    loops : SamplePoints
    degrees : (int, int) or None   Chosen from the data if None.
    """
    grid = _Grid(loops)
    return choose_degrees(loops, grid.best) if degrees is None else grid.best(degrees)


def scan_minima(loops: SamplePoints, columns: Columns) -> list[Hysteresis]:
    """The local minima of the misfit over n and the saturation length, the least first.

    Parameters
    ----------
    loops : SamplePoints
    columns : Columns   Basis functions at the points.
    """
    kept = np.arange(loops.force.size) % max(1, loops.force.size // _SCANNED) == 0
    return _Grid(loops.only(kept)).minima(Columns(columns.elastic[kept], columns.amplifier[kept]))


@cache
def _saturation_distances() -> FloatArray:
    """Of each n and sigma of the grid, shape (n, sigma)."""
    return np.array([[saturation_distance(n, sigma) for sigma in _SIGMA] for n in _N])


class _Grid:
    """omega of every grid point on a set of loops, where it swings to both sides; serves all degrees."""

    def __init__(self, loops: SamplePoints) -> None:
        self.loops = loops
        self.rates = _saturation_distances()[:, :, None] / (np.array(_SHARES) * loops.longest)
        omega = np.concatenate(
            [
                loops.points.omega_by_rate(rho, sigma, n)
                for n, rows in zip(_N, self.rates, strict=True)
                for sigma, rho in zip(_SIGMA, rows, strict=True)
            ]
        )
        distinct = is_distinct(omega)
        self.omega = omega[distinct]
        self.places = distinct.reshape(self.rates.shape)  # which of all are points
        self.points = np.argwhere(self.places)

    def hysteresis(self, point: int) -> Hysteresis:
        """The parameters of a grid point."""
        n, sigma, share = self.points[point].tolist()
        return Hysteresis(float(self.rates[n, sigma, share]), _SIGMA[sigma], _N[n])

    def best(self, degrees: tuple[int, int]) -> Solution | None:
        """The grid point with the least squared misfit for these degrees."""
        if not self.points.size:
            return None
        loops = self.loops
        basis = Basis(*loops.reach, *degrees)
        columns = basis.columns(loops.displacement)
        misfits = self._misfits(columns)
        pick = int(np.argmin(misfits))
        if not np.isfinite(misfits[pick]):
            return None
        backbone = fit_backbone(loops, columns, self.omega[pick])
        if backbone is None:
            return None
        return Solution(basis, backbone, self.hysteresis(pick), self.omega[pick], _SHARES[self.points[pick, 2]])

    def minima(self, columns: Columns) -> list[Hysteresis]:
        """Grid points with less misfit than their neighbours in n and share, each with its best sigma."""
        if not self.points.size:
            return []
        places = self.places
        misfits, numbers = np.full(places.shape, np.inf), np.zeros(places.shape, np.intp)
        misfits[places], numbers[places] = self._misfits(columns), np.arange(len(self.points))
        sigmas = misfits.argmin(axis=1, keepdims=True)
        best = np.take_along_axis(numbers, sigmas, 1)[:, 0]
        surface = np.full((len(_N) + 2, len(_SHARES) + 2), np.inf)
        inner = surface[1:-1, 1:-1]
        inner[:] = misfits.min(axis=1)
        around = np.lib.stride_tricks.sliding_window_view(surface, (3, 3)).min(axis=(2, 3))
        least = np.argwhere(np.isfinite(inner) & (inner <= around)).tolist()
        return [self.hysteresis(best[n, share]) for n, share in sorted(least, key=lambda at: float(inner[tuple(at)]))]

    def _misfits(self, columns: Columns) -> FloatArray:
        """Squared misfit of every grid point; inf where the equations are singular."""
        loops = self.loops
        root = np.sqrt(loops.weight)
        return _squared_misfits(
            columns.elastic * root[:, None], columns.amplifier * root[:, None], self.omega, loops.force * root
        )


def _squared_misfits(elastic: FloatArray, amplifier: FloatArray, omega: FloatArray, target: FloatArray) -> FloatArray:
    """Squared misfit of linear least squares for each row of omega, by the normal equations: accurate enough to rank.

    Parameters
    ----------
    elastic, amplifier : ndarray, shapes (P, N + 1), (P, M + 1)   Weighted basis functions.
    omega : ndarray, shape (G, P)
    target : ndarray, shape (P,)                                  Weighted force.

    Returns
    -------
    ndarray, shape (G,)   inf where the equations are singular.
    """
    n_E, n_A = elastic.shape[1], amplifier.shape[1]
    # The products of basis functions serve all rows: one matrix product each gives all normal matrices.
    cross = omega @ (elastic[:, :, None] * amplifier[:, None, :]).reshape(-1, n_E * n_A)
    square = (omega**2) @ (amplifier[:, :, None] * amplifier[:, None, :]).reshape(-1, n_A * n_A)
    normal = np.empty((omega.shape[0], n_E + n_A, n_E + n_A))
    normal[:, :n_E, :n_E] = elastic.T @ elastic
    normal[:, :n_E, n_E:] = cross.reshape(-1, n_E, n_A)
    normal[:, n_E:, :n_E] = normal[:, :n_E, n_E:].transpose(0, 2, 1)
    normal[:, n_E:, n_E:] = square.reshape(-1, n_A, n_A)
    right = np.empty((omega.shape[0], n_E + n_A))
    right[:, :n_E] = elastic.T @ target
    right[:, n_E:] = omega @ (amplifier * target[:, None])
    regular = np.linalg.det(normal) != 0.0
    normal[~regular] = np.eye(n_E + n_A)
    coefficients = np.linalg.solve(normal, right[:, :, None])
    # The sum of squares as a function of the coefficients, whose own rounding does not count at the minimum.
    explained = coefficients[:, :, 0] * (2.0 * right - (normal @ coefficients)[:, :, 0])
    return np.where(regular, target @ target - explained.sum(axis=1), np.inf)
