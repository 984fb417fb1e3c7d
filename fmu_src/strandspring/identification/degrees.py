"""Choice of the degrees N of FE and M of FA, never by the error of the samples they were fitted to."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .loops import Loops
from .spring_of_fit import Solution

# Candidate degrees N, M for an automatic choice, in the order of preference.
_DEGREES = ((1, 0), (2, 1), (3, 2), (4, 3), (5, 3), (6, 4), (8, 6))
# A richer pair must lower the error of the samples not fitted by more than this.
_WORTH = 0.85
# Errors below this share of the rms force about its mean are equally good: high degrees would spend them on
# imitating the hysteresis of the one amplitude they have seen.
_GOOD_ENOUGH = 0.005


def choose_degrees(loops: Loops, solve: Callable[[tuple[int, int]], Solution | None]) -> Solution | None:
    """The leanest degrees that predict samples they were not fitted to nearly as well as the best."""
    chosen: Solution | None = None
    least = np.inf
    floor = _GOOD_ENOUGH * loops.rms(loops.force - np.average(loops.force, weights=loops.weight))
    for degrees in _DEGREES:
        solution = solve(degrees)
        if solution is None:
            continue
        error = max(_prediction_error(loops, solution), floor)
        if error < _WORTH * least:
            chosen, least = solution, error
        if least == floor:
            break
    return chosen


def _prediction_error(loops: Loops, solution: Solution) -> float:
    """rms error [N] of FE and FA on the cycles they were not fitted to, cycles being halved by parity.

    With a single cycle Akaike's final prediction error takes its place.
    """
    cycle = (loops.stroke - loops.stroke[0]) // 2
    odd = cycle % 2 == 1
    if cycle.max() < 1 or min(odd.sum(), (~odd).sum()) < 0.3 * odd.size:
        size = loops.force.size
        terms = solution.backbone.elastic.size + solution.backbone.amplified.size
        return solution.misfit * float(np.sqrt((size + terms) / max(size - terms, 1)))
    total = 0.0
    columns_E, columns_A = solution.basis.columns(loops.displacement)
    matrix = np.hstack([columns_E, solution.omega[:, None] * columns_A])
    root = np.sqrt(loops.weight)
    for fitted in (odd, ~odd):
        coefficients = np.linalg.lstsq((matrix * root[:, None])[fitted], (loops.force * root)[fitted], rcond=1e-12)[0]
        left = ~fitted
        total += float(loops.weight[left] @ (loops.force[left] - matrix[left] @ coefficients) ** 2)
    return float(np.sqrt(total / loops.weight.sum()))
