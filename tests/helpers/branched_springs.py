"""Springs with a second mechanism and Maxwell branches, and motion for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from springs import EXAMPLES
from strandspring.core.branches import MaxwellBranch, Mechanism

FloatArray = NDArray[np.float64]

SECOND = Mechanism(kA=(1.0, 4.0, -300.0), kappa_omega=9.0, rho=2500.0, sigma=0.8, n=1.7)
BRANCHES = (MaxwellBranch(700.0, 0.03), MaxwellBranch(150.0, 1.7), MaxwellBranch(3e4, 2e-5))
BASE = EXAMPLES["stranded_wire"]
BRANCHED = {
    "second": replace(BASE, second=SECOND),
    "branches": replace(BASE, branches=BRANCHES),
    "both": replace(BASE, second=SECOND, branches=BRANCHES),
    "table": replace(EXAMPLES["table"], second=SECOND, branches=BRANCHES[:1]),
}


def uneven_motion(samples: int = 120, seed: int = 1) -> tuple[FloatArray, FloatArray]:
    """Times [s] with steps of 1e-6 to 10 s, two of them jumps and some dwells, and displacements over BASE's range."""
    generator = np.random.default_rng(seed)
    steps = 10.0 ** generator.uniform(-6.0, 1.0, samples - 1)
    steps[[7, 40]] = 0.0
    path = generator.uniform(BASE.displacement_min, BASE.displacement_max, samples)
    path[50:54] = path[50]
    return np.concatenate([[0.0], np.cumsum(steps)]), path
