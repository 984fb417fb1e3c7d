"""95 % intervals of kappa_omega, rho, sigma and n, open on the side on which the records do not bound a parameter.

The logarithm of each is Student-distributed where it is well known. Where it is not, or where it lies at a bound, the
profile of the squared misfit takes the place of the normal approximation: all other coefficients are fitted again at
fixed values of the one, to where the misfit has risen by as much as it would at the end of the interval if the force
depended linearly on the coefficients.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from ...kernel.arrays import FloatArray
from ..least_squares.linearised import Linearised
from ..least_squares.projection import Problem, vector
from ..least_squares.stages import SIGMA_BOUNDS, Hysteresis

Interval = tuple[float | None, float | None]

NONLINEAR = ("rho", "sigma", "n")
# Standard error of a logarithm from which the profile is computed.
_CURVED = 0.1
_LONGEST_STEP = 1.0  # of a logarithm
_EVALUATIONS = 8  # points of a profile on either side
_NEAR = 0.3  # change of the logarithms up to which they are extrapolated along a profile
_ACCURACY = 0.03  # to which the end of an interval is found, share of its length
_TOLERANCE = 1e-5  # relative change of the squared misfit at which a fit of the profile ends
_FIT_EVALUATIONS = 20  # points at which a fit of the profile ends in any case
_UNKNOWN = 50.0  # reach of a logarithm from which nothing is known of its parameter
_AT_BOUND = 1e-3  # distance of a logarithm from the bound of the search that counts as none
NORMAL_95 = 1.959964  # 97.5 % quantile


def student_95(degrees_of_freedom: FloatArray) -> FloatArray:
    """97.5 % quantile of Student's distribution with 4 degrees of freedom or more (Abramowitz and Stegun 26.7.5)."""
    nu, z = degrees_of_freedom, NORMAL_95
    return np.asarray(z + (z**3 + z) / (4.0 * nu) + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * nu**2))


def quantile_95(degrees_of_freedom: FloatArray) -> FloatArray:
    """The same over the distribution's standard deviation."""
    return np.asarray(student_95(degrees_of_freedom) * np.sqrt((degrees_of_freedom - 2.0) / degrees_of_freedom))


def intervals_95(linear: Linearised, change: FloatArray, errors: FloatArray) -> dict[str, Interval]:
    """The intervals by name.

    Parameters
    ----------
    linear : Linearised
    change : ndarray, shape (4, p)   Derivatives of the logarithms of kappa_omega, rho, sigma, n by the coefficients.
    errors : ndarray, shape (4,)     Standard errors of the logarithms; 0 at a bound.
    """
    fit = linear.refinement
    reach = quantile_95(linear.estimate.degrees_of_freedom(change)) * errors
    kappa_omega = float(linear.basis.powers(fit.backbone.amplified)[0])
    intervals: dict[str, Interval] = {"kappa_omega": around(kappa_omega, float(reach[0]))}
    refit = _Refit(linear)
    for k, name in enumerate(NONLINEAR):
        value = getattr(fit.hysteresis, name)
        if linear.free[k] and errors[1 + k] <= _CURVED:
            intervals[name] = around(value, float(reach[1 + k]))
            continue
        if linear.further is not None:  # a wider class has no profile
            intervals[name] = around(value, float(reach[1 + k])) if linear.free[k] else (None, None)
            continue
        freed = linear if linear.free[k] else linear.freed(k)
        intervals[name] = _Profile(freed, k, refit).interval(value)
    low, high = intervals["sigma"]
    # What no spring can be is not part of the interval.
    intervals["sigma"] = (SIGMA_BOUNDS[0] if low is None else max(low, SIGMA_BOUNDS[0]), high)
    return intervals


def around(value: float, reach: float) -> Interval:
    """The interval of a logarithm known to so much; open where that is nothing."""
    if reach > _UNKNOWN:
        return None, None
    return value * math.exp(-reach), value * math.exp(reach)


