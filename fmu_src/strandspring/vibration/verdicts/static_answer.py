"""The static pose of a system and its small vibrations, which come before any load case."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...errors import MountedSystemError
from ...findings import Finding, Outcome
from ...kernel.arrays import FloatArray
from ..bodies.modes import Mode, modes
from ..bodies.mounted import MountedSystem
from ..bodies.rest import RestPose, rest
from ..bodies.small_motion import SmallMotion
from .draws import Unknowns

SECANT_SHARE = 0.5  # amplitude of the secant modes, of each spring's free travel


@dataclass(frozen=True, eq=False)
class StaticAnswer:
    """Where the bodies rest and how they vibrate there.

    Attributes
    ----------
    poses : tuple of RestPose                 The nominal one, and those of the draws that could rest.
    sag : ndarray, shape (poses, B)           Displacement of the centres of gravity along gravity from the nominal
                                              pose [m].
    tilt : ndarray, shape (poses, B)          Angle from the nominal pose [rad].
    places : ndarray, shape (poses, A)        Of the springs within their identified ranges: 0 at the lower end,
                                              1 at the upper.
    tangent : tuple of Mode                   For vanishing motion about the first pose.
    secant : tuple of Mode                    For motion of each spring by half of its way to the nearer end of its
                                              identified range.
    findings : tuple of Finding               Why modes could not be had.
    """

    poses: tuple[RestPose, ...]
    sag: FloatArray
    tilt: FloatArray
    places: FloatArray
    tangent: tuple[Mode, ...]
    secant: tuple[Mode, ...]
    findings: tuple[Finding, ...]


def static_answer(system: MountedSystem, unknowns: Unknowns) -> StaticAnswer:
    """Static poses of a system by all that is unknown, and its modes about the nominal one.

    Raises
    ------
    MountedSystemError   If the bodies cannot rest.
    """
    poses = (rest(system, unknowns.share), *unknowns.poses(system))
    laws = system.laws
    gravity = np.array(system.gravity)
    down = gravity / (math.hypot(*system.gravity) or 1.0)
    findings, mode_sets = [], []
    motion = SmallMotion(system, poses[0].pose)
    for share in (None, SECANT_SHARE):
        try:
            springs = motion.springs
            stiffness = None if share is None else laws.secants(springs, share * laws.free_travel(springs))
            mode_sets.append(modes(motion, stiffness, poses[0].omega))
        except MountedSystemError as problem:
            numbers = {"kind": "tangent" if share is None else "secant", "reason": str(problem)}
            findings.append(Finding(Outcome.NO_MODES, numbers))
            mode_sets.append(())
    turns = np.array([rest_pose.coordinates[:, 3:] for rest_pose in poses])
    return StaticAnswer(
        poses=poses,
        sag=np.array([rest_pose.displacements @ down for rest_pose in poses]),
        tilt=2.0 * np.arctan2(np.linalg.norm(turns[:, :, 1:], axis=2), np.abs(turns[:, :, 0])),
        places=np.array([(rest_pose.displacement - laws.low) / (laws.high - laws.low) for rest_pose in poses]),
        tangent=mode_sets[0],
        secant=mode_sets[1],
        findings=tuple(findings),
    )
