"""The two-stage identification: no iteration, no initial values.

Where the steady section begins is not known beforehand. Both stages are linear and take about a millisecond, so
they are run for each of a few distances from the reversal, the misfit of stage 2 ranks them, and one closing linear
least squares with the omega found gives FE and FA over the whole range. Nothing is started from a guess and nothing
is repeated until it converges.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..model.parameters import SpringParameters
from .loops import Loops, single_branch
from .outcomes import IdentificationError, Outcome
from .polynomials import Basis
from .smoothing import automatic_half_width, moving_average
from .spring_of_fit import cautions_of, is_positive, spring_of
from .stages import (
    Backbone,
    FloatArray,
    Hysteresis,
    fit_backbone,
    fit_hysteresis,
)
from .steady import mean_loop
from .three_point import fit_backbone_paper, three_points

# Distances from a reversal, as shares of the longest stroke, at which the steady section is taken to begin.
_STEADY_SHARES = (0.1, 0.25, 0.45, 0.65, 0.8)
# The best few by the misfit of stage 2 are carried through to the closing fit.
_CARRIED = 2
# Where the three-point formulas look at the loading branch: densely after the reversal.
_BRANCH_SHARES = ((np.arange(200) + 0.5) / 200) ** 2
# Candidate degrees N, M for an automatic choice, in the order of preference.
_DEGREES = ((1, 0), (2, 1), (3, 2), (4, 3), (5, 3), (6, 4), (8, 6))
# A richer pair must lower the error of the samples not fitted by more than this.
_WORTH = 0.85
# Errors below this share of the rms force about its mean are equally good: high degrees would spend them on
# imitating the hysteresis of the one amplitude they have seen.
_GOOD_ENOUGH = 0.005
# |omega| to either side below which FE and FA can no longer be told apart, and the memory of where the record
# starts does not fade: a huge FA times a tiny omega is not a spring.
_DISTINCT = 0.6

Formulas = Literal["whole-branch", "three-point"]


@dataclass(frozen=True)
class TwoStageOptions:
    """Options of the two-stage method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen from the data if None.
    formulas : str                 "whole-branch" least squares, or the paper's "three-point" formulas.
    smoothing : int or None        Half width of the moving average in points; from the noise if None.
    """

    degrees: tuple[int, int] | None = None
    formulas: Formulas = "whole-branch"
    smoothing: int | None = None

    def __post_init__(self) -> None:
        if self.degrees is not None and not (1 <= self.degrees[0] <= 20 and 0 <= self.degrees[1] <= 20):
            raise ValueError(f"`degrees` must be N,M with 1 <= N <= 20 and 0 <= M <= 20, got {self.degrees}.")
        if self.formulas not in ("whole-branch", "three-point"):
            raise ValueError(f'`formulas` must be "whole-branch" or "three-point", got {self.formulas!r}.')
        if self.smoothing is not None and not 0 <= self.smoothing <= 10_000:
            raise ValueError(f"`smoothing` must be within [0, 10000] points, got {self.smoothing}.")


@dataclass(frozen=True, eq=False)
class Solution:
    """What the two stages found on a set of loops."""

    basis: Basis
    backbone: Backbone
    hysteresis: Hysteresis
    omega: FloatArray
    steady_share: float
    misfit: float


def two_stage(loops: Loops, options: TwoStageOptions, where: str) -> tuple[SpringParameters, Solution, list[Outcome]]:
    """Identify the spring on the steady points of its records.

    Raises
    ------
    IdentificationError   If no physically possible model is found.
    """
    solution = _choose_degrees(loops, options) if options.degrees is None else _solve(loops, options.degrees, options)
    if solution is None:
        raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
    cautions: list[Outcome] = []
    solution = _made_positive(loops, solution, cautions, where)
    cautions += cautions_of(loops, solution.hysteresis, solution.omega)
    return spring_of(solution.basis, solution.backbone, solution.hysteresis), solution, cautions


def _solve(loops: Loops, degrees: tuple[int, int], options: TwoStageOptions) -> Solution | None:
    """Both stages for every candidate steady section, the best by the rms misfit of the closing fit."""
    basis = Basis(*loops.reach, *degrees)
    longest = float(loops.length[np.unique(loops.stroke)].max())
    ranked: list[tuple[float, float, Hysteresis]] = []
    for share in _STEADY_SHARES:
        found = _stages(loops, basis, share * longest, options)
        if found is not None:
            ranked.append((found[1], share, found[0]))
    ranked.sort(key=lambda entry: entry[:2])
    solutions: list[Solution] = []
    for _, share, hysteresis in ranked:
        if len(solutions) == _CARRIED:
            break
        omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
        backbone = fit_backbone(loops, basis, omega)
        if backbone is not None and min(omega.max(), -omega.min()) >= _DISTINCT:
            misfit = _rms(loops, loops.force - backbone.FE - omega * backbone.G)
            solutions.append(Solution(basis, backbone, hysteresis, omega, share, misfit))
    return min(solutions, key=lambda s: s.misfit, default=None)


def _stages(
    loops: Loops, basis: Basis, steady_travel: float, options: TwoStageOptions
) -> tuple[Hysteresis, float] | None:
    """Stage 1 and stage 2 with the steady section beginning at `steady_travel` [m]; their misfit [N]."""
    if options.formulas == "whole-branch":
        backbone = fit_backbone(loops, basis, loops.side.astype(np.float64), loops.travel >= steady_travel)
        return None if backbone is None else fit_hysteresis(loops, backbone, options.smoothing)
    backbone = fit_backbone_paper(loops, basis, steady_travel)
    if backbone is None:
        return None
    hysteresis = _three_points_of_loading(loops, basis, backbone, options.smoothing)
    if hysteresis is None:
        return None
    omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
    return hysteresis, _rms(loops, loops.force - backbone.FE - omega * backbone.G)


def _three_points_of_loading(
    loops: Loops, basis: Basis, backbone: Backbone, smoothing: int | None
) -> Hysteresis | None:
    mean = mean_loop(loops, _BRANCH_SHARES)
    columns_E, columns_A = basis.columns(mean.displacement)
    G = columns_A @ backbone.amplified
    if not (G > 0.0).all():
        return None
    u = (mean.loading - columns_E @ backbone.elastic) / G
    branch = single_branch(mean.displacement, u)
    half_width = automatic_half_width(branch, u, 1.0) if smoothing is None else smoothing
    return three_points(mean.displacement - basis.low, moving_average(branch, u, half_width))


def _choose_degrees(loops: Loops, options: TwoStageOptions) -> Solution | None:
    """The leanest degrees that predict samples they were not fitted to nearly as well as the best."""
    chosen: Solution | None = None
    least = np.inf
    floor = _GOOD_ENOUGH * _rms(loops, loops.force - np.average(loops.force, weights=loops.weight))
    for degrees in _DEGREES:
        solution = _solve(loops, degrees, options)
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


def _made_positive(loops: Loops, solution: Solution, cautions: list[Outcome], where: str) -> Solution:
    """The solution with FA > 0 over the whole range: its degree is lowered until that holds."""
    basis, backbone = solution.basis, solution.backbone
    while not is_positive(basis, backbone):
        if basis.amplifier == 0:
            raise IdentificationError(Outcome.BRANCHES_CROSS, where)
        basis = Basis(basis.low, basis.high, basis.elastic, basis.amplifier - 1)
        fitted = fit_backbone(loops, basis, solution.omega)
        if fitted is None:
            raise IdentificationError(Outcome.TOO_FEW_STROKES, where)
        backbone = fitted
        if Outcome.AMPLIFIER_REDUCED not in cautions:
            cautions.append(Outcome.AMPLIFIER_REDUCED)
    misfit = _rms(loops, loops.force - backbone.FE - solution.omega * backbone.G)
    return Solution(basis, backbone, solution.hysteresis, solution.omega, solution.steady_share, misfit)


def _rms(loops: Loops, misfit: FloatArray) -> float:
    return float(np.sqrt(loops.weight @ misfit**2 / loops.weight.sum()))
