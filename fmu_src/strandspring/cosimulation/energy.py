"""Where the energy went: the balance that makes the error of a master visible.

Over each step, with dq and db the movements of the plant and of the bases, f the mean load and F the spring forces as
the plant felt them, the plant's energy T + V should grow by f.dq - sum(count*F*(dd + db)) less what viscous damping
takes, and the springs should absorb sum(count*F*dd). What is left is energy that the coupling has made or lost. The
integrals over a step are taken by the midpoint rule, which `Iterative` fulfils exactly and which is of second order for
the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernel.arrays import FloatArray
from .coupling import MEAN
from .plants import Plant, quadratic_load
from .simulation import Motion


@dataclass(frozen=True, eq=False)
class EnergyBalance:
    """Energies since the beginning, each of shape (K + 1,) [J].

    Attributes
    ----------
    kinetic, elastic : ndarray    Of the plant, T and V; these two are not counted from the beginning.
    absorbed : ndarray            By all springs.
    damped : ndarray              By the plant's viscous damping.
    by_load, by_bases : ndarray   Work of the load, and of what moves the bases.
    exchanged : ndarray           Sum of the magnitudes of what plant and springs exchanged in each step.
    """

    kinetic: FloatArray
    elastic: FloatArray
    absorbed: FloatArray
    damped: FloatArray
    by_load: FloatArray
    by_bases: FloatArray
    exchanged: FloatArray

    @property
    def gap(self) -> FloatArray:
        """Energy that the coupling has made, shape (K + 1,) [J]."""
        stored = self.kinetic - self.kinetic[0] + self.elastic - self.elastic[0]
        return np.asarray(stored + self.absorbed + self.damped - self.by_load - self.by_bases)

    @property
    def error(self) -> float:
        """Largest magnitude of the gap over the energy exchanged in all; 0 if nothing was."""
        return float(np.max(np.abs(self.gap)) / self.exchanged[-1]) if self.exchanged[-1] > 0.0 else 0.0


def energy_balance(plant: Plant, motion: Motion) -> EnergyBalance:
    """The balance of a motion of a plant."""
    step = float(motion.times[1] - motion.times[0])
    moved = np.diff(motion.q, axis=0)
    bases = np.diff([plant.bases(time) for time in motion.times.tolist()], axis=0)
    loads = np.array([MEAN @ quadratic_load(plant, time, step) for time in motion.times[:-1].tolist()])
    gained = np.diff(motion.absorbed_energy, axis=0) * plant.counts
    return EnergyBalance(
        kinetic=0.5 * np.einsum("ki,ij,kj->k", motion.speed, plant.M, motion.speed),
        elastic=0.5 * np.einsum("ki,ij,kj->k", motion.q, plant.K, motion.q),
        absorbed=_summed(gained.sum(axis=1)),
        damped=_summed(np.einsum("ki,ij,kj->k", moved, plant.C, moved) / step),
        by_load=_summed(np.sum(loads * moved, axis=1)),
        by_bases=_summed(-np.sum(motion.felt * plant.counts * bases, axis=1)),
        exchanged=_summed(np.abs(gained).sum(axis=1)),
    )


def _summed(parts: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(parts)])
