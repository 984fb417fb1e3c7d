"""What charts and tables of an identification are made from: records beside their predictions, and engineering figures.

Engineering figures are stiffness, energy and loss factor by amplitude: measured with their scatter, and modelled with
their 95 % interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from ..findings import Outcome
from ..identification.figures import WITH_RIG, RecordFit, chosen_samples
from ..identification.identified import IdentifiedModel
from ..kernel.arrays import FloatArray, IndexArray
from ..kernel.path import PathSolver
from ..loops.cycles import Cycle, MeasuredLoop, find_cycles
from ..loops.loop import PANELS, LoopFigures, steady_loop
from ..loops.strokes import Strokes, find_strokes
from ..model.joint import NORMAL_95, JointCovariance
from ..model.stated_figures import differ
from ..records.record import Record
from .drawing import evenly, visible
from .quantities import NUMBER, DisplayUnit, prose, unit_of

SHOWN_RECORDS = 40  # in the charts
_SHOWN_CYCLES = 12  # of a record, in the charts in which cycles lie over each other
_POINTS, _POINTS_OF_RECORD = 24_000, (300, 6000)  # of one kind of line: over all records, and least and most of one
KINDS = ("stiffness", "energy", "")  # of the units of `PANELS`; empty of pure numbers
_KEYS = tuple(column.key for column in PANELS)
_NEARLY = 0.9  # share of an amplitude that counts as that amplitude
_SHARES = np.linspace(0.05, 1.0, 15)  # amplitudes of the model's curve, of half the identified range
_MOST_AMPLITUDES = 12  # in the table


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
    def within(self) -> NDArray[np.bool_]:
        """Samples that no range of displacement or of the force sensor leaves out, shape (K,)."""
        return chosen_samples(self.record, 0)

    @cached_property
    def residuals(self) -> FloatArray:
        """Measured minus predicted force at all samples [N]; NaN where a sample is left out."""
        return np.where(self.within, self.record.force - self.fit.predicted, np.nan)

    @property
    def compared(self) -> FloatArray:
        """The residuals of the samples compared [N]."""
        return self.of_compared(self.residuals)

    def of_compared(self, values: FloatArray) -> FloatArray:
        """Values at the samples compared."""
        return values[self.first :][self.within[self.first :]]

    @cached_property
    def velocity(self) -> FloatArray | None:
        """Of the displacement [m/s]; None without rising times."""
        time = self.record.rising_time
        return None if time is None or time.size < 3 else np.gradient(self.record.displacement, time)

    @cached_property
    def cycles(self) -> list[slice]:
        """Samples of the cycles compared: two strokes each, the last one with what is left."""
        turning = self.strokes.turning
        starts = turning[np.searchsorted(turning, self.first) :: 2]
        ends = [*starts[1:-1], len(self.record) - 1] if starts.size > 1 else [len(self.record) - 1]
        begins = starts[: len(ends)] if starts.size > 1 else [self.first]
        return [slice(int(a), int(b) + 1) for a, b in zip(begins, ends, strict=True)]

    def in_cycles(self, values: FloatArray) -> list[IndexArray]:
        """Samples at which a line over each cycle is drawn; of many cycles, evenly chosen ones."""
        chosen = [self.cycles[k] for k in evenly(len(self.cycles), _SHOWN_CYCLES)]
        most = max(self.points // len(chosen), 60)
        return [samples.start + visible(values[samples], most) for samples in chosen]

    @property
    def differs(self) -> bool:
        """Whether the figures of the spring alone and those of the fit differ visibly."""
        return differ(self.fit.figures, self.fitted.figures)

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


@dataclass(frozen=True)
class AmplitudeComparison:
    """One amplitude.

    Attributes
    ----------
    low, high : float                  Turning points [m].
    model : LoopFigures                The model's steady loop between them.
    reach : tuple of float             Half of the 95 % intervals of the model's `PANELS`; NaN if unknown.
    measured : MeasuredLoop or None None where nothing was measured.
    """

    low: float
    high: float
    model: LoopFigures
    reach: tuple[float, ...]
    measured: MeasuredLoop | None

    @property
    def amplitude(self) -> float:
        """Half the way between the turning points [m]."""
        return 0.5 * (self.high - self.low)


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
        points = max(least, min(most, _POINTS // min(len(whole.records), SHOWN_RECORDS)))
        rows = zip(self.names, whole.records, whole.fits, whole.fitted, range(len(whole.records)), strict=True)
        return tuple(RecordView(*row, points) for row in rows)

    @cached_property
    def shown(self) -> tuple[RecordView, ...]:
        """The records in the charts: all, or evenly chosen ones of very many."""
        return tuple(self.views[k] for k in evenly(len(self.views), SHOWN_RECORDS))

    @property
    def places(self) -> list[int]:
        """Of the records in the charts."""
        return [view.place for view in self.shown]

    def of(self, record: int | None) -> tuple[RecordView, ...]:
        """The records in a chart of one record, or of all that are shown if None."""
        return self.shown if record is None else (self.views[record],)

    @cached_property
    def beside(self) -> str:
        """What the fits have that the spring alone has not, in words."""
        return WITH_RIG if self.identification.effects else ""

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
    def largest_residual(self) -> float:
        """The largest of all samples compared [N]."""
        return max(float(np.abs(view.compared).max()) for view in self.views)

    @cached_property
    def residual(self) -> DisplayUnit:
        """Unit of residuals."""
        return unit_of("force", self.largest_residual)

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

    # Engineering figures.

    @cached_property
    def measured(self) -> tuple[MeasuredLoop, ...]:
        """The full cycles of all records, by amplitude and rate."""
        return tuple(loop for loop in self.identification.recorded if loop.cycles)

    @cached_property
    def smallest_measured(self) -> float:
        """Amplitude below which loops are extrapolated [m]; infinite if none was measured."""
        return _NEARLY * min((row.figures.amplitude for row in self.measured), default=math.inf)

    @cached_property
    def amplitudes(self) -> tuple[AmplitudeComparison, ...]:
        """The measured amplitudes, evenly chosen of many, and quarters of the identified range where none is near."""
        chosen = [self.measured[k] for k in evenly(len(self.measured), _MOST_AMPLITUDES)]
        rows: list[tuple[float, float, MeasuredLoop | None]] = [
            (row.figures.low, row.figures.high, row) for row in chosen
        ]
        for low, high in map(self._about_middle, (0.25, 0.5, 0.75, 1.0)):
            if all(abs((b - a) / (high - low) - 1.0) > 0.1 for a, b, _ in rows):
                rows.append((low, high, None))
        rows.sort(key=lambda row: row[1] - row[0])
        return self._compared(rows)

    @property
    def largest(self) -> AmplitudeComparison:
        """The largest amplitude that was measured; of the model only if there is none."""
        return max(self.amplitudes, key=lambda row: (row.measured is not None, row.amplitude))

    @cached_property
    def curve(self) -> tuple[AmplitudeComparison, ...]:
        """The model over the amplitude, about the middle of the identified range."""
        return self._compared([(*self._about_middle(share), None) for share in _SHARES.tolist()])

    def unit_of_figure(self, place: int) -> DisplayUnit:
        """The unit of one of `PANELS`."""
        of_model = [getattr(row.model, _KEYS[place]) for row in (*self.curve, *self.amplitudes)]
        measured = [getattr(row.figures, _KEYS[place]) for row in self.measured]
        return unit_of(KINDS[place], float(np.nanmax(np.abs(of_model + measured)))) if KINDS[place] else NUMBER

    def _about_middle(self, share: float) -> tuple[float, float]:
        """Turning points of a loop about the middle of the identified range, by its share of that [m]."""
        p = self.identification.parameters
        middle, half = 0.5 * (p.displacement_max + p.displacement_min), 0.5 * (p.displacement_max - p.displacement_min)
        return middle - share * half, middle + share * half

    def _compared(self, rows: list[tuple[float, float, MeasuredLoop | None]]) -> tuple[AmplitudeComparison, ...]:
        ends = [(low, high) for low, high, _ in rows]
        return tuple(
            AmplitudeComparison(low, high, steady_loop(self.solver, low, high).figures, tuple(of_row), measured)
            for (low, high, measured), of_row in zip(rows, self._reach(ends).tolist(), strict=True)
        )

    def _reach(self, ends: list[tuple[float, float]]) -> FloatArray:
        """Half of the 95 % interval of `PANELS` for loops between these turning points, shape (L, 3); NaN if unknown.

        Unknown are loops smaller than the recorded ones where the records do not decide them: another minimum may fit
        about as well, of which the covariance at this one says nothing.
        """
        whole, unknown = self.identification, np.full((len(ends), len(PANELS)), np.nan)
        joint = JointCovariance.from_uncertainty(whole.parameters, whole.uncertainty)
        if joint is None:
            return unknown
        try:
            reach = NORMAL_95 * joint.errors(whole.parameters, lambda moved: _figures(PathSolver(moved), ends))
        except ModelError:  # next to it there is no spring any more
            return unknown
        if {Outcome.SMALL_LOOPS, Outcome.ONE_AMPLITUDE} & {*whole.outcomes}:
            reach[np.array([0.5 * (high - low) for low, high in ends]) < self.smallest_measured] = np.nan
        return np.asarray(reach)


def _figures(solver: PathSolver, ends: list[tuple[float, float]]) -> FloatArray:
    loops = [steady_loop(solver, *pair).figures for pair in ends]
    return np.array([[getattr(figures, key) for key in _KEYS] for figures in loops])
