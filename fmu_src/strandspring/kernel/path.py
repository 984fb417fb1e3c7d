"""The spring over whole paths: paper eqs. (10) and (22) in closed form, stroke by stroke, in the compiled kernel."""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..core.parameters import LARGEST_DISPLACEMENT, SCALARS, SpringParameters
from ..errors import StrandspringError
from .arrays import FloatArray, address, floats
from .branches import maxwell_sums, require_plain
from .library import library
from .saturation_table import table
from .structures import structures

# omega where a path starts: of both mechanisms, or of each.
OmegaStart: TypeAlias = "float | tuple[float, float]"

_NOISE = 0.01  # of the identified range, by which the samples of a record may leave it
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


def warn_outside(displacement: FloatArray, low: float, high: float, stacklevel: int) -> None:
    """Warn where a displacement leaves the identified range [m] by more than the samples of a record may."""
    noise = _NOISE * (high - low)
    if displacement.min() < low - noise or displacement.max() > high + noise:
        outside = np.flatnonzero((displacement < low - noise) | (displacement > high + noise))
        warnings.warn(
            f"`displacement` must be within the identified range, {low:.6g} to {high:.6g} m, got "
            f"{displacement[outside[0]]:.6g} m at index {outside[0]}: in {outside.size} of {displacement.size} "
            "rows the force is extrapolated. Check the unit of the displacement and its zero.",
            stacklevel=stacklevel + 1,
        )


def packed(parameters: SpringParameters) -> bytes:
    """SpringParameters of spring.h; every host is little-endian, as FMUs are.

    Raises
    ------
    StrandspringError   If there is a second mechanism or a branch, which that structure does not have.
    """
    p = parameters
    require_plain(p, "This computation")
    counts = {"elastic": len(p.kE), "amplifier": len(p.kA), "knots": len(p.FE_knots), "forces": len(p.FE_forces)}
    return bytes(structures()["SpringParameters"](**counts, **{name: getattr(p, name) for name in _COPIED}))


