"""Records of springs with a second mechanism and Maxwell branches, by formulas of their own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from oracles import maxwell
from strandspring import Record, Spring, SpringParameters

FIRST = SpringParameters((5.0, 3000.0, 2e4, 1e6), (1.0, 5.0), 15.0, 400.0, 1.2, 0.9, 0.0, -0.02, 0.02)
SECOND = SpringParameters((0.0,), (1.0,), 12.0, 3000.0, 0.7, 1.5, 0.0, -0.02, 0.02)


def two_rates(branches: Sequence[tuple[float, float]] = (), second: bool = False, seed: int = 0) -> list[Record]:
    """Three cycles of sines of three amplitudes, one after the other, at two rates, with white noise of 0.1 N; branches
    are pairs of stiffness [N/m] and time constant [s].
    """
    phase, records = np.arange(750) / 250, []
    path = np.concatenate([amplitude * np.sin(2.0 * np.pi * phase) for amplitude in (0.008, 0.014, 0.02)])
    for k, frequency in enumerate((0.5, 2.5)):
        time, noise = np.arange(path.size) / (250 * frequency), np.random.default_rng(seed + k)
        forces = [Spring(one).response(path) for one in (FIRST, SECOND)[: 1 + second]]
        forces += [maxwell(*branch, path, time) for branch in branches]
        force = sum(forces, 0.1 * noise.standard_normal(path.size))
        records.append(Record(path, force, time=time, path=f"rate_{k}.csv"))
    return records
