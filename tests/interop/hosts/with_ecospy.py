"""Ecos; the script sets the displacement of the end of each step before it."""

from __future__ import annotations

import numpy as np
from ecospy import EcosSimulation, EcosSimulationStructure

from motion import STEP, TIMES, displacement


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
    rows = []
    with EcosSimulationStructure() as structure:
        structure.add_model("spring", fmu)
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.init()
            for time, value in zip(TIMES[1:].tolist(), displacement(TIMES[1:]).tolist(), strict=True):
                simulation.set_real("spring::displacement", value)
                simulation.step()
                rows.append(
                    [time, simulation.get_real("spring::force"), simulation.get_real("spring::absorbed_energy")]
                )
    return tuple(np.array(rows).T)
