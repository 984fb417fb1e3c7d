"""A closed loop between two turning points, its branches and its figures, and the model's steady loop."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..core.parameters import SpringParameters
from ..findings import Finding, Outcome
from ..ground.result_columns import ResultColumn
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..kernel.steady import steady_start

# Share of the amplitude within which the turning points of loops of one group agree; a change up to it counts as none.
ALIKE = 0.03
_POINTS = 513  # on each branch of the model's loop, for the peak forces and for comparing branches


@dataclass(frozen=True)
class LoopFigures:
    """Figures of a closed loop between two turning points.

    Attributes
    ----------
    low, high : float                    Turning points [m], low < high.
    force_low, force_high : float        Force at them [N].
    mean_force : float                   Mean of both branches over the displacement [N].
    min_force, max_force : float         Peak forces over the whole loop [N].
    energy_per_cycle : float             Energy absorbed in one cycle, W_d [J].
    """

    low: float
    high: float
    force_low: float
    force_high: float
    mean_force: float
    min_force: float
    max_force: float
    energy_per_cycle: float

    @property
    def stroke(self) -> float:
        """Distance between the turning points [m]."""
        return self.high - self.low

    @property
    def amplitude(self) -> float:
        """Half the stroke [m]."""
        return 0.5 * self.stroke

    @property
    def secant_stiffness(self) -> float:
        """Difference of the forces at the turning points divided by the stroke [N/m]."""
        return (self.force_high - self.force_low) / self.stroke

    @property
    def loss_factor(self) -> float:
        """eta = W_d/(2 pi W_s), W_s = secant stiffness * amplitude^2/2 [-]; NaN unless that stiffness is positive."""
        stored = 0.5 * self.secant_stiffness * self.amplitude**2
        return self.energy_per_cycle / (2.0 * math.pi * stored) if stored > 0.0 else math.nan

    @property
    def damping_ratio(self) -> float:
        """Equivalent viscous damping ratio at resonance, eta/2 [-]; NaN unless that stiffness is positive."""
        return 0.5 * self.loss_factor

    @property
    def height(self) -> float:
        """Mean distance between the branches, W_d/stroke [N]."""
        return self.energy_per_cycle / self.stroke


# Figures of `LoopFigures`.
LOOP_FIGURES = (
    ResultColumn("amplitude", "m", "amplitude", "amplitude", "mm", 1e3),
    ResultColumn("low", "m", "lower turning point", "from", "mm", 1e3),
    ResultColumn("high", "m", "upper turning point", "to", "mm", 1e3),
    ResultColumn("secant_stiffness", "N/m", "secant stiffness", "secant", "N/mm", 1e-3),
    ResultColumn("energy_per_cycle", "J", "energy per cycle", "energy", "N*mm", 1e3),
    ResultColumn("loss_factor", "1", "loss factor", "loss factor"),
    ResultColumn("damping_ratio", "1", "damping ratio", "damping ratio"),
    ResultColumn("mean_force", "N", "mean force", "mean", "N"),
    ResultColumn("min_force", "N", "min force", "min", "N"),
    ResultColumn("max_force", "N", "max force", "max", "N"),
)
LOOP_FIGURE = {column.key: column for column in LOOP_FIGURES}
# Drawn over the amplitude.
PANELS = tuple(LOOP_FIGURE[key] for key in ("secant_stiffness", "energy_per_cycle", "loss_factor"))


@dataclass(frozen=True, eq=False)
class LoopBranch:
    """Points of one branch of a loop; those of the model in ascending order of displacement."""

    displacement: FloatArray  # shape (P,) [m]
    force: FloatArray  # shape (P,) [N]

    def profile(self, cells: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force at the centres of cells of equal width [m], ascending and within the branch, and their samples."""
        width = cells[1] - cells[0]
        cell = np.floor((self.displacement - cells[0]) / width + 0.5).astype(np.intp)
        first = int(cell.min())
        count = np.bincount(cell - first)
        filled = np.flatnonzero(count)
        x, r = (np.bincount(cell - first, weights=v)[filled] / count[filled] for v in (self.displacement, self.force))
        index = np.clip(np.arange(cells.size) - first, 0, count.size - 1)
        return np.interp(cells, x, r), np.maximum(count[index], 1).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed loop."""

    figures: LoopFigures
    loading: LoopBranch
    unloading: LoopBranch
    noise: float  # standard deviation of the noise on the branches' forces [N]; 0 for the model


L = TypeVar("L", bound=Loop)


def mean_figures(loops: Sequence[Loop]) -> LoopFigures:
    """Figures of the mean loop of a group; stiffness and loss factor follow from it."""
    names = LoopFigures.__dataclass_fields__
    return LoopFigures(*(float(np.mean([getattr(loop.figures, name) for loop in loops])) for name in names))


def group_by_amplitude(loops: Iterable[L]) -> list[list[L]]:
    """Group loops whose turning points agree with the group's mean within 3 % of its amplitude, in ascending order."""
    groups: list[list[L]] = []
    means: list[FloatArray] = []
    for loop in sorted(loops, key=lambda loop: loop.figures.amplitude):
        ends = np.array([loop.figures.low, loop.figures.high])
        for k, mean in enumerate(means):
            if np.max(np.abs(ends - mean)) <= ALIKE * 0.5 * (mean[1] - mean[0]):
                groups[k].append(loop)
                means[k] = mean + (ends - mean) / len(groups[k])
                break
        else:
            groups.append([loop])
            means.append(ends)
    return groups


def steady_loop(solver: PathSolver, low: float, high: float) -> Loop:
    """The model's steady loop between two turning points [m], exact but for the peak forces, which are sampled.

    Outside the identified range the model is extrapolated linearly. Where the spring has Maxwell branches the loop is
    slow: they have relaxed.

    Raises
    ------
    ValueError   Unless both are finite and low < high.
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"`low` must be below `high`, both finite [m], got {low!r} and {high!r}.")
    solver, omega = solver.slow, steady_start(solver.parameters, high - low)
    rising = np.linspace(low, high, _POINTS)
    force = solver.force(np.concatenate([rising, rising[-2::-1]]), omega)
    loading, unloading = force[:_POINTS], force[: _POINTS - 2 : -1]
    _, loading_energy, cycle_energy = solver.absorbed_energy(np.array([low, high, low]), omega).tolist()
    figures = LoopFigures(
        low=low,
        high=high,
        force_low=float(loading[0]),
        force_high=float(loading[-1]),
        mean_force=(2.0 * loading_energy - cycle_energy) / (2.0 * (high - low)),
        min_force=float(force.min()),
        max_force=float(force.max()),
        energy_per_cycle=cycle_energy,
    )
    return Loop(figures, LoopBranch(rising, loading), LoopBranch(rising, unloading), noise=0.0)


def relaxed_branches(spring: SpringParameters) -> tuple[Finding, ...]:
    """What has to be said of the figures of a spring's loops: a caution if it has Maxwell branches, else nothing."""
    return (Finding(Outcome.RELAXED_BRANCHES),) if spring.branches else ()
