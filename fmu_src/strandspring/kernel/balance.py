"""Harmonic balance of a system on springs, in the compiled kernel; `kernel/c/balance/balance.h` gives the equations."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from .arrays import FloatArray, address, floats
from .library import library
from .path import Law
from .periodic import FourierBasis
from .structures import constants, structures

_ANY_OMEGA = 0.5  # where the first search for the hysteresis of a period begins
_OF_SYSTEM = ("along", "bend", "load", "forcing")


class BalancedMotion(NamedTuple):
    """A motion of D coordinates and M axes, over a period of K samples.

    Attributes
    ----------
    z : ndarray, shape (D*N,)       Fourier coefficients of the coordinates, one coordinate after the other [m].
    figures : ndarray, shape (M, 5)   Of each axis: lowest and highest displacement of one spring [m], its omega at
                                    phase 0 [-], first harmonic of the axis' force, cosine and sine [N].
    force : ndarray, shape (D, K)   What the axes' forces are on the coordinates [N].
    """

    z: FloatArray
    figures: FloatArray
    force: FloatArray

    @property
    def low(self) -> FloatArray:
        """Lowest displacement of one spring of each axis, shape (M,) [m]."""
        return self.figures[:, 0]

    @property
    def high(self) -> FloatArray:
        """Highest displacement of one spring of each axis, shape (M,) [m]."""
        return self.figures[:, 1]


@dataclass(frozen=True, eq=False)
class Balance:
    """The balance of one motion, which need not be steady, at one frequency.

    Attributes
    ----------
    residual : ndarray, shape (D*N,)       Unbalanced force per Fourier coefficient [N].
    jacobian : ndarray, shape (D*N, D*N)   Its derivatives by the coefficients of the motion [N/m].
    by_frequency : ndarray, shape (D*N,)   Its derivative by Omega [N s].
    scale : float                          Largest term of the balance [N].
    motion : BalancedMotion
    """

    residual: FloatArray
    jacobian: FloatArray
    by_frequency: FloatArray
    scale: float
    motion: BalancedMotion


@dataclass(frozen=True, eq=False)
class BalancedSystem:
    """A system of D coordinates of the same mass on M axes of springs, under one level of excitation.

    Parameters
    ----------
    springs : sequence of SpringParameters   Of each axis.
    axes : ndarray, shape (M,)               As BalancedAxis of balance.h, its law and start left out.
    basis : FourierBasis
    mass : float                             Of each coordinate [kg].
    along : ndarray, shape (M, D)            Displacement of each axis by the coordinates.
    bend : ndarray, shape (M, D, D)          Second derivatives of that [1/m].
    load : ndarray, shape (D,)               Static forces [N].
    forcing : ndarray, shape (2, D)          F_0 [N] and F_1 [N s^2] of the forces (F_0 + F_1*Omega^2)*cos(Omega*t) in
                                             the coordinates.
    level_text : str                         The level in the unit that people read.
    """

    springs: Sequence[SpringParameters]
    axes: NDArray[np.void]
    basis: FourierBasis
    mass: float
    along: FloatArray
    bend: FloatArray
    load: FloatArray
    forcing: FloatArray
    level_text: str

    @property
    def degrees(self) -> int:
        """D."""
        return self.load.size

    def at_share(self, share: float) -> BalancedSystem:
        """The same system at a share of the level."""
        return replace(self, forcing=share * self.forcing)

    def forcing_at(self, frequency: FloatArray | float) -> FloatArray:
        """Amplitudes of the forces at Omega of shape (...) [rad/s], shape (..., D) [N]."""
        squared = np.asarray(frequency)[..., None] ** 2
        constant, by_square = self.forcing
        return np.asarray(constant + by_square * squared)

    def about_mean(self, z: FloatArray) -> FloatArray:
        """Coefficients without those of the means, shape (D, 2H) [m]."""
        return z.reshape(self.degrees, -1)[:, 1:]

    def is_beyond(self, motion: BalancedMotion) -> bool:
        """Whether a spring goes beyond the limits of its axis."""
        return bool(np.any((motion.low < self.axes["low"]) | (motion.high > self.axes["high"])))

    def at(self, z: FloatArray, frequency: float) -> Balance:
        """The balance of a motion.

        Parameters
        ----------
        z : ndarray, shape (D*N,)   Coefficients as in `BalancedMotion`.
        frequency : float           Omega [rad/s].

        Raises
        ------
        ValueError                  If nothing moves.
        """
        z, motions = floats(z), self._motions(1)
        residual, by_frequency, jacobian = np.empty(z.size), np.empty(z.size), np.empty((z.size, z.size))
        scale = ctypes.c_double()
        moves = library().balance_at(
            self._address, address(z), frequency, address(residual), address(jacobian), address(by_frequency),
            ctypes.byref(scale), motions.address,
        )  # fmt: skip
        if not moves:
            raise ValueError("`z` must describe a motion, got constant displacements.")
        return Balance(residual, jacobian, by_frequency, scale.value, motions.motion_of(z, 0))

    def solve(self, guess: FloatArray, frequency: float) -> BalancedMotion | None:
        """The steady motion at a fixed Omega [rad/s] by Newton's method; None if it does not converge.

        Parameters
        ----------
        guess : ndarray, shape (D*N,)   Where it starts [m].
        """
        z, motions = np.array(guess, dtype=np.float64), self._motions(1)
        is_solved = library().balance_solve(self._address, frequency, address(z), motions.address)
        return motions.motion_of(z, 0) if is_solved else None

    def sweep(self, log: float, z: FloatArray, logs: FloatArray) -> list[BalancedMotion]:
        """Steady motions at rising frequencies, as far as each is continuous with the one before.

        Parameters
        ----------
        log, z : float and ndarray, shape (D*N,)   ln(Omega) and coefficients of the steady motion before the first.
        logs : ndarray, shape (F,)                 Wanted ln(Omega), rising.

        Returns
        -------
        list                                       At most F steady motions; the first in which a spring goes beyond the
                                                   limits of its axis is the last.
        """
        z, logs = floats(z), floats(logs)
        rows, motions = np.empty((logs.size, z.size)), self._motions(logs.size)
        reached = library().balance_sweep(
            self._address, log, address(z), logs.size, address(logs), address(rows), motions.address
        )
        return [motions.motion_of(rows[k], k) for k in range(reached)]

    @cached_property
    def _seconds(self) -> list[int]:
        """The axes whose springs have a second mechanism."""
        return [place for place, spring in enumerate(self.springs) if spring.second is not None]

    def _motions(self, count: int) -> _Motions:
        return _Motions(count, len(self.axes), self._seconds, self.degrees, self.basis.samples)

    @property
    def _address(self) -> int:
        return ctypes.addressof(self._memory[0])

    @cached_property
    def _memory(self) -> tuple[ctypes.Structure, object]:
        """BalancedSystem of balance.h, and all that it points to."""
        mechanisms = [spring.mechanisms for spring in self.springs]
        # A second mechanism is an axis of its own at the same place.
        places = [*range(len(mechanisms)), *self._seconds]
        springs = [*(first for first, *_ in mechanisms), *(mechanisms[place][1] for place in self._seconds)]
        laws = {spring: Law(spring) for spring in springs}
        axes = self.axes[places]
        axes["law"], axes["start"] = [laws[spring].address for spring in springs], _ANY_OMEGA
        axes["damping"][len(mechanisms) :] = axes["stop_stiffness"][len(mechanisms) :] = 0.0
        for axis, spring in zip(axes, self.springs, strict=False):
            axis["branches"] = len(spring.branches)
            for j, branch in enumerate(spring.branches):
                axis["branch_stiffness"][j], axis["time_constant"][j] = branch.stiffness, branch.time_constant
        arrays = {name: floats(getattr(self, name)) for name in _OF_SYSTEM}
        arrays |= {name: floats(arrays[name][places]) for name in ("along", "bend")}
        memory = structures()["BalancedSystem"](
            degrees=self.degrees, axes=axes.size, basis=self.basis.structure, axis=address(axes), mass=self.mass,
            **{name: address(array) for name, array in arrays.items()},
        )  # fmt: skip
        workspace = np.empty(library().balance_workspace(ctypes.byref(memory)))
        memory.workspace = address(workspace)
        return memory, (laws, axes, arrays, workspace)


class _Motions:
    """Room for what the kernel says of some motions besides their coefficients."""

    def __init__(self, count: int, axes: int, seconds: Sequence[int], degrees: int, samples: int) -> None:
        self._axes, self._seconds = axes, seconds
        self._figures = np.empty((count, axes + len(seconds), constants()["BALANCED_OF_AXIS"]))
        self._force = np.empty((count, degrees, samples))
        self._memory = structures()["BalancedMotion"](of_axes=address(self._figures), force=address(self._force))

    @property
    def address(self) -> int:
        """Where the kernel finds it; valid while it lives."""
        return ctypes.addressof(self._memory)

    def motion_of(self, z: FloatArray, number: int) -> BalancedMotion:
        """The motion of a number with its coefficients."""
        figures = self._figures[number, : self._axes]
        if self._seconds:
            figures = figures.copy()
            # The force of an axis is that of both mechanisms.
            figures[list(self._seconds), 3:] += self._figures[number, self._axes :, 3:]
        return BalancedMotion(z, figures, self._force[number])
