"""Steady force of a spring under a periodic displacement given by its Fourier series, with exact derivatives.

A period is a closed chain of monotone strokes between the turning points of the series. The memory at the first of
them is the fixed point of one period, found on the turning points alone; then every sample of the period follows in
one vectorised call from omega = d*W(xi0 + rho*s) (`model.saturation`).

The derivatives follow the same chain. With D the direction of stroke k, which begins at displacement z_k,

    d omega = D*W'(xi)*(d xi0 + rho*D*(dz - dz_k)),     d xi0 = D*d omega_k/W'(xi0),

and where the stroke ends this is d omega of the next beginning: a linear recursion once around the period. A turning
point moves with the series itself, since dz/dtau = 0 there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.parameters import SpringParameters
from ..kernel.arrays import FloatArray, address
from ..kernel.library import library
from ..kernel.path import PathSolver
from ..kernel.table import table

_NEWTON_STEPS = 3  # for turning points between samples: 1e-3 of their distance, 1e-6, 1e-12
_STEEPEST = 1.0 - 1e-9  # slope of omega after a period over omega before it; it is 1 for motion too small for a loop


@dataclass(frozen=True, eq=False)
class PeriodicForce:
    """Steady force over one period, sampled at equal phases.

    Attributes
    ----------
    displacement, force, omega : ndarray, shape (K,)   [m], [N], [-].
    derivatives : ndarray, shape (K, 2H + 1)           Of the force by the Fourier coefficients [N/m].
    turns : ndarray, shape (S,)                        Displacement at the turning points [m].
    """

    displacement: FloatArray
    force: FloatArray
    omega: FloatArray
    derivatives: FloatArray
    turns: FloatArray


class FourierBasis:
    """1, cos(k tau), sin(k tau), k = 1..H, at K equal phases.

    Parameters
    ----------
    harmonics, samples : int   H and K; K > 2H.
    """

    def __init__(self, harmonics: int, samples: int) -> None:
        self.harmonics = harmonics
        self.order = np.arange(1, harmonics + 1)
        self.phase = 2.0 * np.pi * np.arange(samples) / samples
        self.columns = self.at(self.phase)
        # Coefficients of a sampled signal: the columns are orthogonal.
        scale = np.full(2 * harmonics + 1, 2.0 / samples)
        scale[0] = 1.0 / samples
        self.projection = (self.columns * scale).T

    def at(self, phase: FloatArray) -> FloatArray:
        """The basis at any phases of shape (P,), shape (P, 2H + 1)."""
        angle = phase[:, None] * self.order
        return np.hstack([np.ones((phase.size, 1)), np.cos(angle), np.sin(angle)])

    def differentiate(self, coefficients: FloatArray) -> FloatArray:
        """Coefficients of the derivative by the phase."""
        cosine, sine = np.split(coefficients[1:], 2)
        return np.concatenate([[0.0], self.order * sine, -self.order * cosine])


class PeriodicSpring:
    """One spring under periodic displacements; keeps the last memory to start the search for the next.

    Parameters
    ----------
    parameters : SpringParameters
    basis : FourierBasis
    """

    def __init__(self, parameters: SpringParameters, basis: FourierBasis) -> None:
        self.basis = basis
        self.parameters = parameters
        self._solver = PathSolver(parameters)
        self._table = table(parameters.n, parameters.sigma)
        self._omega = np.array([0.5])

    def respond(self, coefficients: FloatArray) -> PeriodicForce:
        """The steady force under ``basis.columns @ coefficients`` [m], which must move."""
        p, basis = self.parameters, self.basis
        z = basis.columns @ coefficients
        at = self._turning_phases(coefficients)
        columns = basis.at(at)
        turns = columns @ coefficients
        # From the highest turning point on, where omega depends least on what was before.
        top = int(np.argmax(turns))
        order = (np.arange(turns.size) + top) % turns.size
        at, columns, turns = at[order], columns[order], turns[order]
        length = np.abs(turns[(np.arange(turns.size) + 1) % turns.size] - turns)
        direction = np.where(np.arange(turns.size) % 2 == 0, -1.0, 1.0)
        start_xi, start_slope, end_slope = self._memory(p.rho * length, direction)
        stroke = (np.searchsorted(np.sort(at), basis.phase, side="right") - 1 + int(np.argmin(at))) % turns.size
        side = direction[stroke]
        # Samples within rounding of a turning point may lie a bit beyond it.
        xi = start_xi[stroke] + p.rho * np.maximum(side * (z - turns[stroke]), 0.0)
        u = self._table.saturation(xi)
        omega = side * u
        slope = self._slope(u)
        begin = self._start_derivatives(direction, columns, start_slope, end_slope)
        # Derivatives of xi0 - rho*D*z_k by the coefficients, for each stroke.
        inherited = direction[:, None] * (begin / start_slope[:, None] - p.rho * columns)
        by_omega = (side * slope)[:, None] * (inherited[stroke] + (p.rho * side)[:, None] * basis.columns)
        force, by_z, by_w = self._solver.force_with_partials(z, omega)
        derivatives = by_z[:, None] * basis.columns + by_w[:, None] * by_omega
        return PeriodicForce(z, force, omega, derivatives, turns)

    def _turning_phases(self, coefficients: FloatArray) -> FloatArray:
        """Phases at which the series turns, rising; refined between the samples by Newton's method."""
        basis = self.basis
        first = basis.differentiate(coefficients)
        speed = basis.columns @ first
        rising = speed > 0.0
        cell = np.flatnonzero(rising != np.roll(rising, -1))
        if cell.size == 0:
            raise ValueError("`coefficients` must describe a motion, got a constant displacement.")
        width = basis.phase[1]
        low = basis.phase[cell]
        here, there = speed[cell], np.roll(speed, -1)[cell]
        phase = low + width * here / (here - there)
        both = np.stack([first, basis.differentiate(first)], axis=1)
        for _ in range(_NEWTON_STEPS):
            rate, curvature = (basis.at(phase) @ both).T
            # Within the cell, also where the curvature vanishes.
            step = np.divide(rate, curvature, out=np.zeros_like(rate), where=curvature != 0.0)
            phase = np.clip(phase - step, low, low + width)
        return np.asarray(phase)

    def _memory(self, way: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """xi at the beginning of each stroke of the steady period, and W' at the beginning and end of each."""
        way = np.ascontiguousarray(way)
        xi = np.empty(way.size)
        library().spring_steady(
            self._table.address,
            way.size,
            address(way),
            int(direction[0]),
            address(self._omega),
            address(xi),
        )
        return xi, self._slope(self._table.saturation(xi)), self._slope(self._table.saturation(xi + way))

    def _slope(self, u: FloatArray) -> FloatArray:
        """W' where W is u, paper eq. (22); never quite zero, so that it may divide."""
        p = self.parameters
        bend = np.where(u >= 0.0, -1.0, 2.0 * p.sigma - 1.0)
        return np.maximum(1.0 + bend * np.abs(u) ** p.n, 1e-15)

    def _start_derivatives(
        self, direction: FloatArray, columns: FloatArray, start_slope: FloatArray, end_slope: FloatArray
    ) -> FloatArray:
        """Derivatives of omega at the beginning of each of S strokes by the coefficients, shape (S, 2H + 1)."""
        ratio = end_slope / start_slope
        moved = (self.parameters.rho * end_slope)[:, None] * (np.roll(columns, -1, axis=0) - columns)
        along = np.zeros(columns.shape[1])
        for gain, shift in zip(ratio, moved, strict=True):
            along = gain * along + shift
        begin = np.empty_like(columns)
        if direction.size == 2:
            # By the symmetry of the two strokes; 1 - prod(ratio) vanishes where the loop does.
            begin[0] = moved[1] / (1.0 + ratio[0])
        else:
            begin[0] = along / (1.0 - min(float(np.prod(ratio)), _STEEPEST))
        for k in range(direction.size - 1):
            begin[k + 1] = ratio[k] * begin[k] + moved[k]
        return begin
