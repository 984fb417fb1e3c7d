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

from ..peers.filtering import Filter
from ..peers.three_point import fit_backbone_paper, three_points
from .degrees import choose_degrees
from .loops import Loops, single_branch
from .polynomials import Basis
from .smoothing import automatic_half_width, moving_average
from .spring_of_fit import Solution, is_distinct
from .stages import Backbone, Hysteresis, fit_backbone, fit_hysteresis
from .steady_part import mean_loop

# Distances from a reversal, as shares of the longest stroke, at which the steady section is taken to begin.
_STEADY_SHARES = (0.1, 0.25, 0.45, 0.65, 0.8)
# The best few by the misfit of stage 2 are carried through to the closing fit.
_CARRIED = 2
# Where the three-point formulas look at the loading branch: densely after the reversal.
_BRANCH_SHARES = ((np.arange(200) + 0.5) / 200) ** 2

Formulas = Literal["whole-branch", "three-point"]


@dataclass(frozen=True)
class TwoStageOptions:
    """Options of the two-stage method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen from the data if None.
    formulas : str                 "whole-branch" least squares, or the paper's "three-point" formulas.
    smoothing : int or None        Half width of the moving average in points; from the noise if None.
    filter : str                   What is done against noise first: only the "moving-average", or a zero-phase
                                   "low-pass" or the "fourier" series of whole periods before it.
    """

    degrees: tuple[int, int] | None = None
    formulas: Formulas = "whole-branch"
    smoothing: int | None = None
    filter: Filter = "moving-average"

    def __post_init__(self) -> None:
        if self.degrees is not None and not (1 <= self.degrees[0] <= 20 and 0 <= self.degrees[1] <= 20):
            raise ValueError(f"`degrees` must be N,M with 1 <= N <= 20 and 0 <= M <= 20, got {self.degrees}.")
        if self.formulas not in ("whole-branch", "three-point"):
            raise ValueError(f'`formulas` must be "whole-branch" or "three-point", got {self.formulas!r}.')
        if self.filter not in ("moving-average", "low-pass", "fourier"):
            raise ValueError(f'`filter` must be "moving-average", "low-pass" or "fourier", got {self.filter!r}.')
        if self.smoothing is not None and not 0 <= self.smoothing <= 10_000:
            raise ValueError(f"`smoothing` must be within [0, 10000] points, got {self.smoothing}.")


def two_stage(loops: Loops, options: TwoStageOptions) -> Solution | None:
    """Identify the spring on the steady points of its records; None if there is no steady section."""
    if options.degrees is not None:
        return _solve(loops, options.degrees, options)
    return choose_degrees(loops, lambda degrees: _solve(loops, degrees, options))


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
        if backbone is not None and is_distinct(omega):
            misfit = loops.rms(backbone.misfit(loops.force, omega))
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
    return hysteresis, loops.rms(backbone.misfit(loops.force, omega))


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
    half_width = automatic_half_width(branch, u) if smoothing is None else smoothing
    return three_points(mean.displacement - basis.low, moving_average(branch, u, half_width))
