"""Energy balance of a co-simulation; its residual is the error of the coupling.

Over each step the plant's energy should increase by the work of loads and bases less what is damped and absorbed by the
springs. Integrals over a step use the midpoint rule, exact for `Iterative` and of second order otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from strandspring.cosimulation import Motion, Plant
from strandspring.cosimulation.plants import quadratic_load

_MEAN = np.array([1.0, 1.0 / 2.0, 1.0 / 3.0])  # of 1, s, s^2 over a step
_STANDSTILL = 1e-9  # m: travel too small for the quotient of energy and travel


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Sums over time of the energy that the coupling has generated, that dampers and springs have taken up, and of the
    magnitudes exchanged by plant and springs, each of shape (K + 1,) [J].
    """

    residual: np.ndarray
    damped: np.ndarray
    absorbed: np.ndarray
    exchanged: np.ndarray

    @property
    def relative_error(self) -> float:
        """Largest magnitude of the residual over the total energy exchanged."""
        return float(np.max(np.abs(self.residual)) / self.exchanged[-1])


def energy_balance(plant: Plant, motion: Motion) -> EnergyBalance:
    """Energy balance of a simulated motion of the plant."""
    step = float(motion.times[1] - motion.times[0])
    increments = np.diff(motion.q, axis=0)
    base_increments = np.diff([plant.base_displacements(time) for time in motion.times.tolist()], axis=0)
    loads = np.array([_MEAN @ quadratic_load(plant, time, step) for time in motion.times[:-1].tolist()])
    travel, energies = np.diff(motion.displacement, axis=0), np.diff(motion.absorbed_energy, axis=0)
    moves = np.abs(travel) > _STANDSTILL
    forces = np.where(moves, energies / np.where(moves, travel, 1.0), 0.5 * (motion.force[1:] + motion.force[:-1]))
    kinetic = 0.5 * np.einsum("ki,ij,kj->k", motion.velocity, plant.M, motion.velocity)
    elastic = 0.5 * np.einsum("ki,ij,kj->k", motion.q, plant.K, motion.q)
    damped = _cumulative(np.einsum("ki,ij,kj->k", increments, plant.C, increments) / step)
    absorbed = _cumulative((energies * plant.counts).sum(axis=1))
    work = _cumulative(np.sum(loads * increments, axis=1) - np.sum(forces * plant.counts * base_increments, axis=1))
    stored = kinetic - kinetic[0] + elastic - elastic[0]
    exchanged = _cumulative(np.abs(energies * plant.counts).sum(axis=1))
    return EnergyBalance(stored + absorbed + damped - work, damped, absorbed, exchanged)


def _cumulative(increments: np.ndarray) -> np.ndarray:
    return np.concatenate([[0.0], np.cumsum(increments)])
