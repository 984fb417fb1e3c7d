"""Motions that no mount holds, and the slowest small vibration, both in the nominal pose.

With G the first derivatives of the axes' displacements by the motions of the bodies (see `small_motion`), a free motion
q with G q = 0 is held by nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag, null_space

from ...kernel.arrays import FloatArray
from ..bodies.mounted import MountedSystem
from ..bodies.parts import RigidBody
from ..bodies.small_motion import SmallMotion

_ROUNDING = 1e-9  # of singular values of rows whose lengths are about 1
_MOVING = 1e-6  # share of the largest coordinate of a motion
_NAMES = ("x", "y", "z")


def unheld_motion(system: MountedSystem) -> str:
    """A sentence about a motion that no mount holds; "" if there is none."""
    free, lengths = _free_motions(system.bodies), _lengths(system)
    rows = SmallMotion.about_nominal(system).gradients * lengths
    kernel = null_space(rows @ free, rcond=_ROUNDING)
    if not kernel.size:
        return ""
    motions: FloatArray = free @ kernel
    for body, part in zip(system.bodies, np.split(motions, len(system.bodies)), strict=True):
        for k, name in enumerate(_NAMES):
            along, about = np.linalg.norm(part[k]), np.linalg.norm(part[3 + k])
            if along > 1.0 - _ROUNDING:
                return f"no mount holds {body.name} along {name}, so that it can drift; {_advice(name)}."
            if about > 1.0 - _ROUNDING:
                return (
                    f"no mount holds {body.name} against rotation about {name}, so that it can turn; place mounts "
                    "away from that line, give them axes across it, or guide the body by its motion."
                )
    return _combined(system, motions[:, 0] * lengths)


def _combined(system: MountedSystem, motion: FloatArray) -> str:
    """A sentence about a motion of several coordinates."""
    moving = [
        (body.name, part)
        for body, part in zip(system.bodies, np.split(motion, len(system.bodies)), strict=True)
        if np.abs(part).max() > _MOVING * np.abs(motion).max()
    ]
    names = [name for name, _ in moving]
    drift, turn = np.split(moving[0][1], 2)
    who = " and ".join(names)
    if np.abs(turn).max() <= 1e-9 * np.abs(drift).max():
        direction = drift / np.linalg.norm(drift)
        name = next((n for n, d in zip(_NAMES, np.abs(direction), strict=True) if d > 1.0 - 1e-9), None)
        they = "it" if len(names) == 1 else "they"
        along = name or f"the direction {_vector(direction)}"
        return f"no mount holds {who} along {along}, so that {they} can drift; {_advice(along)}."
    about = turn / np.linalg.norm(turn)
    return (
        f"no mount holds {who} against a rotation about an axis in the direction {_vector(about)}; place mounts away "
        "from that axis, give them axes across it, or guide the body by its motion."
    )


def slowest_period(system: MountedSystem) -> float:
    """Longest period of small vibration with all friction saturated [s]; NaN where a spring's force falls."""
    motion = SmallMotion.about_nominal(system)
    stiffness = system.laws.saturated(motion.springs)
    try:
        slowest = float(np.linalg.eigvalsh((motion.along.T * stiffness) @ motion.along / motion.mass)[0])
    except np.linalg.LinAlgError:  # moments of absurdly different sizes
        return math.nan
    return 2.0 * math.pi / math.sqrt(slowest) if slowest > 0.0 else math.nan


def _free_motions(bodies: Sequence[RigidBody]) -> FloatArray:
    """An orthonormal basis of the motions that are free, shape (6*B, F)."""
    parts = [_range(projector) for body in bodies for projector in (body.translations, body.rotations)]
    return np.asarray(block_diag(*parts), dtype=np.float64)


def _range(projector: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(projector)
    return np.asarray(vectors[:, values > 0.5], dtype=np.float64)


def _lengths(system: MountedSystem) -> FloatArray:
    """What makes a unit of each coordinate move mounts by about 1, shape (6*B,): 1 [m], or 1/radius [rad]."""
    scales = []
    for number, body in enumerate(system.bodies):
        places = [mount.place for mount in system.mounts if number in (mount.body, mount.support)]
        radius = max((math.dist(place, body.center) for place in places), default=0.0) or 1.0
        scales += [1.0] * 3 + [1.0 / radius] * 3
    return np.array(scales)


def _advice(along: str) -> str:
    return f"add an axis along {along} to a mount type, or let the body move in a plane or along an axis only"


def _vector(direction: FloatArray) -> str:
    return f"({', '.join(f'{component:.3g}' for component in direction + 0.0)})"