class _Refit:
    """The fit again from other places, with one nonlinear coefficient fixed."""

    def __init__(self, linear: Linearised) -> None:
        self.fit = linear.refinement
        self._linear = linear

    @cached_property
    def problem(self) -> Problem:
        """The least-squares problem."""
        return Problem(self._linear.loops, self._linear.basis, self.fit.hysteresis, coarse=True)

    @cached_property
    def place(self) -> FloatArray:
        """The fit's ln(rho), ln(sigma), ln(n) and omega_start, shape (3 + R,)."""
        return vector(self.fit.hysteresis, self.fit.omega_start)

    @cached_property
    def least(self) -> float:
        """Sum of squared weighted misfits with nothing fixed."""
        return self._squares(self.place)[0]

    def with_fixed(self, parameter: int, value: float, start: FloatArray) -> tuple[float, FloatArray]:
        """The same with one of the coefficients fixed, and where all of them are then."""
        low, high = self.problem.low, self.problem.high
        free = low[parameter], high[parameter]
        low[parameter] = high[parameter] = value
        minimum = self._squares(start)
        low[parameter], high[parameter] = free
        return minimum

    def _squares(self, start: FloatArray) -> tuple[float, FloatArray]:
        hysteresis = Hysteresis(*np.exp(start[:3]).tolist())
        fit = self.problem.solve(hysteresis, start[3:], self.fit.weight, _TOLERANCE, _FIT_EVALUATIONS)
        misfit = fit.backbone.misfit(self.problem.loops.force, fit.omega)
        return float(self.fit.weight @ misfit**2), vector(fit.hysteresis, fit.omega_start)


class _Profile:
    """Rise of the squared misfit with one nonlinear coefficient, all others being fitted."""

    def __init__(self, linear: Linearised, parameter: int, refit: _Refit) -> None:
        self.parameter, self.refit = parameter, refit
        column = linear.column(parameter)
        direction = np.zeros(linear.jacobian.shape[1])
        direction[column] = 1.0
        self.error = float(np.linalg.norm(linear.root[column]))
        self.reach = float(quantile_95(linear.estimate.degrees_of_freedom(direction[None]))[0]) * self.error
        weighted = linear.weighted(refit.fit.weight)
        covariance = np.linalg.pinv(weighted.T @ weighted)[column]
        free_variance = float(covariance[column])
        # Where the misfit does not depend on the coefficient at all, nothing bounds it.
        self.allowed = self.reach**2 / free_variance if self.reach > 0.0 and free_variance > 0.0 else math.inf
        # Where the others go with it, as far as the force depends linearly on them.
        self.slope = np.zeros(refit.place.size)
        if free_variance > 0.0:
            self.slope[:3][linear.free] = covariance[linear.linear_count :] / free_variance

    def interval(self, value: float) -> Interval:
        """The ends; None on a side on which the bound of the search is reached first."""
        if math.isinf(self.allowed):
            return None, None
        center = math.log(value)
        if self.error <= _CURVED:
            low, high = around(value, self.reach)
        else:
            low, high = (self._end(center, side) for side in (-1, 1))
        return low if self._room(center, -1) > 0.0 else None, high if self._room(center, 1) > 0.0 else None

    def _room(self, center: float, side: int) -> float:
        """How far the logarithm may move to a side; 0 at the bound of the search."""
        problem = self.refit.problem
        bound = float((problem.low if side < 0 else problem.high)[self.parameter])
        room = side * (bound - center)
        return room if room > _AT_BOUND else 0.0

    def _end(self, center: float, side: int) -> float | None:
        """The end on one side; None if the misfit does not rise enough up to the bound of the search."""
        room = self._room(center, side)
        if room == 0.0:
            return None
        inside, outside, rise_inside, rise_outside = 0.0, math.inf, 0.0, 0.0
        step = min(self.reach, _LONGEST_STEP, room)
        place, slope, at = self.refit.place, side * self.slope, 0.0
        for _ in range(_EVALUATIONS):
            # The others go on as they went before, but not far: another minimum might be there.
            ahead = (step - at) * slope
            start = place + ahead if np.abs(ahead[:3]).max() <= _NEAR else place
            squares, there = self.refit.with_fixed(self.parameter, center + side * step, start)
            place, slope, at = there, (there - place) / (step - at), step
            # The root of the rise is nearly a straight line.
            rise = math.sqrt(max(squares - self.refit.least, 0.0) / self.allowed)
            if rise >= 1.0:
                outside, rise_outside = step, rise
            else:
                inside, rise_inside = step, rise
                if step >= room * (1.0 - 1e-9):
                    return None
            if math.isinf(outside):
                step = min(room, step + min(_LONGEST_STEP, max(0.5 * step, step * (1.0 / max(rise, 0.3) - 1.0))))
                continue
            share = (1.0 - rise_inside) / (rise_outside - rise_inside)
            step = inside + (outside - inside) * min(max(share, 0.1), 0.9)
            if outside - inside < _ACCURACY * outside or abs(rise - 1.0) < _ACCURACY:
                break
        return None if math.isinf(outside) else math.exp(center + side * step)
