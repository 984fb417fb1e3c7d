"""The force along a motion, and what it would be by other parameters or of a mount of a wider class: its columns.

Beside the spring's own parameters there may be further friction mechanisms, an amplifier of any form, and forces that
relax. They are stop operators whose force may grow with the displacement, hats over the amplifier, and Maxwell
branches. The force is linear in all of these, and linear about the spring in its own parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...kernel.branches import maxwell_columns
from ...kernel.many_paths import along_paths, gradient_fields, spring_rows
from ...model.joint import HYSTERETIC_UNITS
from .blocks import Range
from .motion import Motion

_THRESHOLDS = 0.7 * 0.6 ** np.arange(8)  # of stop operators, shares of half the range
_KNOTS = 9  # of the hats
# Relaxation times of the branches, in periods of the largest loop.
_RELAXATION = (0.02, 0.1, 0.5, 2.5)
_RELAXING = len(_RELAXATION)


@dataclass(frozen=True, eq=False)
class Force:
    """Force along a motion with its derivatives.

    Attributes
    ----------
    value : ndarray, shape (K,)      [N]
    own : ndarray, shape (K, P)      By the coefficients in the order of `joint_names`.
    wider : ndarray, shape (K, Q)    By the forces of a wider class; the last `relaxing` of them depend on the rate.
    hysteretic : ndarray, shape (K,) Part of omega [N].
    """

    value: FloatArray
    own: FloatArray
    wider: FloatArray
    hysteretic: FloatArray
    relaxing: int = _RELAXING

    def range_in_leg(self, motion: Motion) -> FloatArray:
        """Range of the hysteretic force within the leg of each point, shape (K,) [N]."""
        begins = np.flatnonzero(np.diff(motion.leg, prepend=-1))
        ranges = np.maximum.reduceat(self.hysteretic, begins) - np.minimum.reduceat(self.hysteretic, begins)
        return np.asarray(np.repeat(ranges, np.diff(begins, append=motion.leg.size)))


def force_along(spring: SpringParameters, motion: Motion, span: Range, period: float) -> Force:
    """The force of a spring along a motion that begins with omega = 0.

    Parameters
    ----------
    spring : SpringParameters
    motion : Motion
    span : Range      Of the largest loop.
    period : float    Of the largest loop [s].
    """
    path = motion.displacement
    (value, own), *seconds = (_mechanism_along(mechanism, path) for mechanism in spring.mechanisms)
    hysteretic = own[:, -4]  # its derivative by ln(kappa_omega)
    further = []
    for added, columns in seconds:
        value = value + added
        hysteretic = hysteretic + columns[:, -4]
        further.append(columns[:, 1:])  # without FE
    relaxing, by_log = maxwell_columns([branch.time_constant for branch in spring.branches], path, motion.time)
    for branch, columns in zip(spring.branches, np.stack([relaxing, by_log], axis=2), strict=True):
        value = value + branch.stiffness * columns[:, 0]
        further.append(branch.stiffness * columns)
    elastic = len(getattr(spring, spring.elastic_name))
    own = np.hstack([own[:, :elastic], *further, own[:, elastic:]])
    place = (path - span.middle) / span.half
    thresholds = np.asarray(span.half * _THRESHOLDS)
    stops = _stops(motion, thresholds) / thresholds
    knots = np.linspace(-1.0, 1.0, _KNOTS)
    hats = np.maximum(1.0 - np.abs(place[:, None] - knots) / (knots[1] - knots[0]), 0.0)
    branches, _ = maxwell_columns(period * np.array(_RELAXATION), path, motion.time)
    wider = np.hstack([stops, place[:, None] * stops, hysteretic[:, None] * hats, branches.T / span.half])
    return Force(value, own, wider, hysteretic)


def _mechanism_along(spring: SpringParameters, path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force of a spring with one mechanism from omega = 0, shape (K,) [N], and its derivatives, shape (K, P): by FE, by
    kA without kA[0], and by the logarithms of kappa_omega, rho, sigma and n.
    """
    elastic = spring.elastic_name
    fields = [
        *gradient_fields(elastic, len(getattr(spring, elastic))),
        *list(gradient_fields("kA", len(spring.kA)))[1:],
        *(field for name in HYSTERETIC_UNITS for field in gradient_fields(name, 1)),
    ]
    value, slopes = np.empty((1, path.size)), np.empty((1, len(fields), path.size))
    along_paths(spring_rows(spring, 1, {}), path, np.zeros(1), {"force": value}, fields, {"force": slopes})
    columns = slopes[0].T.copy()
    columns[:, -len(HYSTERETIC_UNITS) :] *= [getattr(spring, name) for name in HYSTERETIC_UNITS]
    return value[0], columns


def _stops(motion: Motion, thresholds: FloatArray) -> FloatArray:
    """Outputs of stop operators along the motion, shape (K, T) [m]; 0 at the start."""
    path = motion.displacement
    outputs = np.zeros((path.size, thresholds.size))
    ends = np.flatnonzero(np.diff(motion.leg, append=-1))  # the last point of each leg
    begin = 0
    for end in ends.tolist():
        # A leg is monotone, so that it may be passed in one step.
        moved = path[begin : end + 1, None] - path[begin]
        outputs[begin : end + 1] = np.clip(outputs[begin] + moved, -thresholds, thresholds)
        begin = end
    return outputs
