"""The noise of a record's force from its fast changes: an additive part and one that grows with the force."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ...loops.noise_levels import Samples, across, noise_level

# Groups of like |force|, each with its own variance; many, because a median over unlike scales is too small.
_GROUPS = 24
_ROUNDS = 4  # of weighting
_GROUP_SAMPLES = 30  # a group has at least so many
_LEAST_DIFFERENCES = 86  # below which the noise is called additive


@dataclass(frozen=True)
class ForceNoise:
    """Standard deviation sqrt(additive^2 + (relative*force)^2) of one sample.

    Parameters
    ----------
    additive : float   [N]
    relative : float   Share of the force, eps of the paper's eq. (31) [-].
    """

    additive: float
    relative: float

    def variance(self, force: FloatArray) -> FloatArray:
        """Variance at each force [N^2]."""
        return np.asarray(self.additive**2 + (self.relative * force) ** 2)


def force_noise(force: FloatArray, turns: Samples = ()) -> ForceNoise:
    """Noise of a record from the fourth differences of its samples, as `loops.noise_levels.noise_level` does.

    The samples are grouped by |force|; non-negative least squares splits the groups' variances into a constant and
    a part proportional to force^2. Where these samples are few, all noise is called additive.

    Parameters
    ----------
    force : ndarray, shape (K,)   [N]
    turns : sequence of int       Samples at which the displacement turns, next to which the force bends.
    """
    bends = across(turns, 4, force.size)
    fourth, level = (np.delete(np.abs(values), bends) for values in (np.diff(force, 4), force[2:-2]))
    if fourth.size < _LEAST_DIFFERENCES:
        return ForceNoise(noise_level(force, turns), 0.0)
    count = min(_GROUPS, level.size // _GROUP_SAMPLES)
    # Stable: forces of few digits have many equals, which processors would order each in its way.
    groups = np.array_split(np.argsort(level, kind="stable"), count)
    variance = np.array([(np.median(fourth[group]) / 0.6745) ** 2 / 70.0 for group in groups])
    squares = np.array([np.mean(level[group] ** 2) for group in groups])
    floor = max(1e-6 * float(variance.max()), 1e-30 * float(squares.max()), 1e-300)
    # A group's estimate scatters in proportion to what it estimates, so each row is divided by that. Dividing by
    # the estimate itself would favour the groups that came out low: the fit takes its place, in a few rounds.
    scale = np.full(variance.shape, max(float(variance.mean()), floor))
    for _ in range(_ROUNDS):
        additive, relative = _non_negative(1.0 / scale, squares / scale, variance / scale)
        scale = np.maximum(additive + relative * squares, floor)
    return ForceNoise(math.sqrt(additive), math.sqrt(relative))


def _non_negative(p: FloatArray, q: FloatArray, target: FloatArray) -> tuple[float, float]:
    """Coefficients a, b >= 0 with the least sum of squares of a*p + b*q - target."""
    pp, pq, qq, pt, qt = (float(v) for v in (p @ p, p @ q, q @ q, p @ target, q @ target))
    determinant = pp * qq - pq * pq
    if determinant > 0.0:
        a, b = (qq * pt - pq * qt) / determinant, (pp * qt - pq * pt) / determinant
        if a >= 0.0 and b >= 0.0:
            return a, b
    # On the boundary; each alone lowers the sum by (its product with the target)^2 over its square.
    alone_p, alone_q = max(pt, 0.0) / pp, max(qt, 0.0) / qq if qq > 0.0 else 0.0
    return (alone_p, 0.0) if alone_p * pt >= alone_q * qt else (0.0, alone_q)
