"""What the axes of mounts answer: force, tangent and secant stiffness, over the springs' displacements.

An axis of P rows of S springs whose springs are at x has the force P*r(x, omega) + f(x), f of the stops, and P/S times
the stiffness of one spring. With all functions M is the number of axes in the order of `MountedSystem.axes`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SpringParameters
from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.loop import steady_loop
from .parts import MountAxis

ComplexArray = NDArray[np.complex128]

_NO_STOPS = (-np.inf, np.inf, 0.0)
_GRID = 2001  # displacements over the identified range among which the steepest is looked for


class AxisLaws:
    """The laws of all axes of a system.

    Parameters
    ----------
    axes : sequence of MountAxis
    names : sequence of str                           What messages call them.

    Attributes
    ----------
    names : tuple of str
    parallel, series, nominal, damping : ndarray, shape (M,)   As in `MountAxis`.
    low, high : ndarray, shape (M,)                   Ends of the springs' identified ranges [m].
    stop_low, stop_high, stop_stiffness : ndarray, shape (M,)   As in `Stops`; infinite and 0 where there is none.
    """

    def __init__(self, axes: Sequence[MountAxis], names: Sequence[str]) -> None:
        self.names = tuple(names)
        given = np.array([(a.parallel, a.series, a.nominal, a.damping) for a in axes], dtype=np.float64)
        self.parallel, self.series, self.nominal, self.damping = given.T
        self.low, self.high = np.array([(a.spring.displacement_min, a.spring.displacement_max) for a in axes]).T
        stops = [(a.stops.low, a.stops.high, a.stops.stiffness) if a.stops else _NO_STOPS for a in axes]
        self.stop_low, self.stop_high, self.stop_stiffness = np.array(stops).T
        self._springs = [axis.spring for axis in axes]
        self.has_branches = any(spring.branches for spring in self._springs)

    def forces(self, springs: FloatArray, omega: FloatArray) -> FloatArray:
        """Force of each axis at rest, where branches have none, shape (M,) [N].

        Parameters
        ----------
        springs : ndarray, shape (M,)   Displacement of one spring [m].
        omega : ndarray, shape (M,)     Of the springs [-].
        """
        return np.asarray(self.parallel * self._partials(springs, omega)[0] + self.stops(springs)[0])

    def stops(self, springs: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force [N] and stiffness [N/m] of the stops at displacements of the springs of shape (M, ...) [m]."""
        shape = (-1, *[1] * (springs.ndim - 1))
        low, high, stiffness, series = (
            of_axes.reshape(shape) for of_axes in (self.stop_low, self.stop_high, self.stop_stiffness, self.series)
        )
        beyond = np.maximum(springs - high, 0.0) + np.minimum(springs - low, 0.0)
        return stiffness * series * beyond, np.where(beyond != 0.0, stiffness, 0.0)

    def tangents(self, springs: FloatArray) -> FloatArray:
        """Stiffness of each axis for small slow motion, the springs' hysteresis midway, shape (M,) [N/m].

        Parameters
        ----------
        springs : ndarray, shape (M,)   Displacement of one spring [m].
        """
        of_springs = np.empty(springs.size)
        for spring, of_axes in self._alike():
            of_springs[of_axes] = PathSolver(spring).small_motion(springs[of_axes])[1]
        return np.asarray(self.parallel / self.series * of_springs + self.stops(springs)[1])

    def of_branches(self, frequency: float) -> ComplexArray:
        """Dynamic stiffness that Maxwell branches add to each axis at Omega [rad/s], shape (M,) [N/m]."""
        sums = [sum(branch.dynamic_stiffness(frequency) for branch in spring.branches) for spring in self._springs]
        return np.asarray(self.parallel / self.series * np.array(sums, dtype=np.complex128))

    def saturated(self, springs: FloatArray) -> FloatArray:
        """Stiffness of each axis once friction is saturated, midway between both senses, shape (M,) [N/m]."""
        by_displacement = self._partials(springs, np.zeros_like(springs))[1]
        return np.asarray(self.parallel / self.series * by_displacement)

    def secants(self, springs: FloatArray, amplitudes: FloatArray) -> ComplexArray:
        """Complex stiffness of the steady loops of each axis in slow motion, shape (M,) [N/m].

        The real part is the secant stiffness k of the loop, the imaginary part W_d/(pi a^2), k times its loss factor.

        Parameters
        ----------
        springs : ndarray, shape (M,)      Displacement of one spring midway in the loop [m].
        amplitudes : ndarray, shape (M,)   Of the motion of each axis [m], > 0.

        Raises
        ------
        MountedSystemError                 If an amplitude is not finite and > 0.
        """
        for name, amplitude in zip(self.names, amplitudes.tolist(), strict=True):
            if not (np.isfinite(amplitude) and amplitude > 0.0):
                raise MountedSystemError(
                    f"For secant stiffness the motion of {name} must be finite and > 0 [m], got {amplitude!r}; give a "
                    "motion, or a pose within the identified range."
                )
        amplitude_of_spring = amplitudes / self.series
        secant = np.empty(springs.size, dtype=np.complex128)
        known: dict[tuple[SpringParameters, float, float], complex] = {}
        for k, spring in enumerate(self._springs):
            loop = (spring, float(springs[k]), float(amplitude_of_spring[k]))
            if loop not in known:
                figures = steady_loop(PathSolver(spring).slow, loop[1] - loop[2], loop[1] + loop[2]).figures
                known[loop] = complex(figures.secant_stiffness, figures.energy_per_cycle / (np.pi * loop[2] ** 2))
            secant[k] = known[loop]
        at_ends = self.stops(springs + amplitude_of_spring)[0] - self.stops(springs - amplitude_of_spring)[0]
        return np.asarray(self.parallel / self.series * secant + 0.5 * at_ends / amplitudes)

    def free_travel(self, springs: FloatArray) -> FloatArray:
        """Motion of each axis up to the nearer end of its springs' identified range, shape (M,) [m]."""
        return np.asarray(self.series * np.minimum(springs - self.low, self.high - springs))

    @cached_property
    def steepest(self) -> FloatArray:
        """An upper bound of the tangent stiffness of each axis wherever it moves, shape (M,) [N/m].

        After a reversal the tangent is FE' + kappa*(omega*FA' + rho*FA*(1 + (2*sigma - 1)*|omega|^n)), at most
        FE' + |kappa*FA'| + 2*sigma*kappa*rho*FA, of each mechanism. Beyond the identified range FE goes on with its
        slope at the end and FA with its value. Stops add their stiffness, and so do branches and a tenth: the stable
        step of a mass on a branch alone is shortest where it decays in 0.9 of a step, by 3.5 % (found numerically).
        """
        bounds = {spring: _steepest(spring) for spring in dict.fromkeys(self._springs)}
        of_springs = np.array([bounds[spring] for spring in self._springs])
        return np.asarray(self.parallel / self.series * of_springs + self.stop_stiffness)

    def _partials(self, springs: FloatArray, omega: FloatArray) -> FloatArray:
        """Force of one spring of each axis [N], and its derivative by displacement [N/m], shape (2, M)."""
        partials = np.empty((2, springs.size))
        for spring, of_axes in self._alike():
            partials[:, of_axes] = PathSolver(spring).force_with_partials(springs[of_axes], omega[of_axes])[:2]
        return partials

    def _alike(self) -> Iterator[tuple[SpringParameters, list[int]]]:
        """Each different spring with the numbers of its axes."""
        of_spring: dict[SpringParameters, list[int]] = {}
        for k, spring in enumerate(self._springs):
            of_spring.setdefault(spring, []).append(k)
        yield from of_spring.items()


def _steepest(spring: SpringParameters) -> float:
    """The bound of `AxisLaws.steepest` for one spring [N/m]."""
    grid = np.linspace(spring.displacement_min, spring.displacement_max, _GRID)
    total = 1.1 * sum(branch.stiffness for branch in spring.branches)
    for mechanism in spring.mechanisms:
        (_, rising, amplified), (_, falling, _) = (
            PathSolver(mechanism).force_with_partials(grid, np.full(_GRID, omega)) for omega in (1.0, -1.0)
        )
        total += float((np.maximum(rising, falling) + 2.0 * mechanism.sigma * mechanism.rho * amplified).max())
    return total
