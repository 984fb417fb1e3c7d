"""Nonlinear least squares in a few variables between bounds, by Gauss-Newton steps within a trust region.

A step minimises |r + J s| among those no longer than a radius (More, Lecture Notes in Mathematics 630, 1978), each
variable being scaled by the greatest length so far of its column of J. A step that leaves the bounds goes as far as the
first it meets. That variable stays there, and the rest of the way leads to the step that follows anew for the others.
Combinations without effect on r take no part in a step.

Beside the variables that all of r depends on, there may be many own ones of parts of it, whose columns are orthogonal
to each other. They follow the others by elimination, so that the effort is proportional to their number, and may move
as far as the radius allows the others.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from ...kernel.arrays import FloatArray

_FIRST_STEP = 3.0  # by which each variable may move to begin with: a logarithm by a factor of 20
_NEGLIGIBLE = 0.1  # share of the tolerance: a full step that promises no more than this is not tried
_SHORTEST = 1e-12  # relative length of a step at which the iteration ends
_RADIUS_TOLERANCE = 0.01  # share of the radius by which a step may be longer, and that is left to the last variables
_RADIUS_ITERATIONS = 10
_UNFELT = 1e-100  # length of a scaled combination that has no effect, lest its square be 0
_BLOCK = 1024  # rows that are decomposed together, which stay in the cache
_LEAST = 1e-12  # of the square of a direction is left beside the columns of own variables


class Reduced(NamedTuple):
    """Residuals r about a point, as a linear problem in few rows.

    Attributes
    ----------
    J : ndarray, shape (k, v)            Derivatives by the variables that all of r depends on, in any rotation in which
    r : ndarray, shape (k,)              these and r take k rows.
    length : ndarray, shape (w,)         Of the column of each own variable.
    along : ndarray, shape (w, m + k)    Unit vectors along these columns in m directions in which r is free to change,
                                         and in those of the k rows; what lies beside them is not needed.
    """

    J: FloatArray
    r: FloatArray
    length: FloatArray
    along: FloatArray

    @classmethod
    def without_own(cls, triangle: FloatArray) -> Reduced:
        """All of r depends on every variable: their columns and r, in k rows."""
        return cls(triangle[:, :-1], triangle[:, -1], np.zeros(0), np.zeros((0, triangle.shape[0])))


class Trial(Protocol):
    """The problem at one point."""

    squares: float  # sum of squared residuals r

    def reduced(self) -> Reduced:
        """The linear problem about the point."""


AnyTrial = TypeVar("AnyTrial", bound=Trial)


def minimise(
    evaluate: Callable[[FloatArray], AnyTrial],
    start: FloatArray,
    low: FloatArray,
    high: FloatArray,
    tolerance: float,
    evaluations: int,
) -> tuple[FloatArray, AnyTrial, bool]:
    """The point with the least sum of squared residuals that is reached from a start.

    Parameters
    ----------
    evaluate : callable               The problem at a point of shape (v + w,), own variables last.
    start : ndarray, shape (v + w,)   Is moved between the bounds.
    low, high : ndarray, shape (v + w,)   Where they cross, as they may by rounding, the variable stays at `low`.
    tolerance : float                 Relative change of the sum at which the iteration ends.
    evaluations : int                 At which it ends in any case.

    Returns
    -------
    point : ndarray, shape (v + w,)
    trial : Trial                     The problem there.
    converged : bool                  Whether it is a minimum: there is none where evaluations were used up.
    """
    high = np.maximum(low, high)
    x = start.clip(low, high)
    best, count = evaluate(x), 1
    scale: FloatArray | float = 0.0
    radius = 0.0
    while True:
        reduced = best.reduced()
        scale = np.maximum(scale, np.linalg.norm(reduced.J, axis=0))
        unit = np.where(scale > 0.0, scale, 1.0)
        radius = radius or _FIRST_STEP * float(np.linalg.norm(unit))
        is_better = False
        while not is_better:
            if count == evaluations:
                return x, best, False
            step, is_full, promised = _joint_step(reduced, unit, radius, low - x, high - x)
            if is_full and promised <= _NEGLIGIBLE * tolerance * best.squares:
                return x, best, True
            point = (x + step).clip(low, high)
            trial = evaluate(point)
            count += 1
            shared, own = np.split(step, [unit.size])
            length = max(
                float(np.linalg.norm(unit * shared)), float(np.linalg.norm(unit) * np.max(np.abs(own), initial=0.0))
            )
            gain = best.squares - trial.squares
            is_fair, is_better = gain > 0.25 * promised, gain > 0.0
            ends = (gain < tolerance * best.squares and is_fair) or np.linalg.norm(
                point - x
            ) < _SHORTEST * np.linalg.norm(x)
            if not is_fair:
                radius = 0.25 * length
            elif gain > 0.75 * promised and length > 0.95 * radius:
                radius *= 2.0
            if is_better:
                x, best = point, trial
            if ends:
                return x, best, True


def triangle_of(matrix: FloatArray) -> FloatArray:
    """R of the QR decomposition of a tall matrix, block by block."""
    rows, columns = matrix.shape
    blocks = rows // _BLOCK
    if blocks > 1:
        cut = blocks * _BLOCK
        parts = np.asarray(np.linalg.qr(matrix[:cut].reshape(blocks, _BLOCK, columns), mode="r"))
        matrix = np.concatenate([parts.reshape(-1, columns), matrix[cut:]])
    return np.asarray(np.linalg.qr(matrix, mode="r"))


def _joint_step(
    at: Reduced, unit: FloatArray, radius: float, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, bool, float]:
    """The step of all variables between bounds, whether the radius leaves it as it is, and the gain that it promises.

    With z the coordinates of the residuals, s of the own variables in their unit vectors h, the sum of squares is
    z'z + 2*s'h*z + s's. Own variables that are not at a bound take s = -h*z.
    """
    J, r, length, along = at
    if not length.size:
        step, is_full = _step(J / unit, r, radius, low * unit, high * unit)
        z = r + J @ (step / unit)
        return step / unit, is_full, float(r @ r - z @ z)
    size, (rows, shared) = along.shape[1], J.shape
    reach = radius / float(np.linalg.norm(unit))
    least, most = np.maximum(low[shared:], -reach), np.minimum(high[shared:], reach)
    own, free = np.zeros(length.size), length > 0.0
    while True:
        values, vectors = np.linalg.eigh(np.eye(size) - along[free].T @ along[free])
        root = np.asarray(np.linalg.qr((vectors * np.sqrt(np.maximum(values, _LEAST))).T, mode="r"))
        pull = np.linalg.solve(root.T, (length * own * ~free) @ along)
        top, bottom = np.split(root, [size - rows])
        wanted, is_full = _step(
            bottom[:, -rows:] @ (J / unit), bottom[:, -rows:] @ r + pull[-rows:], radius, low[:shared] * unit,
            high[:shared] * unit,
        )  # fmt: skip
        z = r + J @ (wanted / unit)
        free_part = np.linalg.solve(top[:, :-rows], -(top[:, -rows:] @ z) - pull[:-rows])
        z = np.concatenate([free_part, z])
        own[free] = -(along[free] @ z) / length[free]
        inside = (own >= least) & (own <= most)
        if inside[free].all():
            break
        own = own.clip(least, most)
        free &= inside
    sizes = length * own
    promised = float(r @ r - z @ z - sizes @ (2.0 * along @ z + sizes))
    return np.append(wanted / unit, own), is_full and bool(np.all(np.abs(own) < reach)), promised


def _step(J: FloatArray, r: FloatArray, radius: float, low: FloatArray, high: FloatArray) -> tuple[FloatArray, bool]:
    """The step between bounds, and whether the radius leaves it as it is."""
    step, is_full = np.zeros(low.size), True
    downhill = -J.T @ r
    free = ((downhill > 0.0) & (high > 0.0)) | ((downhill < 0.0) & (low < 0.0))
    for _ in range(int(free.sum())):  # each leaves one more at a bound
        wanted = np.where(free, 0.0, step)
        left = np.sqrt(max(radius**2 - float(wanted @ wanted), (_RADIUS_TOLERANCE * radius) ** 2))
        wanted[free], is_full = _within_radius(J[:, free], r + J @ wanted, left)
        is_outside = (wanted < low) | (wanted > high)
        if not is_outside.any():
            return wanted, is_full
        # Between the two |r + J s| falls all the way: it is convex, and least at the end.
        way, bound = wanted - step, wanted.clip(low, high)
        share = np.divide(bound - step, way, out=np.ones(way.size), where=is_outside)
        first = int(share.argmin())
        step = (step + share[first] * way).clip(low, high)
        step[first], free[first] = bound[first], False
    return step, is_full


def _within_radius(J: FloatArray, r: FloatArray, radius: float) -> tuple[FloatArray, bool]:
    """The Gauss-Newton step, damped to the radius if it is longer, and whether it is not."""
    turned, singular, turns = np.linalg.svd(J, full_matrices=False)
    felt = singular > max(np.finfo(np.float64).eps * _BLOCK * float(singular[0]), _UNFELT)
    squares, along = singular[felt] ** 2, (turned.T @ r)[felt] * singular[felt]
    damping = 0.0
    for _ in range(_RADIUS_ITERATIONS):
        part = along / (squares + damping)
        length = float(np.linalg.norm(part))
        if not length > (1.0 + _RADIUS_TOLERANCE) * radius:
            break
        damping += (length / radius - 1.0) * length**2 / float(part @ (part / (squares + damping)))
    return -radius / max(length, radius) * (part @ turns[felt]), damping == 0.0
