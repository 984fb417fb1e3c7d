"""What is known before a test, and after parts of it.

All is linear about a spring: theta, the change of its own coefficients, and w, the forces of a wider class. A model
file gives the covariance of theta for a spring that is of its own class (w = 0), and the loops that were recorded. Of
a mount with w these would have been fitted by theta = -G*w, where G is the least-squares solution of own*G = wider
along the recorded loops. The rest, R = wider - own*G, would have been seen as misfit: that bounds w.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from .forces import Force
from .motion import Motion

_FURTHER = 0.5  # standard deviation of each further force, share of the hysteretic force (rms)
_UNSEEN = 0.15  # the same where nothing was recorded, and all of it adds to that of the spring
_RATE = 0.2  # the same of forces that relax where one rate was recorded
_KNOWN_RATE = 0.03  # where several were
_DISCREPANCY = 0.03  # of any linear class from a mount, share of the range of the hysteretic force within a leg
_RANK = 1e-8  # of singular values


@dataclass(frozen=True)
class Noise:
    """Errors of a measured force.

    Parameters
    ----------
    additive : float      Standard deviation [N].
    relative : float      The same, share of the force.
    correlated : float    Samples that count as one.
    """

    additive: float
    relative: float = 0.0
    correlated: float = 1.0

    def weights(self, motion: Motion, force: Force, is_own: bool = False) -> FloatArray:
        """Roots of the information of each point [1/N], of a mount of the spring's own class or of a wider one.

        A point is one independent sample at most.
        """
        independent = np.minimum(motion.samples / self.correlated, 1.0)
        squares = self.additive**2 + (self.relative * force.value) ** 2
        if not is_own:
            squares = squares + (_DISCREPANCY * force.range_in_leg(motion)) ** 2
        return np.sqrt(independent / squares)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Distribution of the coefficients of one spring: those of a wider class beside its own, and its own alone.

    Attributes
    ----------
    spring : SpringParameters
    noise : Noise
    root : ndarray, shape (P + Q, P + Q)   Of the covariance of all coefficients before the test.
    own : ndarray, shape (P, P)            Of that of the spring's own ones if it is of its class.
    information : ndarray                  Gained by the test, in units of the first one.
    own_information : ndarray              The same of the other one.
    """

    spring: SpringParameters
    noise: Noise
    root: FloatArray
    own: FloatArray
    information: FloatArray
    own_information: FloatArray

    @classmethod
    def before(
        cls,
        spring: SpringParameters,
        noise: Noise,
        own: FloatArray,
        force: Force,
        motion: Motion,
        is_recorded: bool,
        rates: bool,
    ) -> Knowledge:
        """What is known before the test.

        Parameters
        ----------
        spring : SpringParameters
        noise : Noise
        own : ndarray, shape (P, P)   Root of the covariance of the spring's own coefficients.
        force, motion : Force, Motion   Along the loops that were recorded, or the largest loop.
        is_recorded : bool            Whether these were recorded.
        rates : bool                  Whether several rates were.
        """
        scale = np.sqrt(np.mean(force.wider**2, axis=0))
        shares = np.full(scale.size, _FURTHER if is_recorded else _UNSEEN)
        shares[-force.relaxing :] = _KNOWN_RATE if rates else _RATE
        deviations = shares * np.sqrt(np.mean(force.hysteretic**2)) / np.maximum(scale, 1e-9 * scale.max())
        p, q = len(own), scale.size
        root = np.zeros((p + q, p + q))
        root[:p, :p] = own
        if not is_recorded:
            root[p:, p:] = np.diag(deviations)
        else:
            weights = noise.weights(motion, force)[:, None]
            columns, wider = weights * (force.own @ own), weights * force.wider * deviations
            gain = np.linalg.lstsq(columns, wider, rcond=_RANK)[0]
            left = wider - columns @ gain
            _, singular, directions = np.linalg.svd(left, full_matrices=False)  # of more points than columns
            posterior = directions.T / np.sqrt(1.0 + singular**2)
            root[p:, p:] = deviations[:, None] * posterior
            root[:p, p:] = -own @ gain @ posterior
        return cls(spring, noise, root, own, np.zeros((p + q, p + q)), np.zeros((p, p)))

    def gained(self, motion: Motion, force: Force, points: slice = slice(None)) -> tuple[FloatArray, FloatArray]:
        """Information of points of a motion, in the units of both distributions."""
        wider, alone = (self.noise.weights(motion, force, is_own)[points, None] for is_own in (False, True))
        columns = wider * (np.hstack([force.own, force.wider])[points] @ self.root)
        own = alone * (force.own[points] @ self.own)
        return columns.T @ columns, own.T @ own

    def after(self, information: FloatArray, own_information: FloatArray) -> Knowledge:
        """What is known with more information."""
        return Knowledge(
            self.spring, self.noise, self.root, self.own, self.information + information,
            self.own_information + own_information,
        )  # fmt: skip

    def deviations(self, gradients: FloatArray, own: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of linear functions of all coefficients, shape (F,), and of the own ones, shape (E,).

        Parameters
        ----------
        gradients : ndarray, shape (F, P + Q)
        own : ndarray, shape (E, P)
        """
        return (
            _deviations(gradients @ self.root, self.information),
            _deviations(own @ self.own, self.own_information),
        )

    def force_deviation(self, force: Force) -> FloatArray:
        """Standard deviation of the force along a motion before the test, shape (K,) [N]."""
        return np.asarray(np.linalg.norm(np.hstack([force.own, force.wider]) @ self.root, axis=1))


def _deviations(gradients: FloatArray, information: FloatArray) -> FloatArray:
    triangle = np.linalg.cholesky(np.eye(len(information)) + information)
    return np.asarray(np.linalg.norm(np.linalg.solve(triangle, gradients.T), axis=0))
