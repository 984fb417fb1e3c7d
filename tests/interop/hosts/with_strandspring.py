"""`strandspring.simulate_fmu`."""

from __future__ import annotations

import numpy as np

from motion import TIMES, displacement
from strandspring import simulate_fmu


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
    motion = simulate_fmu(fmu, displacement(TIMES), TIMES)
    return motion.time, motion.force, motion.absorbed_energy
