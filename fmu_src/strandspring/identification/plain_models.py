"""Three plain models of hysteresis, fitted to the samples that the spring is fitted to: is it better than these?

Each predicts the force at all rows of `Samples` once for every fold, from displacements and times and from the force
at the rows beside the fold alone; those choose the few parameters of its coarse grid too. The path is the recorded
one, and the memory of Bouc-Wen and Prandtl-Ishlinskii is zero where a record begins. F is the number of folds, P that
of rows.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from ..kernel.arrays import BoolArray, FloatArray
from .constrained import nonnegative
from .samples import Samples


def bouc_wen(samples: Samples) -> FloatArray:
    """Linear spring, offset, dashpot and the hysteresis of Bouc and Wen, shape (F, P) [N].

    r = c_0 + c_1*x + c_2*v + kappa*omega(rho, sigma, n), without a dashpot where there are no times. Y.-K. Wen, Method
    for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102, 1976, 249. Of a grid of rho, sigma and n
    that point is taken whose c and kappa leave least.
    """
    others = _linear_columns(samples)
    rates = np.geomspace(0.7, 90.0, 14) / _half(samples)
    shapes = product((0.55, 1.0, 2.0), (0.2, 0.5, 1.0, 2.0))
    omegas = np.concatenate([samples.points.omega_by_rate(rates, *shape) for shape in shapes])

    def predicted(kept: BoolArray) -> FloatArray:
        basis = np.linalg.qr(others[kept])[0]
        beside = omegas[:, kept] - omegas[:, kept] @ basis @ basis.T
        gains = np.maximum(beside @ samples.r[kept], 0.0) ** 2 / np.maximum(np.sum(beside**2, axis=1), 1e-12)
        columns = np.column_stack([others, omegas[int(np.argmax(gains))]])
        return np.asarray(columns @ np.linalg.lstsq(columns[kept], samples.r[kept], rcond=None)[0])

    return _of_folds(samples, predicted)


def prandtl_ishlinskii(samples: Samples) -> FloatArray:
    """Polynomial of degree 3 and stop operators whose weights are 0 or above, shape (F, P) [N].

    P. Krejci, Hysteresis, Convexity and Dissipation in Hyperbolic Equations, 1996, ch. II. Thresholds grow
    geometrically from a share of half the shortest stroke to nine tenths of half the longest.
    """
    half = _half(samples)
    y = (samples.x - samples.x.mean()) / half
    halves = 0.5 * np.abs(np.diff(samples.displacement[samples.strokes], axis=1))
    # A record may begin or end amid a stroke.
    shortest, longest = np.quantile(halves, [0.05, 1.0]).tolist()
    stops = stop_operators(samples, np.geomspace(max(0.01 * shortest, 1e-4 * half), 0.9 * longest, 16))
    columns = np.column_stack([y[:, None] ** np.arange(4), stops / stops.std(axis=0)])
    free = np.arange(columns.shape[1]) < 4

    def predicted(kept: BoolArray) -> FloatArray:
        A = columns[kept]
        G = A.T @ A
        # Normal equations that are solvable.
        G += 1e-9 * G.max() * np.eye(free.size)
        return np.asarray(columns @ nonnegative(G, A.T @ samples.r[kept], free)[0])

    return _of_folds(samples, predicted)


def kernel_regression(samples: Samples) -> FloatArray:
    """Linear trend, and means of what it leaves at like states, weighted by a Gaussian kernel, shape (F, P) [N].

    E. A. Nadaraya, On estimating regression, and G. S. Watson, Smooth regression analysis, both 1964. The state is the
    displacement, the direction, the displacements at the last two reversals and, where there are times, the speed. The
    bandwidths are those with the least mean error at the rows of each stroke predicted from the others.
    """
    half, others, held = _half(samples), _linear_columns(samples), samples.folds
    stroke = samples.stroke_of_row
    begins, ends = samples.displacement[samples.strokes].T
    record = np.searchsorted(samples.begins, samples.strokes[:, 0], side="right")
    before = np.where(np.diff(record, prepend=-1) == 0, np.roll(begins, 1), begins)
    distances = [_squared(samples.x / half), _squared(begins[stroke] / half) + _squared(before[stroke] / half)]
    distances += [_squared(column) for column in others.T[2:]]
    direction = np.sign(ends - begins)[stroke]
    same_direction = (direction[:, None] == direction).astype(np.float32)
    other_stroke = (stroke[:, None] != stroke).astype(np.float32)
    kept, measured = ~held.T, samples.r[:, None]
    trends = np.empty(kept.shape)
    for k, rows in enumerate(kept.T):
        trends[:, k] = others @ np.linalg.lstsq(others[rows], samples.r[rows], rcond=None)[0]
    known = np.hstack([np.where(kept, measured - trends, 0.0), kept]).astype(np.float32)

    def means(weights: FloatArray) -> FloatArray:
        """Predictions, the trend alone where no state is alike."""
        sums, total = np.split((weights @ known).astype(np.float64), 2, axis=1)
        return trends + sums / (total + 1e-6)

    least, predicted = np.full(len(held), np.inf), trends
    # Of displacement, of reversals and of speed, over half the range and the largest speed.
    for bandwidths in ((0.015, 0.3, 0.05), (0.03, 0.3, 0.03), (0.06, 0.3, 0.05)):
        exponents = sum(d * np.float32(-0.5 / b**2) for d, b in zip(distances, bandwidths, strict=False))
        weights = np.exp(exponents) * same_direction
        errors = np.sum(np.where(kept, np.abs(means(weights * other_stroke) - measured), 0.0), axis=0)
        predicted = np.where(errors < least, means(weights), predicted)
        least = np.minimum(errors, least)
    return predicted.T


PLAIN_MODELS = {
    "Bouc-Wen with dashpot": bouc_wen,
    "Prandtl-Ishlinskii": prandtl_ishlinskii,
    "kernel regression": kernel_regression,
}


def held_out(samples: Samples) -> dict[str, FloatArray]:
    """Predicted minus measured force of each plain model over the force's deviation, nan but in the fold, shape (F, P).

    The means of the squares over each row are comparable with `Judged.errors`.
    """
    deviation = float(np.std(samples.r)) or 1.0
    return {
        name: np.where(samples.folds, (model(samples) - samples.r) / deviation, np.nan)
        for name, model in PLAIN_MODELS.items()
    }


def _of_folds(samples: Samples, predicted: Callable[[BoolArray], FloatArray]) -> FloatArray:
    """What is predicted for each fold from the other rows, shape (F, P)."""
    return np.array([predicted(~fold) for fold in samples.folds]).reshape(-1, samples.x.size)


def stop_operators(samples: Samples, thresholds: FloatArray) -> FloatArray:
    """Each follows the displacement within +-threshold, 0 where a record begins, shape (P, J) [m]."""
    stops = []
    for k, record in enumerate(samples.records):
        path, rows = record.displacement, samples.rows[samples.record_of_row == k] - samples.begins[k]
        # Between changes of direction the order of steps and clipping does not matter.
        turns = np.flatnonzero(np.diff(np.sign(np.diff(path)))) + 1
        at = np.union1d(rows, np.append(turns, 0))
        state, states = np.zeros(thresholds.size), np.empty((at.size, thresholds.size))
        for i, step in enumerate(np.diff(path[at], prepend=path[0]).tolist()):
            state = np.minimum(np.maximum(state + step, -thresholds), thresholds)
            states[i] = state
        stops.append(states[np.searchsorted(at, rows)])
    return np.concatenate(stops)


def _half(samples: Samples) -> float:
    """Half the range of the displacement [m]."""
    return 0.5 * float(np.ptp(samples.x))


def _linear_columns(samples: Samples) -> FloatArray:
    """1, the displacement and, where there are times, the speed, all of the order of 1, shape (P, 2 or 3)."""
    columns = [np.ones(samples.x.size), (samples.x - samples.x.mean()) / _half(samples)]
    if samples.is_timed:
        # A Maxwell branch of a short time constant is a dashpot; differences of neighbouring samples would be noise.
        speed = samples.maxwell(0.01 * samples.cycle_time)
        columns.append(speed[0] / (np.abs(speed[0]).max() or 1.0))
    return np.column_stack(columns)


def _squared(values: FloatArray) -> FloatArray:
    """Squared differences of all pairs, shape (P, P), single precision."""
    single = values.astype(np.float32)
    return np.asarray((single[:, None] - single) ** 2)
