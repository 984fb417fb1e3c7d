"""Models of hysteresis other than the product's, fitted to records, for comparison in tests/benchmarks/held_out.py.

Each takes the parts of records that it may see, and returns a function that predicts the force along a record from its
displacement, its times and nothing else. What they are like inside is chosen from these parts alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls
from scipy.spatial.distance import cdist

from strandspring import Record, Spring, SpringParameters

Array = NDArray[np.float64]
Model = Callable[[Record], Array]  # the force along a record
ROWS = 1000  # about, that a model is fitted to


def turning_points(path: Array, share: float = 0.1) -> NDArray[np.intp]:
    """Samples where a path turns by more than a share of its range, and both its ends."""
    turns, direction, extreme, least = [0], 0, 0, share * np.ptp(path)
    for k, x in enumerate(path.tolist()):
        ahead = (x - path[extreme]) * direction
        if direction == 0:
            if abs(x - path[0]) > least:
                direction, extreme = (1 if x > path[0] else -1), k
        elif ahead >= 0.0:
            extreme = k
        elif ahead < -least:
            turns.append(extreme)
            direction, extreme = -direction, k
    return np.array([*turns, path.size - 1])


class Rows:
    """Samples of records that other models are fitted to, without the first stroke of a longer record."""

    def __init__(self, training: list[Record]) -> None:
        self.records, self._used, share = training, [], ROWS / sum(record.force.size for record in training)
        for record in training:
            turns = turning_points(record.displacement)
            begin = int(turns[1]) if turns.size > 7 else 0
            count = min(record.force.size - begin, math.ceil(share * record.force.size))
            self._used.append(np.linspace(begin, record.force.size - 1, count).astype(int))
        self.reach = max(float(np.ptp(record.displacement)) for record in training)
        self.level, self.scale = np.mean(self.of(lambda r: r.force)), np.std(self.of(lambda r: r.force))
        self.force = (self.of(lambda r: r.force) - self.level) / self.scale

    def of(self, columns: Callable[[Record], Array]) -> Array:
        return np.concatenate([columns(record)[used] for record, used in zip(self.records, self._used, strict=True)])

    def model(self, columns: Callable[[Record], Array], weights: Array) -> Model:
        return lambda record: self.level + self.scale * columns(record) @ weights


def bouc_wen(training: list[Record]) -> Model:
    """Force k x + c v + kappa omega + f0, with omega of rho, sigma and n."""
    rows, timed = Rows(training), all(record.time is not None for record in training)

    def columns(logs: Array, record: Record) -> Array:
        rho, sigma, n = np.exp(logs) + np.array([0.0, 0.5, 0.0])
        x = record.displacement / rows.reach
        spring = Spring(SpringParameters((0.0,), (1.0,), 1.0, rho, sigma, n, 0.0, -1.0, 1.0))
        parts = [np.ones(x.size), x, spring.omega(x)]
        if timed and record.time is not None:
            parts.append(np.gradient(x, record.time))
        return np.stack(parts, axis=1)

    def solution(logs: Array) -> tuple[Array, Array]:
        A = rows.of(partial(columns, logs))
        weights = np.linalg.lstsq(A, rows.force, rcond=None)[0]
        return weights, A @ weights - rows.force

    grid = [np.log([rho, sigma, n]) for rho in (2, 6, 20, 80) for sigma in (0.15, 1.2) for n in (0.4, 1.0, 2.5)]
    starts = sorted(grid, key=lambda logs: float(np.sum(solution(logs)[1] ** 2)))[:3]
    bounds = np.log([0.2, 0.001, 0.1]), np.log([2000.0, 20.0, 15.0])
    fits = [least_squares(lambda logs: solution(logs)[1], start, bounds=bounds, diff_step=1e-4) for start in starts]
    best = min(fits, key=lambda fit: float(fit.cost)).x
    return rows.model(partial(columns, best), solution(best)[0])


def memory(record: Record, reach: float) -> tuple[NDArray[np.intp], Array]:
    """The stroke of each sample; displacement, travel since the last turn, the stroke before (signed), direction."""
    x = record.displacement / reach
    turns = turning_points(x, 0.02)
    stroke = np.clip(np.searchsorted(turns, np.arange(x.size)) - 1, 0, turns.size - 2)
    before, last, following = (x[turns[np.maximum(stroke + k, 0)]] for k in (-1, 0, 1))
    return stroke, np.stack([x, x - last, last - before, np.sign(following - last)], axis=1)


def stops(training: list[Record]) -> Model:
    """Prandtl-Ishlinskii: stops of weights >= 0 whose limits are 12 shares of the longest stroke, and a cubic."""
    rows = Rows(training)
    limits = 0.5 * np.geomspace(0.005, 0.9, 12)  # a stop has turned over after twice its limit
    middle = np.mean(rows.of(lambda record: record.displacement))

    def columns(record: Record) -> Array:
        x = (record.displacement - middle) / rows.reach
        stopped = np.zeros((x.size, limits.size))
        for k, step in enumerate(np.diff(x).tolist()):
            stopped[k + 1] = np.minimum(np.maximum(stopped[k] + step, -limits), limits)
        powers = x[:, None] ** np.arange(4)
        return np.hstack([stopped / limits, powers, -powers])

    A = rows.of(columns)
    # Without a penalty large weights cancel within the range, and do not beyond it.
    penalty = math.sqrt(1e-4 * len(A)) * np.eye(A.shape[1])
    force = np.concatenate([rows.force, np.zeros(A.shape[1])])
    return rows.model(columns, nnls(np.vstack([A, penalty]), force, maxiter=5000)[0])


def kernels(training: list[Record]) -> Model:
    """Ridge regression on Gaussian kernels; widths and penalty by five folds, each of every fifth stroke."""
    rows = Rows(training)

    def features(record: Record) -> Array:
        x, travel, before, direction = memory(record, rows.reach)[1].T
        near = [np.sign(v) * np.log1p(np.abs(v) / 0.02) / 4.0 for v in (travel, before)]  # finer soon after a turn
        return np.stack([x, *near, direction], axis=1)

    points, folds = rows.of(features), rows.of(lambda record: memory(record, rows.reach)[0] % 5)
    centres = points[:: math.ceil(len(points) / 250)]

    def columns(widths: Array, record: Record) -> Array:
        return np.exp(-0.5 * cdist(features(record) / widths, centres / widths, "sqeuclidean"))

    def weights(A: Array, force: Array, penalty: float) -> Array:
        return np.linalg.solve(A.T @ A + penalty * len(A) * np.eye(A.shape[1]), A.T @ force)

    best: tuple[float, Array, Array] = math.inf, np.ones(4), np.zeros(len(centres))
    for place, travel, penalty in product((0.05, 0.15, 0.4, 1.0), (0.05, 0.15, 0.5, 2.0), (1e-6, 1e-4, 1e-2)):
        widths = np.array([place, travel, 2.0 * travel, 1.0])
        A, squares = rows.of(partial(columns, widths)), 0.0
        for fold in np.unique(folds):
            out = folds == fold
            squares += np.sum((A[out] @ weights(A[~out], rows.force[~out], penalty) - rows.force[out]) ** 2)
        if squares < best[0]:
            best = squares, widths, weights(A, rows.force, penalty)
    return rows.model(partial(columns, best[1]), best[2])
