"""Bounded nonlinear least squares in a few parameters: the trust-region reflective algorithm.

Branch, Coleman and Li, SIAM J. Sci. Comput. 21, 1999, in the form of SciPy's `least_squares(method="trf",
x_scale="jac")`, whose steps these are: Gauss-Newton steps within an ellipsoid, in variables that are scaled by the
distance to the bound towards which the gradient points; a step that meets a bound is shortened, reflected, or replaced
by one along the gradient, whichever promises most. The Jacobian J = QR enters as R alone, so that a step costs the
same for any number of residuals. Variables without effect take no part in a step, so that steps are not damped for
their sake, as SciPy's are. SciPy's optimizers take longer to import than a whole identification.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from ..kernel.arrays import FloatArray

_NEGLIGIBLE = 0.1  # share of the tolerance up to which a step that promises so little is not tried
_XTOL = 1e-12  # relative length of a step at which the iteration ends
_GTOL = 1e-14  # gradient at which it ends
_RADIUS_TOLERANCE = 0.01  # share of the trust radius to which a step's length is matched to it
_RADIUS_ITERATIONS = 10


class Point(Protocol):
    """What is evaluated at one x."""

    @property
    def cost(self) -> float:
        """Half the sum of squares of the residuals."""

    def triangle(self) -> FloatArray:
        """Upper triangle R of the QR decomposition of [J, residuals], shape (n + 1, n + 1)."""


P = TypeVar("P", bound=Point)


class _Model(NamedTuple):
    """Quadratic model s.H.s/2 + g.s of the cost in the scaled variables."""

    hessian: FloatArray
    gradient: FloatArray

    def value(self, s: FloatArray) -> float:
        return float(0.5 * (s @ self.hessian @ s) + self.gradient @ s)

    def least_along(
        self, s: FloatArray, low: float, high: float, origin: FloatArray | None = None
    ) -> tuple[float, float]:
        """Stride within [low, high] along s from the origin with the least value, and that value."""
        curvature, slope, constant = 0.5 * float(s @ self.hessian @ s), float(self.gradient @ s), 0.0
        if origin is not None:
            slope += float(origin @ self.hessian @ s)
            constant = self.value(origin)
        strides = [low, high]
        if curvature != 0.0 and low < -0.5 * slope / curvature < high:
            strides.append(-0.5 * slope / curvature)
        value, stride = min((t * (curvature * t + slope) + constant, t) for t in strides)
        return stride, value


def minimise(
    evaluate: Callable[[FloatArray], P],
    start: FloatArray,
    low: FloatArray,
    high: FloatArray,
    samples: int,
    tolerance: float,
    evaluations: int,
) -> tuple[FloatArray, P, bool]:
    """Minimise a sum of squares within bounds: best x, the point there, and whether it is a minimum.

    It is none where the evaluations were used up.

    Parameters
    ----------
    evaluate : callable              The point at x.
    start, low, high : ndarray, shape (n,)   start strictly within the bounds.
    samples : int                    Number of residuals.
    tolerance : float                Relative change of the cost at which the iteration ends.
    evaluations : int                At most so many points are evaluated.
    """
    n = start.size
    inner_low, inner_high = np.nextafter(low, high), np.nextafter(high, low)
    x, point, count = start.copy(), evaluate(start), 1
    scale_inverse, radius, damping = np.zeros(n), 0.0, 0.0
    while True:
        triangle = point.triangle()
        R, reduced = triangle[:n, :n], triangle[:n, n]
        gradient = R.T @ reduced
        norms = np.sqrt((R * R).sum(axis=0))
        if not scale_inverse.any():
            norms[norms == 0.0] = 1.0
        scale_inverse = np.maximum(norms, scale_inverse)
        # Coleman-Li scaling: the distance to the bound towards which the cost falls.
        room = np.where(gradient < 0.0, high - x, np.where(gradient > 0.0, x - low, 1.0))
        optimality = float(np.abs(gradient * room).max())
        room = np.where(gradient != 0.0, room * scale_inverse, room)
        if radius == 0.0:
            radius = _norm(start * scale_inverse / np.sqrt(room)) or 1.0
        if optimality < _GTOL:
            return x, point, True
        if count == evaluations:
            return x, point, False
        d = np.sqrt(room) / scale_inverse
        barrier = np.abs(gradient) / scale_inverse
        scaled = R * d
        model = _Model(scaled.T @ scaled + np.diag(barrier), d * gradient)
        u, singular, vt = np.linalg.svd(np.vstack([scaled, np.diag(np.sqrt(barrier))]), full_matrices=False)
        rotated = u[:n].T @ reduced
        back = max(0.995, 1.0 - optimality)  # how far towards a bound a step may go
        reduction = -1.0
        while reduction <= 0.0 and count < evaluations:
            newton, damping = _within_radius(rotated, singular, vt.T, radius, damping, samples)
            step, predicted = _inside_bounds(x, newton, d, model, radius, low, high, back)
            if damping == 0.0 and 0.0 <= predicted < _NEGLIGIBLE * tolerance * point.cost:
                return x, point, True
            trial_x = np.clip(x + d * step, inner_low, inner_high)
            trial = evaluate(trial_x)
            count += 1
            length = _norm(step)
            if not math.isfinite(trial.cost):
                radius = 0.25 * length
                continue
            reduction = point.cost - trial.cost
            ratio = reduction / predicted if predicted > 0.0 else float(predicted == reduction == 0.0)
            if (reduction < tolerance * point.cost and ratio > 0.25) or _norm(d * step) < _XTOL * (_XTOL + _norm(x)):
                return (trial_x, trial, True) if reduction > 0.0 else (x, point, True)
            before = radius
            if ratio < 0.25:
                radius = 0.25 * length
            elif ratio > 0.75 and length > 0.95 * radius:
                radius *= 2.0
            damping *= before / radius
        if reduction > 0.0:
            x, point = trial_x, trial


def _norm(vector: FloatArray) -> float:
    """As `numpy.linalg.norm`, which takes some times as long for a few numbers."""
    return math.sqrt(vector @ vector)


def _within_radius(
    rotated: FloatArray, singular: FloatArray, v: FloatArray, radius: float, damping: float, samples: int
) -> tuple[FloatArray, float]:
    """The Gauss-Newton step, damped to the trust radius if it is longer (More 1977); and the damping."""
    # What has no effect on the residuals, such as the memory of a stroke that is left out, takes no part in the step.
    felt = singular > np.finfo(float).eps * samples * singular[0]
    singular, rotated, v = singular[felt], rotated[felt], v[:, felt]
    step = -v @ (rotated / singular)
    if _norm(step) <= radius:
        return step, 0.0
    product = singular * rotated

    def excess(alpha: float) -> tuple[float, float]:
        denominator = singular**2 + alpha
        length = _norm(product / denominator)
        return length - radius, -float(np.sum(product**2 / denominator**3)) / length

    high = _norm(product) / radius
    value, slope = excess(0.0)
    low = -value / slope
    alpha = damping
    for _ in range(_RADIUS_ITERATIONS):
        if not low <= alpha <= high:
            alpha = max(0.001 * high, np.sqrt(low * high))
        value, slope = excess(alpha)
        if value < 0.0:
            high = alpha
        low = max(low, alpha - value / slope)
        alpha -= (value + radius) * value / slope / radius
        if abs(value) < _RADIUS_TOLERANCE * radius:
            break
    step = -v @ (product / (singular**2 + alpha))
    return step * (radius / _norm(step)), float(alpha)


def _inside_bounds(
    x: FloatArray,
    step: FloatArray,
    d: FloatArray,
    model: _Model,
    radius: float,
    low: FloatArray,
    high: FloatArray,
    back: float,
) -> tuple[FloatArray, float]:
    """The best of the step shortened, reflected at the bound it meets, and along the gradient; its reduction."""
    moved = x + d * step
    if ((moved >= low) & (moved <= high)).all():
        return step, -model.value(step)
    stride, hits = _to_bound(x, d * step, low, high)
    on_bound = stride * step
    reflected = np.where(hits, -step, step)
    candidates = []
    to_radius = _to_radius(on_bound, reflected, radius)
    to_bound, _ = _to_bound(x + d * on_bound, d * reflected, low, high)
    reach = min(to_bound, to_radius)
    if reach > 0.0:
        least, most = (1.0 - back) * stride / reach, back * to_bound if reach == to_bound else to_radius
        if least <= most:
            length, value = model.least_along(reflected, least, most, on_bound)
            candidates.append((value, on_bound + length * reflected))
    shortened = back * on_bound
    candidates.append((model.value(shortened), shortened))
    downhill = -model.gradient
    to_radius = radius / _norm(downhill)
    to_bound, _ = _to_bound(x, d * downhill, low, high)
    length, value = model.least_along(downhill, 0.0, back * to_bound if to_bound < to_radius else to_radius)
    candidates.append((value, length * downhill))
    value, best = min(candidates, key=lambda candidate: candidate[0])
    return best, -value


def _to_bound(x: FloatArray, step: FloatArray, low: FloatArray, high: FloatArray) -> tuple[float, FloatArray]:
    """Multiple of a step at which it meets a bound, and which variables meet theirs."""
    with np.errstate(divide="ignore", invalid="ignore"):
        strides = np.where(step != 0.0, np.maximum((low - x) / step, (high - x) / step), np.inf)
    stride = float(strides.min())
    return stride, strides == stride


def _to_radius(origin: FloatArray, direction: FloatArray, radius: float) -> float:
    """Multiple of a direction at which it leaves the trust region."""
    a, b = float(direction @ direction), float(origin @ direction)
    c = float(origin @ origin) - radius**2
    q = -(b + math.copysign(math.sqrt(max(b * b - a * c, 0.0)), b))
    return max(q / a, c / q)
