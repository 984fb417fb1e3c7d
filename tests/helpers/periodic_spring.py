"""The steady force of a spring over one period, as the compiled kernel gives it (`kernel/c/balance/periodic.h`)."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from strandspring import SpringParameters
from strandspring.kernel.arrays import FloatArray, address, floats
from strandspring.kernel.library import library
from strandspring.kernel.path import Law
from strandspring.kernel.periodic import FourierBasis


class _Period(ctypes.Structure):
    """SpringPeriod of periodic.h."""

    _fields_ = [
        (name, ctypes.c_void_p)
        for name in ("displacement", "rate", "omega", "force", "stiffness", "memory", "inherited", "spans", "turns")
    ]


@dataclass(frozen=True, eq=False)
class PeriodicForce:
    """Steady force over one period.

    Attributes
    ----------
    displacement, omega, force : ndarray, shape (K,)   At equal phases [m], [-], [N].
    coefficients : ndarray, shape (N,)                 Fourier coefficients of the force [N].
    jacobian : ndarray, shape (N, N)                   Their derivatives by those of the displacement [N/m].
    turns : ndarray, shape (S,)                        Displacement at the turning points, the highest first [m].
    """

    displacement: FloatArray
    omega: FloatArray
    force: FloatArray
    coefficients: FloatArray
    jacobian: FloatArray
    turns: FloatArray


class PeriodicSpring:
    """One spring under periodic displacements; omega at the highest displacement is kept to start the next search.

    Parameters
    ----------
    parameters : SpringParameters
    basis : FourierBasis
    """

    def __init__(self, parameters: SpringParameters, basis: FourierBasis) -> None:
        self.basis = basis
        self._law = Law(parameters)
        self._start = np.array([0.5])
        kernel = library()
        kernel.spring_periodic_workspace.argtypes = (ctypes.c_size_t, ctypes.c_size_t)
        kernel.spring_periodic_workspace.restype = kernel.spring_periodic.restype = ctypes.c_size_t
        kernel.spring_periodic.argtypes = (ctypes.c_void_p,) * 6
        self._workspace = np.empty(kernel.spring_periodic_workspace(basis.harmonics, basis.samples))

    def respond(self, coefficients: FloatArray) -> PeriodicForce:
        """The steady force under a displacement.

        Parameters
        ----------
        coefficients : ndarray, shape (N,)   [m]

        Raises
        ------
        ValueError                           If the displacement is constant.
        """
        count, samples = self.basis.order.size, self.basis.samples
        displacement, rate, omega, force, stiffness, memory, turns = np.empty((7, samples))
        inherited, spans, coefficients = (
            np.empty((samples, count)),
            np.zeros((2 * samples, 2), np.uintp),
            floats(coefficients),
        )
        period = _Period(
            displacement=address(displacement), rate=address(rate), omega=address(omega), force=address(force),
            stiffness=address(stiffness), memory=address(memory), inherited=address(inherited), spans=address(spans),
            turns=address(turns),
        )  # fmt: skip
        strokes = library().spring_periodic(
            self._law.address,
            ctypes.byref(self.basis.structure),
            address(coefficients),
            address(self._start),
            address(self._workspace),
            ctypes.byref(period),
        )
        if strokes == 0:
            raise ValueError("`coefficients` must describe a motion, got a constant displacement.")
        functions = self.basis.functions
        by_motion = stiffness[:, None] * functions.T
        for number, (begin, end) in enumerate(spans[: 2 * strokes].tolist()):
            by_motion[begin:end] += memory[begin:end, None] * inherited[number // 2]
        weights = np.where(np.arange(count) == 0, 1.0, 2.0)[:, None] * functions / samples
        return PeriodicForce(displacement, omega, force, weights @ force, weights @ by_motion, turns[:strokes])


def functions_at(basis: FourierBasis, phase: FloatArray) -> FloatArray:
    """The functions of a basis at any phases of shape (P,), shape (P, N)."""
    angle = phase[:, None] * basis.order[1 : basis.harmonics + 1]
    return np.hstack([np.ones((phase.size, 1)), np.cos(angle), np.sin(angle)])
