"""Simulation of a plant that its load brings into static equilibrium first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..cosimulation import FmuSpring, Iterative, Master, Motion, Plant, apply_static_load, simulate


@dataclass(frozen=True, eq=False)
class LoadedMotion:
    """q in static equilibrium, and the motion from there."""

    equilibrium: np.ndarray
    motion: Motion


def simulate_loaded(
    plant: Plant, springs: Sequence[FmuSpring], stop: float, step: float, master: Master | None
) -> LoadedMotion:
    """Load the springs, then simulate."""
    equilibrium = apply_static_load(plant, springs)
    return LoadedMotion(equilibrium, simulate(plant, springs, stop, step, master or Iterative(), q=equilibrium))
