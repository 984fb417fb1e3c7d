"""Standard errors by a bootstrap over whole strokes, which holds where the residuals of a stroke are alike."""

from __future__ import annotations

import numpy as np

from ...model.outcomes import IdentificationError, Outcome
from ..least_squares.linearised import Linearised
from ..least_squares.projection import Problem
from ..least_squares.refinement import FAIR_TOLERANCE


def bootstrap(linear: Linearised, repetitions: int, seed: int, where: str) -> dict[str, float]:
    """Standard errors of kappa_omega, rho, sigma and n from refits to strokes drawn with replacement.

    The weights stay those of the fit.

    Parameters
    ----------
    linear : Linearised   The fit.
    repetitions, seed : int
    where : str           Names of the records, for messages.

    Raises
    ------
    IdentificationError   If there are not two strokes in each direction to draw from.
    """
    loops, basis, refinement = linear.loops, linear.basis, linear.refinement
    generator = np.random.default_rng(seed)
    strokes = loops.used
    # Loading and unloading are drawn apart: without one of them FE and FA cannot be separated.
    groups = [strokes[loops.direction[strokes] == side] for side in (1, -1)]
    fewest = min(group.size for group in groups)
    if fewest < 2:
        raise IdentificationError(Outcome.TOO_FEW_TO_DRAW, where)
    problem = Problem(loops, basis, refinement.hysteresis, coarse=True)
    rows = []
    for _ in range(repetitions):
        count = np.zeros(int(strokes.max()) + 1)
        for group in groups:
            count[group] = generator.multinomial(group.size, np.full(group.size, 1.0 / group.size))
        weight = refinement.weight * count[loops.stroke]
        again = problem.solve(refinement.hysteresis, refinement.omega_start, weight, FAIR_TOLERANCE)
        powers = basis.powers(again.backbone.amplified)
        rows.append((powers[0], again.hysteresis.rho, again.hysteresis.sigma, again.hysteresis.n))
    # Draws from m strokes vary by m - 1 parts in m of what m strokes do.
    errors = np.std(np.array(rows), axis=0, ddof=1) * np.sqrt(fewest / (fewest - 1.0))
    return dict(zip(("kappa_omega", "rho", "sigma", "n"), errors.tolist(), strict=True))
