"""The spring over whole paths: paper eqs. (10) and (22) in closed form, stroke by stroke, in the compiled kernel."""

from __future__ import annotations

import ctypes

import numpy as np
from numpy.typing import ArrayLike

from ..core.parameters import LARGEST_DISPLACEMENT, SCALARS, SpringParameters
from .arrays import FloatArray, address, floats
from .library import library
from .saturation_table import table
from .structures import structures

_COPIED = ("kE", "kA", "FE_knots", "FE_forces", *SCALARS)


def as_path(displacement: ArrayLike) -> FloatArray:
    """Check a displacement path of shape (K,), K >= 1 [m]."""
    path = floats(displacement)
    if path.ndim != 1 or path.size == 0:
        raise ValueError(f"`displacement` must have shape (K,) with K >= 1, got shape {path.shape}.")
    # NaN makes both comparisons false.
    if not (path.min() >= -LARGEST_DISPLACEMENT and path.max() <= LARGEST_DISPLACEMENT):
        bad = int(np.argmin((path >= -LARGEST_DISPLACEMENT) & (path <= LARGEST_DISPLACEMENT)))
        what = f"within +-{LARGEST_DISPLACEMENT:g}" if np.isfinite(path[bad]) else "finite"
        raise ValueError(f"`displacement` must be {what} [m], got {path[bad]} at index {bad}.")
    return path


def packed(parameters: SpringParameters) -> bytes:
    """SpringParameters of spring.h; every host is little-endian, as FMUs are."""
    p = parameters
    counts = {"elastic": len(p.kE), "amplifier": len(p.kA), "knots": len(p.FE_knots), "forces": len(p.FE_forces)}
    return bytes(structures()["SpringParameters"](**counts, **{name: getattr(p, name) for name in _COPIED}))


class Law:
    """One spring as the kernel takes it; it keeps the table of its n and sigma alive.

    Parameters
    ----------
    parameters : SpringParameters
    energies : bool              Whether energies will be asked for.
    """

    def __init__(self, parameters: SpringParameters, energies: bool = False) -> None:
        self._table = table(parameters.n, parameters.sigma, energies=energies)
        self._memory = np.empty(ctypes.sizeof(structures()["SpringLaw"]) // 8)
        library().kernel_prepare(self.address, packed(parameters), self._table.address)

    @property
    def address(self) -> int:
        """Where the kernel finds it; valid while the law lives."""
        return address(self._memory)


class PathSolver:
    """omega, force, stiffness and energy of one spring along displacement paths of shape (K,) [m].

    The first sample is where a path starts, with omega = `omega_start`.

    Parameters
    ----------
    parameters : SpringParameters
    """

    def __init__(self, parameters: SpringParameters) -> None:
        self.parameters = parameters
        self._law = Law(parameters)

    def omega(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Normalized hysteretic variable at each sample [-]."""
        return self._along(path, omega_start, 0)

    def force(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Restoring force at each sample [N], paper eq. (10)."""
        return self._along(path, omega_start, 1)

    def stiffness(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Tangent stiffness at each sample in the direction that led to it [N/m]; of loading at the first."""
        return self._along(path, omega_start, 2)

    def absorbed_energy(self, path: FloatArray, omega_start: float = 0.0) -> FloatArray:
        """Integral of the force over the displacement from the first sample to each [J]."""
        return self._along(path, omega_start, 3)

    def force_with_partials(self, path: FloatArray, omega: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force at samples with this omega [N], and its partial derivatives by displacement [N/m] and by omega [N]."""
        path, omega = floats(path), floats(omega)
        partials = np.empty((3, path.size))
        library().spring_force_at(self._law.address, path.size, address(path), address(omega), *map(address, partials))
        return partials[0], partials[1], partials[2]

    def _along(self, path: FloatArray, omega_start: float, which: int) -> FloatArray:
        """One of the four results along a path."""
        path = floats(path)
        values = np.empty_like(path)
        results = [address(values) if k == which else None for k in range(4)]
        law = Law(self.parameters, energies=True) if which == 3 else self._law
        library().spring_path(law.address, path.size, address(path), omega_start, *results)
        return values
