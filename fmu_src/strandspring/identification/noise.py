"""The noise of a record's force, told from its fast changes: an additive part and one that grows with the force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernel.arrays import FloatArray
from ..loops.strokes import noise_level

# Groups of like |force|, each with its own variance; many, because a median over unlike scales is too small.
_GROUPS = 24
_ROUNDS = 4  # of weighting
_GROUP_SAMPLES = 30  # a group has at least so many
_LEAST_SAMPLES = 90  # below which the noise is called additive


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


def force_noise(force: FloatArray) -> ForceNoise:
    """Noise of a record from the fourth differences of its samples, as `records.strokes.noise_level` does.

    The samples are grouped by |force|; non-negative least squares splits the groups' variances into a constant and
    a part proportional to force^2.
    """
    if force.size < _LEAST_SAMPLES:
        return ForceNoise(noise_level(force), 0.0)
    fourth, level = np.abs(np.diff(force, 4)), np.abs(force[2:-2])
    groups = np.array_split(np.argsort(level), min(_GROUPS, level.size // _GROUP_SAMPLES))
    variance = np.array([(np.median(fourth[g]) / 0.6745) ** 2 / 70.0 for g in groups])
    squares = np.array([np.mean(level[g] ** 2) for g in groups])
    floor = max(1e-6 * float(variance.max()), 1e-30 * float(squares.max()), 1e-300)
    from scipy.optimize import nnls  # slow to import, and only identification needs it

    # A group's estimate scatters in proportion to what it estimates, so each row is divided by that. Dividing by
    # the estimate itself would favour the groups that came out low: the fit takes its place, in a few rounds.
    scale = np.full(variance.shape, max(float(variance.mean()), floor))
    for _ in range(_ROUNDS):
        parts, _ = nnls(np.stack([1.0 / scale, squares / scale], axis=1), variance / scale)
        scale = np.maximum(parts[0] + parts[1] * squares, floor)
    return ForceNoise(float(np.sqrt(parts[0])), float(np.sqrt(parts[1])))