class Law:
    """One spring as the kernel takes it; it keeps the table of its n and sigma alive.

    Parameters
    ----------
    parameters : SpringParameters   Without a second mechanism and branches.
    energies : bool                 Whether energies will be asked for.
    """

    def __init__(self, parameters: SpringParameters, energies: bool = False) -> None:
        self._memory = np.empty(ctypes.sizeof(structures()["SpringLaw"]) // 8)
        values = packed(parameters)
        self._table = table(parameters.n, parameters.sigma, energies=energies)
        library().kernel_prepare(self.address, values, self._table.address)

    @property
    def address(self) -> int:
        """Where the kernel finds it; valid while the law lives."""
        return address(self._memory)


class PathSolver:
    """omega, force, stiffness and energy of one spring along displacement paths of shape (K,) [m].

    The first sample is where a path starts, with omega = `omega_start`, one for both mechanisms or one for each, and no
    force in the branches. A spring with branches needs the times of the samples, see `branches.as_times`.

    Parameters
    ----------
    parameters : SpringParameters
    """

    def __init__(self, parameters: SpringParameters) -> None:
        self.parameters = parameters
        self._laws = tuple(map(Law, parameters.mechanisms))

    @property
    def slow(self) -> PathSolver:
        """That of motion so slow that the branches have relaxed: the same without them."""
        return PathSolver(replace(self.parameters, branches=())) if self.parameters.branches else self

    def omega(self, path: FloatArray, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Normalized hysteretic variable of the first mechanism at each sample [-]."""
        return self._along(self._laws[:1], path, omega_start, 0)

    def omegas(self, path: FloatArray, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Normalized hysteretic variable of each mechanism at each sample, shape (1, K) or (2, K) [-]."""
        starts = _of_each(omega_start, len(self._laws))
        return np.stack([self._along((law,), path, start, 0) for law, start in zip(self._laws, starts, strict=True)])

    def force(
        self,
        path: FloatArray,
        omega_start: OmegaStart = 0.0,
        time: FloatArray | None = None,
        input_resolution: float = 0.0,
    ) -> FloatArray:
        """Restoring force at each sample [N], paper eq. (10); friction follows no reversals below a resolution [m]."""
        if input_resolution > 0.0:
            resolved = np.empty_like(path)
            library().spring_resolved_path(path.size, address(path), input_resolution, address(resolved))
            omegas = self.omegas(resolved, omega_start)
            forces = [self._partials(law, path, omega)[0] for law, omega in zip(self._laws, omegas, strict=True)]
            return self._with_branches(np.sum(forces, axis=0), path, time, 0)
        return self._with_branches(self._along(self._laws, path, omega_start, 1), path, time, 0)

    def stiffness(self, path: FloatArray, omega_start: OmegaStart = 0.0) -> FloatArray:
        """Tangent stiffness at each sample in the direction that led to it [N/m]; of loading at the first.

        It is that of fast motion, which the branches follow as springs.
        """
        of_mechanisms = self._along(self._laws, path, omega_start, 2)
        branches = self.parameters.branches
        return of_mechanisms + float(sum(branch.stiffness for branch in branches)) if branches else of_mechanisms

    def absorbed_energy(
        self, path: FloatArray, omega_start: OmegaStart = 0.0, time: FloatArray | None = None
    ) -> FloatArray:
        """Integral of the force over the displacement from the first sample to each [J]."""
        laws = [Law(mechanism, energies=True) for mechanism in self.parameters.mechanisms]
        return self._with_branches(self._along(laws, path, omega_start, 3), path, time, 1)

    def stored_energy(self, path: FloatArray, time: FloatArray | None = None) -> FloatArray:
        """Energy in the springs of the branches at each sample [J], part of `absorbed_energy`; what else the branches
        have absorbed is dissipated.
        """
        return self._with_branches(np.zeros(len(path)), path, time, 2)

    def branch_force(self, path: FloatArray, time: FloatArray | None) -> FloatArray:
        """Force of the branches alone at each sample [N]."""
        return self._with_branches(np.zeros(len(path)), path, time, 0)

    def force_with_partials(self, path: FloatArray, omega: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force at samples with this omega [N], and its partial derivatives by displacement [N/m] and by omega [N].

        The omega is that of all mechanisms; branches have relaxed.
        """
        total, *others = (self._partials(law, path, omega) for law in self._laws)
        for other in others:
            total += other
        return total[0], total[1], total[2]

    def small_motion(self, path: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force at samples midway in the hysteresis [N], and stiffness for small slow motion about it [N/m]."""
        omega = np.zeros(len(path))
        force, stiffness = np.zeros(len(path)), np.zeros(len(path))
        for law, mechanism in zip(self._laws, self.parameters.mechanisms, strict=True):
            of_law, by_displacement, by_omega = self._partials(law, path, omega)
            force += of_law
            stiffness += by_displacement + mechanism.rho * by_omega
        return force, stiffness

    def _partials(self, law: Law, path: FloatArray, omega: FloatArray) -> FloatArray:
        """Force of a mechanism and its derivatives by displacement and omega, shape (3, K)."""
        path, omega = floats(path), floats(omega)
        partials = np.empty((3, path.size))
        library().spring_force_at(law.address, path.size, address(path), address(omega), *map(address, partials))
        return partials

    def _along(self, laws: Sequence[Law], path: FloatArray, omega_start: OmegaStart, which: int) -> FloatArray:
        """One of the four results along a path, summed over mechanisms."""
        path = floats(path)
        total = np.empty_like(path)
        for place, (law, start) in enumerate(zip(laws, _of_each(omega_start, len(laws)), strict=True)):
            values = total if place == 0 else np.empty_like(path)
            results = [address(values) if k == which else None for k in range(4)]
            library().spring_path(law.address, path.size, address(path), start, *results)
            if place > 0:
                total += values
        return total

    def _with_branches(self, values: FloatArray, path: FloatArray, time: FloatArray | None, which: int) -> FloatArray:
        """Values along a path with one of the sums over the branches added."""
        branches = self.parameters.branches
        if not branches:
            return values
        if time is None:
            raise StrandspringError(
                f"The force of a spring with {len(branches)} Maxwell branch{'es' if len(branches) > 1 else ''} "
                "(`branches`) depends on the times of the displacements, and none are given; give them (`time`)."
            )
        total: FloatArray = values + maxwell_sums(branches, path, time)[which]
        return total


def _of_each(omega_start: OmegaStart, mechanisms: int) -> Sequence[float]:
    """Where the omega of each of some of the mechanisms starts."""
    return omega_start[:mechanisms] if isinstance(omega_start, tuple) else [omega_start] * mechanisms
