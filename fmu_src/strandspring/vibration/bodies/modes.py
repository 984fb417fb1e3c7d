"""Natural frequencies, shapes and damping of rigid bodies on mounts, for small motion about a pose.

With the stiffness k of each axis, its force F in the pose and the derivatives g and H of its displacement by the free
coordinates q (see `small_motion`), the stiffness matrix is the sum of k*g g' + F*H: the second part, geometric
stiffness, comes from forces that turn with the bodies. The damping ratio of a mode with shape q and frequency f is that
of modal strain energy,

    zeta = q.C q/(4 pi f q.M q) + (sum of k''*(g.q)^2)/(2 q.K q),

with C of the viscous dampers and k'' the imaginary part of the axes' complex stiffness, which is k times the loss
factor of the springs' steady loops. Maxwell branches add their dynamic stiffness at the mode's own frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from .axis_laws import ComplexArray
from .mounted import MountedSystem
from .small_motion import SmallMotion

MOTIONS = ("x", "y", "z", "rx", "ry", "rz")
_ROUNDING = 1e-11  # of the largest stiffness: less is none
_NAMED = 0.05  # least share of a motion that is named
_ALIKE, _ROUNDS = 1e-9, 1000  # of Omega^2 between two rounds with branches


@dataclass(frozen=True, eq=False)
class Mode:
    """A natural mode.

    Attributes
    ----------
    frequency : float                 Undamped [Hz]; 0 where nothing holds the bodies.
    damping : float                   Ratio of critical damping [-]; NaN where nothing holds the bodies.
    shape : ndarray, shape (B, 6)     Displacement of the centre of gravity along x, y and z [m] and rotation about them
                                      [rad] of each body, for a modal mass of 1 kg m^2.
    shares : ndarray, shape (B, 6)    Of each of these motions in the kinetic energy [-]; their sum is 1.
    words : str                       The largest shares in words.
    """

    frequency: float
    damping: float
    shape: FloatArray
    shares: FloatArray
    words: str


def modes(
    motion: SmallMotion, stiffness: FloatArray | ComplexArray | None = None, omega: FloatArray | None = None
) -> tuple[Mode, ...]:
    """Natural modes about a pose, by rising frequency.

    Parameters
    ----------
    motion : SmallMotion                      About the pose.
    stiffness : ndarray or None, shape (M,)   Of the axes in slow motion, complex with their losses [N/m]; by default
                                              the tangent.
    omega : ndarray or None, shape (M,)       Of the springs at rest [-]; by default 0.

    Raises
    ------
    MountedSystemError                        If the pose is not stable.
    """
    laws = motion.system.laws
    slow = laws.tangents(motion.springs) if stiffness is None else stiffness
    forces = laws.forces(motion.springs, np.zeros_like(motion.springs) if omega is None else omega)
    values, shapes = np.linalg.eigh(motion.stiffness(np.real(slow), forces) / motion.mass)
    held = np.abs(values) > _ROUNDING * np.abs(values).max(initial=0.0)
    listed = []
    for k, is_held in enumerate(held.tolist()):
        value, q, of_axes = float(values[k]), shapes[:, k], slow
        if laws.has_branches and is_held and value > 0.0:
            value, q, of_axes = _with_branches(motion, slow, forces, k, value)
        losses = motion.along.T @ (np.imag(of_axes)[:, None] * motion.along)
        shape, shares = _body_motions(motion, q)
        words = _words(motion.system, shares)
        if is_held and value < 0.0:
            raise MountedSystemError(
                f"The static equilibrium is not stable: a motion of {words} lowers its energy; use stiffer mounts, "
                "mounts further apart or another preload."
            )
        circular = math.sqrt(value) if is_held else 0.0
        damping = math.nan
        if is_held:
            viscous, lost = (float(q @ matrix @ q) / motion.mass for matrix in (motion.damping, losses))
            damping = 0.5 * viscous / circular + 0.5 * lost / value
        listed.append(Mode(circular / (2.0 * math.pi), damping, shape, shares, words))
    return tuple(listed)


def _with_branches(
    motion: SmallMotion, slow: FloatArray | ComplexArray, forces: FloatArray, k: int, value: float
) -> tuple[float, FloatArray, ComplexArray]:
    """Omega^2, coordinates and stiffness of the axes of mode k, with the branches at its own Omega.

    They stiffen with Omega, so that from the value of slow motion the iteration rises to the lowest that agrees.
    """
    for _ in range(_ROUNDS):
        of_axes = slow + motion.system.laws.of_branches(math.sqrt(value))
        values, shapes = np.linalg.eigh(motion.stiffness(of_axes.real, forces) / motion.mass)
        before, value = value, float(values[k])
        if value - before <= _ALIKE * value:
            break
    return value, shapes[:, k], of_axes


def _body_motions(motion: SmallMotion, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`Mode.shape` and `Mode.shares` of coordinates of unit length."""
    shape = (motion.free @ q).reshape(-1, 6) / math.sqrt(motion.mass)
    momentum = np.empty_like(shape)
    for k, (body, rotation) in enumerate(zip(motion.system.bodies, motion.pose[1], strict=True)):
        momentum[k, :3] = body.mass * shape[k, :3]
        momentum[k, 3:] = rotation @ np.array(body.inertia) @ rotation.T @ shape[k, 3:]
    return shape, shape * momentum


def _words(system: MountedSystem, shares: FloatArray) -> str:
    """The shares that are worth naming, the largest first."""
    several = len(system.bodies) > 1
    named: list[tuple[float, str]] = [
        (float(share), f"{body.name} {name}" if several else name)
        for body, of_body in zip(system.bodies, shares, strict=True)
        for name, share in zip(MOTIONS, of_body, strict=True)
    ]
    ordered = sorted(named, key=lambda named_share: -named_share[0])
    return ", ".join(f"{name} {100.0 * share:.0f} %" for share, name in ordered if share >= _NAMED)
