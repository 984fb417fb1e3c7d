"""Harmonic balance of a mass on equal springs, compiled; `kernel/c/balance/balance.h` gives the equations."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core.parameters import SpringParameters
from .arrays import FloatArray, address, floats
from .library import library
from .path import Law
from .periodic import FourierBasis
from .structures import structures

_ANY_OMEGA = 0.5  # where the first search for the hysteresis of a period begins


class MotionSummary(NamedTuple):
    """BalancedMotion of balance.h: summary of a steady motion, besides its Fourier coefficients.

    Attributes
    ----------
    low, high : float   Displacement of one spring [m].
    omega : float       Of a spring at phase 0 [-].
    push : float        Largest absolute force on the mass over the period, inertia excluded [N].
    """

    low: float
    high: float
    omega: float
    push: float


@dataclass(frozen=True, eq=False)
class Balance:
    """The balance of one motion, which need not be steady, at one frequency.

    Attributes
    ----------
    residual : ndarray, shape (N,)       Unbalanced force per Fourier coefficient [N].
    jacobian : ndarray, shape (N, N)     Its derivatives by the coefficients of the motion [N/m].
    by_frequency : ndarray, shape (N,)   Its derivative by Omega [N s].
    scale : float                        Largest term of the balance [N].
    summary : MotionSummary
    """

    residual: FloatArray
    jacobian: FloatArray
    by_frequency: FloatArray
    scale: float
    summary: MotionSummary


class BalancedMass:
    """One mass on S springs in series and P rows of them side by side, under one level of excitation.

    The force in the coordinate of the mount is L + F*cos(Omega*t), F = forcing + forcing_by_square*Omega^2.

    Parameters
    ----------
    spring : SpringParameters
    basis : FourierBasis
    parallel, series : int          P and S.
    mass, damping : float           [kg], [N s/m].
    static_load : float             L [N].
    forcing : float                 [N].
    forcing_by_square : float       [N s^2].
    force_on_mass : float           What of F pushes the mass itself [N]; the rest is inertia in the base's frame.
    """

    def __init__(
        self,
        spring: SpringParameters,
        basis: FourierBasis,
        *,
        parallel: int,
        series: int,
        mass: float,
        damping: float,
        static_load: float,
        forcing: float,
        forcing_by_square: float,
        force_on_mass: float,
    ) -> None:
        self.basis = basis
        self._law = Law(spring)
        self._workspace = np.empty(library().balance_workspace(basis.harmonics, basis.samples))
        self._mass = structures()["BalancedMass"](
            law=self._law.address, basis=basis.structure, workspace=address(self._workspace), start=_ANY_OMEGA,
            parallel=parallel, series=series, mass=mass, damping=damping, static_load=static_load, forcing=forcing,
            forcing_by_square=forcing_by_square, force_on_mass=force_on_mass,
        )  # fmt: skip

    def at(self, z: FloatArray, frequency: float) -> Balance:
        """The balance of a motion.

        Parameters
        ----------
        z : ndarray, shape (N,)   Fourier coefficients of the mount's displacement [m].
        frequency : float         Omega [rad/s].

        Raises
        ------
        ValueError                If the displacement is constant.
        """
        z = floats(z)
        residual, by_frequency, jacobian = np.empty(z.size), np.empty(z.size), np.empty((z.size, z.size))
        scale, motion = ctypes.c_double(), structures()["BalancedMotion"]()
        moves = library().balance_at(
            ctypes.byref(self._mass), address(z), frequency, address(residual), address(jacobian),
            address(by_frequency), ctypes.byref(scale), ctypes.byref(motion),
        )  # fmt: skip
        if not moves:
            raise ValueError("`z` must describe a motion, got a constant displacement.")
        return Balance(residual, jacobian, by_frequency, scale.value, _summary(motion))

    def solve(self, guess: FloatArray, frequency: float) -> tuple[FloatArray, MotionSummary] | None:
        """The steady motion at a fixed Omega [rad/s] by Newton's method; None if it does not converge.

        Parameters
        ----------
        guess : ndarray, shape (N,)   Where it starts [m].
        """
        z, motion = np.array(guess, dtype=np.float64), structures()["BalancedMotion"]()
        solved = library().balance_solve(ctypes.byref(self._mass), frequency, address(z), ctypes.byref(motion))
        return (z, _summary(motion)) if solved else None

    def sweep(
        self, log: float, z: FloatArray, logs: FloatArray, limits: tuple[float, float]
    ) -> list[tuple[FloatArray, MotionSummary]]:
        """Steady motions at rising frequencies, as far as each is continuous with the one before.

        Parameters
        ----------
        log, z : float and ndarray, shape (N,)   ln(Omega) and coefficients of the steady motion before the first.
        logs : ndarray, shape (F,)               Wanted ln(Omega), rising.
        limits : tuple of float                  Displacements of a spring [m]; the first motion beyond is the last.

        Returns
        -------
        list                                     At most F steady motions.
        """
        z, logs = floats(z), floats(logs)
        found, motions = np.empty((logs.size, z.size)), (structures()["BalancedMotion"] * logs.size)()
        reached = library().balance_sweep(
            ctypes.byref(self._mass), log, address(z), logs.size, address(logs),
            *limits, address(found), motions,
        )  # fmt: skip
        return [(z, _summary(motion)) for z, motion in zip(found[:reached], motions, strict=False)]


def _summary(motion: ctypes.Structure) -> MotionSummary:
    return MotionSummary(*(getattr(motion, name) for name in MotionSummary._fields))
