"""Figures of the loops in a record, one set per amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import RecordError
from ..records.record import Record
from .cycles import Cycle, find_cycles
from .loop import LoopFigures, group_by_amplitude, mean_figures


@dataclass(frozen=True)
class FigureSpread:
    """Standard deviation of the figures from cycle to cycle.

    Attributes
    ----------
    secant_stiffness, energy_per_cycle : float   [N/m], [J].
    loss_factor, damping_ratio : float           [-], [-].
    """

    secant_stiffness: float
    energy_per_cycle: float
    loss_factor: float
    damping_ratio: float


@dataclass(frozen=True)
class MeasuredLoop:
    """Cycles of one amplitude in a record.

    Attributes
    ----------
    path : str                     Of the record.
    figures : LoopFigures          Of the mean cycle.
    spread : FigureSpread or None  None for a single cycle.
    cycles : int                   Number of cycles.
    gap : float                    Force at the end of the loop less that at its beginning, over the loop's height [-];
                                   0 for closed loops. Where a loop is open, as in a first loading, so are the figures.
    frequency : float or None      Mean of the cycles' frequencies [Hz]; None without times.
    """

    path: str
    figures: LoopFigures
    spread: FigureSpread | None
    cycles: int
    frequency: float | None
    gap: float = 0.0


def measured_loops(record: Record) -> tuple[MeasuredLoop, ...]:
    """Figures of the loops in a record in ascending order of amplitude; cycles that agree within 3 % are averaged,
    open ones only where none is closed.

    Energies are trapezoidal sums over the samples of the closed loop; peak forces are sampled and include noise.

    Parameters
    ----------
    record : Record

    Returns
    -------
    tuple of MeasuredLoop

    Raises
    ------
    RecordError   If the record has no full cycle.
    """
    cycles = find_cycles(record)
    if not cycles:
        selected = "lies within the selected displacements; select a range that holds one"
        where = "was found; record at least one full cycle" if record.compared is None else selected
        raise RecordError(f"{record.path}: no full cycle (two consecutive strokes equal in length within 3 %) {where}.")
    return tuple(_measured(group) for group in group_by_amplitude(cycles))


def _measured(cycles: Sequence[Cycle]) -> MeasuredLoop:
    group = [cycle for cycle in cycles if cycle.gap == 0.0] or cycles
    frequencies = [cycle.frequency for cycle in group if cycle.frequency is not None]
    return MeasuredLoop(
        path=group[0].path,
        figures=mean_figures(group),
        spread=spread_of(group),
        cycles=len(group),
        frequency=float(np.mean(frequencies)) if frequencies else None,
        gap=float(np.mean([cycle.gap / cycle.figures.height for cycle in group])),
    )


def spread_of(group: Sequence[Cycle]) -> FigureSpread | None:
    """Standard deviation of the figures of cycles; None for a single one."""
    names = FigureSpread.__dataclass_fields__
    columns = ([getattr(cycle.figures, name) for cycle in group] for name in names)
    return FigureSpread(*(float(np.std(column, ddof=1)) for column in columns)) if len(group) > 1 else None
