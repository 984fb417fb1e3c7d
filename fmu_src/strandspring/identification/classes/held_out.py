"""Error of a class on cycles, amplitudes and rates that it was not fitted to."""

from __future__ import annotations

import numpy as np

from ..points.sample_points import IndexArray, SamplePoints
from ..rig.effect_columns import Rig
from ..rig.other_mounts import groups_of_strokes
from .problem import ClassFit, ClassProblem

_FOLDS = 4
_GROUPS = 3  # amplitudes, rates or records from which whole ones are left out
_TOLERANCE, _EVALUATIONS = 1e-3, 12


def folds(rig: Rig, loops: SamplePoints) -> IndexArray:
    """Fold of each point, shape (P,): strokes of like amplitude, rate and record, or runs of cycles of all of them."""
    group = groups_of_strokes(rig, loops)
    names, number = np.unique(group, return_inverse=True)
    weight = np.bincount(number, weights=loops.weight)
    # Loading and unloading of unlike durations are groups, too; neither is known from the other.
    forth = np.bincount(number, weights=loops.side > 0.0)
    has_both_ways = bool(np.all((forth > 0.0) & (forth < np.bincount(number))))
    if names.size >= _GROUPS and weight.max() < 0.7 * weight.sum() and has_both_ways:
        # Of many groups, neighbours in amplitude go to different folds.
        return np.asarray(number % _FOLDS, np.intp)
    fold = np.zeros(loops.force.size, np.intp)
    for _, points in loops.by_record:
        if points.stop > points.start:
            stroke = loops.stroke[points] - loops.stroke[points.start]
            cycles = max(1, (int(stroke[-1]) + 1) // 2)
            parts = min(_FOLDS, cycles)
            fold[points] = np.minimum(stroke // 2, cycles - 1) * parts // cycles if parts > 1 else 0
    if fold.max() == 0:  # a single cycle: parts of its strokes
        fold = np.asarray((4.0 * loops.travel / loops.length[loops.stroke]).astype(np.intp) % 2)
    return fold


def held_out_error(problem: ClassProblem, fit: ClassFit, fold: IndexArray) -> float:
    """rms error [N] at the points of each fold by the class fitted to the others, where these have been."""
    loops = problem.loops
    squares = total = 0.0
    for held in range(int(fold.max()) + 1):
        out = fold == held
        if not out.any() or out.all():
            continue
        rest = loops.only(~out)
        part = ClassProblem(problem.rig, rest, fit.basis, fit.degrees, problem.branches, problem.weight[~out])
        without = part.solve(fit.shape, fit.omega_start, _TOLERANCE, _EVALUATIONS)
        there = ClassProblem(
            problem.rig, loops.only(out), fit.basis, fit.degrees, problem.branches, problem.weight[out]
        ).at(without)
        x = loops.displacement
        judged = (x[out] >= x[~out].min()) & (x[out] <= x[~out].max())
        squares += float(loops.weight[out][judged] @ (loops.force[out] - there.force)[judged] ** 2)
        total += float(loops.weight[out][judged].sum())
    return float(np.sqrt(squares / max(total, 1e-300)))
