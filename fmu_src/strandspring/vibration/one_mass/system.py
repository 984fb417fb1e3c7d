"""One mass on hysteretic springs: the mount, its load and its excitation.

With z the displacement of the mount (mass relative to base, S springs in series sharing it, P such rows side by side),
y the displacement of the base and L the static load,

    m*z'' + c*z' + P*r(z/S) = L - m*y'' + f(t).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import IsolationError
from ...ground.gravity import STANDARD_GRAVITY
from ...ground.result_columns import figure
from ...kernel.path import PathSolver
from .options import MASS_RANGE, Mount

_GRID = 2001  # displacements over the identified range among which the static equilibrium is looked for


@dataclass(frozen=True)
class IsolatedMass:
    """A mass on a mount of equal springs.

    Parameters
    ----------
    spring : SpringParameters
    mass : float            [kg], within MASS_RANGE.
    mount : Mount

    Raises
    ------
    IsolationError          If the mass is out of its bounds.
    """

    spring: SpringParameters
    mass: float
    mount: Mount = field(default_factory=Mount)

    def __post_init__(self) -> None:
        if not MASS_RANGE[0] <= self.mass <= MASS_RANGE[1]:
            raise IsolationError(
                f"`mass` must be within [{MASS_RANGE[0]:g}, {MASS_RANGE[1]:g}] kg, got {self.mass!r}; check its unit."
            )

    @property
    def static_load(self) -> float:
        """Load along the axis [N]."""
        return self.mass * STANDARD_GRAVITY if self.mount.load is None else self.mount.load


@dataclass(frozen=True)
class StaticEquilibrium:
    """Static equilibrium of the mass."""

    displacement: float = figure("m", "displacement of a spring", "spring", "mm", 1e3)  # with omega 0
    # Of the mount, from where its springs' force is zero with omega 0; NaN if that is outside the identified range.
    sag: float = figure("m", "static sag", "sag", "mm", 1e3)
    # Of one spring with the hysteresis saturated, loaded from below and unloaded from above; held at the ends of the
    # identified range.
    min: float = figure("m", "lowest displacement by friction", "lowest", "mm", 1e3)
    max: float = figure("m", "highest displacement by friction", "highest", "mm", 1e3)
    # Of the mount for small motion, hysteresis unsaturated; of slow motion where there are Maxwell branches.
    stiffness: float = figure("N/m", "stiffness of small motion", "stiffness", "N/mm", 1e-3)
    # sqrt(stiffness/mass)/(2 pi), of the stiffness that branches have at that frequency.
    frequency: float = figure("Hz", "natural frequency", "natural", "Hz")


def static_equilibrium(system: IsolatedMass) -> StaticEquilibrium:
    """Find the static equilibrium under the load.

    Raises
    ------
    IsolationError   If there is none within the identified range, or it is not stable.
    """
    p = system.spring
    solver = PathSolver(p)
    grid = np.linspace(p.displacement_min, p.displacement_max, _GRID)
    load = system.static_load / system.mount.parallel

    def backbone(omega: float) -> np.ndarray:
        return solver.force_with_partials(grid, np.full(_GRID, omega))[0]

    middle = backbone(0.0)
    if not middle.min() <= load <= middle.max():
        raise IsolationError(
            f"The static load of {load:.6g} N on each spring must lie within the forces of the identified range, "
            f"{middle.min():.6g} to {middle.max():.6g} N{_masses(system, middle)}; use another mass, load or number of "
            "springs."
        )
    equilibrium = _crossing(grid, middle, load)
    zero = _crossing(grid, middle, 0.0) if middle.min() <= 0.0 <= middle.max() else math.nan
    stiffness = system.mount.stiffness_scale * float(solver.small_motion(np.array([equilibrium]))[1][0])
    if not stiffness > 0.0:
        raise IsolationError(
            f"The static equilibrium at {1e3 * equilibrium:.6g} mm is not stable, because the force falls there as the "
            "displacement rises; use another mass or load."
        )
    # Loaded from below omega is 1 at most, unloaded from above -1 at least; the first place with the load holds.
    from_below = np.maximum.accumulate(backbone(1.0))
    from_above = np.minimum.accumulate(backbone(-1.0)[::-1])[::-1]
    reached = [float(np.interp(load, forces, grid)) for forces in (from_below, from_above)]
    return StaticEquilibrium(
        displacement=equilibrium,
        sag=system.mount.series * (equilibrium - zero),
        min=min(reached),
        max=max(reached),
        stiffness=stiffness,
        frequency=_natural_frequency(system, stiffness) / (2.0 * math.pi),
    )


def branch_stiffness(system: IsolatedMass, frequency: float) -> complex:
    """Dynamic stiffness that Maxwell branches give the mount at Omega [rad/s]; its real part is elastic [N/m]."""
    return system.mount.stiffness_scale * sum(branch.dynamic_stiffness(frequency) for branch in system.spring.branches)


def _natural_frequency(system: IsolatedMass, slow: float) -> float:
    """Omega of small motion [rad/s], with the elastic part of the branches, which rises with Omega."""
    low, high = (
        math.sqrt((slow + system.mount.stiffness_scale * more) / system.mass)
        for more in (0.0, sum(branch.stiffness for branch in system.spring.branches))
    )
    while system.spring.branches and low < (middle := 0.5 * (low + high)) < high:
        is_below = slow + branch_stiffness(system, middle).real > system.mass * middle**2
        low, high = (middle, high) if is_below else (low, middle)
    return low


def free_travel(system: IsolatedMass, equilibrium: StaticEquilibrium) -> float:
    """Distance of the mount from static equilibrium to the nearer end of the identified range [m]."""
    p = system.spring
    return system.mount.series * min(
        equilibrium.displacement - p.displacement_min, p.displacement_max - equilibrium.displacement
    )


def _masses(system: IsolatedMass, forces: np.ndarray) -> str:
    """Which masses rest within these forces of one spring, in words; nothing where the load is not the weight."""
    if system.mount.load is not None:
        return ""
    least, greatest = (
        max(0.0, float(end)) * system.mount.parallel / STANDARD_GRAVITY for end in (forces.min(), forces.max())
    )
    return f", where {least:.6g} to {greatest:.6g} kg can rest" if greatest > 0.0 else ", where no mass can rest"


def _crossing(grid: np.ndarray, force: np.ndarray, level: float) -> float:
    """First displacement at which a sampled force rises through a level within its range; falls through it if none."""
    below, above = force[:-1] < level, force[1:] >= level
    for cells in (np.flatnonzero(below & above), np.flatnonzero(below != ~above)):
        if cells.size:
            cell = int(cells[0])
            share = (level - force[cell]) / (force[cell + 1] - force[cell])
            return float(grid[cell] + share * (grid[cell + 1] - grid[cell]))
    return float(grid[np.argmin(np.abs(force - level))])
