"""What the charts and tables of a report are made from: records with their predictions, cycles and residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from ...identification.figures import WITH_RIG, RecordFit, chosen_samples
from ...identification.identified import IdentifiedModel
from ...kernel.arrays import FloatArray, IndexArray
from ...kernel.path import PathSolver
from ...loops.cycles import Cycle, find_cycles
from ...loops.strokes import Strokes, find_strokes
from ...model.stated_figures import differ
from ...records.record import Record
from ..content.chart import evenly, visible
from ..content.quantities import DisplayUnit, prose, unit_of

SHOWN_RECORDS = 40  # in the charts
SHOWN_CYCLES = 12  # of a record, in the charts in which cycles lie over each other
_POINTS = 24_000  # of one kind of line over all records
_POINTS_OF_RECORD = (300, 6000)  # least and most
_POINTS_OF_CYCLE = 60  # least


@dataclass(frozen=True, eq=False)
class RecordView:
    """A record beside its prediction.

    Attributes
    ----------
    name : str           File name without folders.
    record : Record
    fit : RecordFit      Of the spring alone along the displacement as recorded.
    fitted : RecordFit   With what was removed from the record.
    place : int          Among the records.
    points : int         So many are drawn of a line.
    """

    name: str
    record: Record
    fit: RecordFit
    fitted: RecordFit
    place: int
    points: int

    @cached_property
    def strokes(self) -> Strokes:
        """Strokes of the measured displacement."""
        return find_strokes(self.record.displacement)

    @property
    def first(self) -> int:
        """First sample compared."""
        return self.fit.first_sample

    @cached_property
    def residuals(self) -> FloatArray:
        """Measured minus predicted force at all samples [N]; NaN where a sample is left out."""
        return self.only_compared(self.record.force - self.fit.predicted)

    @property
    def compared(self) -> FloatArray:
        """The residuals of the samples compared [N]."""
        return self.of_compared(self.residuals)

    def of_compared(self, values: FloatArray) -> FloatArray:
        """Values at the samples compared."""
        return values[self.first :][self._within[self.first :]]

    def only_compared(self, values: FloatArray) -> FloatArray:
        """Values with NaN where a range of displacement or of the force sensor leaves samples out."""
        return np.where(self._within, values, np.nan)

    @cached_property
    def _within(self) -> NDArray[np.bool_]:
        """Samples that are compared if they are not too early."""
        return chosen_samples(self.record, 0)

    @property
    def not_compared(self) -> slice | None:
        """What to draw faintly, as it is not compared, at least in part; None if all is."""
        if not self._within.all():
            return slice(0, None)
        return slice(0, self.first + 1) if self.first else None

    @cached_property
    def position(self) -> FloatArray:
        """Time from the first sample [s]; sample numbers from 1 without rising times."""
        time = self.record.rising_time
        return np.arange(1.0, len(self.record) + 1.0) if time is None else time - time[0]

    @cached_property
    def velocity(self) -> FloatArray | None:
        """Of the displacement [m/s]; None without rising times."""
        time = self.record.rising_time
        return None if time is None or time.size < 3 else np.gradient(self.record.displacement, time)

    @cached_property
    def cycles(self) -> list[tuple[int, slice]]:
        """Number and samples of the cycles compared: two strokes each, the last one with what is left.

        Of many, evenly chosen ones.
        """
        turning = self.strokes.turning
        starts = turning[np.searchsorted(turning, self.first) :: 2]
        whole = [(int(a), int(b)) for a, b in pairwise(starts)]
        if not whole:
            return [(1, slice(self.first, len(self.record)))]
        whole[-1] = (whole[-1][0], len(self.record) - 1)
        return [(k + 1, slice(whole[k][0], whole[k][1] + 1)) for k in evenly(len(whole), SHOWN_CYCLES)]

    @property
    def differs(self) -> bool:
        """Whether the figures of the spring alone and those of the fit differ visibly."""
        return differ(self.fit.figures, self.fitted.figures)

    def line(self, values: FloatArray, samples: slice) -> IndexArray:
        """Samples of a stretch at which a long line is drawn."""
        start, stop, _ = samples.indices(values.size)
        return start + visible(values[start:stop], self.points)

    def in_cycles(self, values: FloatArray) -> list[tuple[int, IndexArray]]:
        """The number of each shown cycle, and the samples at which a line over it is drawn."""
        most = max(self.points // len(self.cycles), _POINTS_OF_CYCLE)
        return [(number, samples.start + visible(values[samples], most)) for number, samples in self.cycles]

    @cached_property
    def measured_cycles(self) -> tuple[Cycle, ...]:
        """Full cycles of the part compared, as measured."""
        return find_cycles(self._compared_record(self.record.force))

    @cached_property
    def predicted_cycles(self) -> tuple[Cycle, ...]:
        """The same cycles with the predicted force."""
        return find_cycles(self._compared_record(self.fit.predicted))

    def _compared_record(self, force: FloatArray) -> Record:
        record = self.record
        # The stroke before the part compared stays, because cycles begin with the second stroke of a series.
        before = self.strokes.turning[self.strokes.turning < self.first]
        part = slice(int(before[-1]) if before.size else self.first, None)
        time = None if record.time is None else record.time[part]
        return replace(record, displacement=record.displacement[part], force=force[part], time=time)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """An identification, prepared for charts and tables.

    Parameters
    ----------
    identification : IdentifiedModel
    """

    identification: IdentifiedModel

    @cached_property
    def solver(self) -> PathSolver:
        """The spring."""
        return PathSolver(self.identification.parameters)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """File names of the records without folders; equal ones are numbered."""
        names = [PurePath(record.path).name or record.path for record in self.identification.records]
        counts = (names[: k + 1].count(name) for k, name in enumerate(names))
        return tuple(name if count == 1 else f"{name} ({count})" for name, count in zip(names, counts, strict=True))

    @cached_property
    def views(self) -> tuple[RecordView, ...]:
        """All records."""
        least, most = _POINTS_OF_RECORD
        whole = self.identification
        records = whole.records
        points = max(least, min(most, _POINTS // min(len(records), SHOWN_RECORDS)))
        rows = zip(self.names, records, whole.fits, whole.fitted, range(len(records)), strict=True)
        return tuple(RecordView(*row, points) for row in rows)

    @cached_property
    def beside(self) -> str:
        """What the fits have that the spring alone has not, in words."""
        return WITH_RIG if self.identification.effects else ""

    @cached_property
    def shown(self) -> tuple[RecordView, ...]:
        """The records in the charts: all, or evenly chosen ones of very many."""
        return tuple(self.views[k] for k in evenly(len(self.views), SHOWN_RECORDS))

    @cached_property
    def length(self) -> DisplayUnit:
        """Unit of displacements."""
        p = self.identification.parameters
        return unit_of("length", p.displacement_max - p.displacement_min)

    @cached_property
    def force(self) -> DisplayUnit:
        """Unit of forces."""
        return unit_of("force", max(float(np.abs(view.record.force).max()) for view in self.views))

    @cached_property
    def residual(self) -> DisplayUnit:
        """Unit of residuals."""
        largest = max(float(np.abs(view.compared).max()) for view in self.views)
        return unit_of("force", largest)

    def omega(self, view: RecordView) -> FloatArray:
        """omega along a record, shape (K,) [-]."""
        return self.solver.omega(view.record.displacement, view.fit.omega_start)

    def without_folders(self, text: str) -> str:
        """A sentence with the records' paths cut down to the file names."""
        pairs = zip((record.path for record in self.identification.records), self.names, strict=True)
        for path, name in sorted(pairs, key=lambda pair: -len(pair[0])):
            if path != name:
                text = text.replace(path, name)
        return text

    def prose(self, sentence: str) -> str:
        """A sentence of the identification without folders, in the notation of print."""
        return prose(self.without_folders(sentence))
