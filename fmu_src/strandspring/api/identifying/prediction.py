"""`predict`: the force that a model predicts along records, and how far it is from what was measured."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.parameters import SpringParameters
from ...errors import ModelError
from ...findings import Finding
from ...ground.files import write_csv
from ...ground.options import takes
from ...ground.result_columns import ResultColumn
from ...identification.figures import Followed, RecordFit, predict_record
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.reading import Reading
from ...model.joint import ForceInterval, JointCovariance
from ...model.modelfile import ModelFile
from ...model.stated_figures import in_words
from ...records.record import Record
from ..common.given import Source, given_records
from ..common.model_source import ModelSource, model_of, source_of
from ..common.record_findings import of_records, outside, removed_effects, unrecorded
from ..common.result import PlottedResult
from ..common.table import Table
from ..common.text import fit_table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_COLUMNS = (
    ResultColumn("displacement", "m", "displacement", "displacement", "mm", 1e3),
    ResultColumn("force", "N", "force", "force", "N"),
    ResultColumn("predicted", "N", "predicted force", "predicted", "N"),
    ResultColumn("lower", "N", "lower", "lower", "N"),
    ResultColumn("upper", "N", "upper", "upper", "N"),
)


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Followed, PlottedResult):
    """Predicted forces of one or more records.

    Attributes
    ----------
    source : str                  The model file's path, or the model's name.
    model : ModelFile
    records : tuple of Record
    fits : tuple of RecordFit     Prediction and figures of each record, along its displacement as recorded.
    findings : tuple of Finding   Loops that run backwards, samples outside the identified range, effects of the rig
                                  removed from the records of the model.
    interval : ForceInterval and JointCovariance, or None   What the 95 % prediction interval is made of.
    """

    source: str
    model: ModelFile
    records: tuple[Record, ...]
    fits: tuple[RecordFit, ...]
    findings: tuple[Finding, ...]
    interval: tuple[ForceInterval, JointCovariance] | None

    @cached_property
    def half_widths(self) -> tuple[FloatArray, ...] | None:
        """Half-width of the 95 % prediction interval at each sample of each record [N]; None if the model has none."""
        if self.interval is None:
            return None
        interval, joint = self.interval
        return tuple(
            interval.reach(
                fit.predicted,
                prediction_error(self.model.parameters, joint, record, fit.omega_start),
            )
            for record, fit in zip(self.records, self.fits, strict=True)
        )

    def columns(self) -> dict[str, FloatArray]:
        """All samples of all records: number of the record from 1, displacement [m], measured and predicted force, and
        lower and upper end of the 95 % prediction interval [N] if the model has one.
        """
        predicted = np.concatenate([fit.predicted for fit in self.fits])
        columns = {
            "record": np.repeat(np.arange(1.0, len(self.records) + 1.0), [len(record) for record in self.records]),
            "displacement": np.concatenate([record.displacement for record in self.records]),
            "force": np.concatenate([record.force for record in self.records]),
            "predicted": predicted,
        }
        if self.half_widths is not None:
            half_width = np.concatenate(self.half_widths)
            columns |= {"lower": predicted - half_width, "upper": predicted + half_width}
        return columns

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """How well the model follows each record, and all if there are several."""
        if not brief:
            yield f"Predicted with {self.source}: {in_words(self.figures)}"
        yield fit_table(self.figures, self.fits)

    def content(self) -> dict[str, Any]:
        """The figures over all records, and of each."""
        return {**self.figures, "records": [{"path": fit.path, **fit.as_json()} for fit in self.fits]}

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all samples with the number of their record; displacements in mm.

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        columns = self.columns()
        numbers = columns.pop("record").astype(int).tolist()
        shown = [column for column in _COLUMNS if column.key in columns]
        rows = np.column_stack([columns[column.key] * column.factor for column in shown]).tolist()
        lines = ((number, *row) for number, row in zip(numbers, rows, strict=True))
        write_csv(Path(path), ["record", *(column.label for column in shown)], lines)

    def to_frame(self) -> pd.DataFrame:
        """One sample in each row: record (path), displacement [m], force, predicted, lower and upper [N].

        lower and upper are NaN if the model has no prediction interval.
        """
        import pandas as pd

        frame = pd.DataFrame(self.columns()).reindex(columns=["record", *(column.key for column in _COLUMNS)])
        paths = np.array([record.path for record in self.records], dtype=object)
        return frame.assign(record=paths[frame["record"].to_numpy().astype(np.intp) - 1])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw measured and predicted force over displacement; returns the axes, those of a new figure if None."""
        (axis,) = self._axes(ax)
        for number, (record, fit) in enumerate(zip(self.records, self.fits, strict=True)):
            name = f" {PurePath(record.path).name}" if len(self.records) > 1 else ""
            axis.plot(1e3 * record.displacement, record.force, color=f"C{number}", alpha=0.5, label=f"measured{name}")
            axis.plot(1e3 * record.displacement, fit.predicted, "k", lw=0.8, label=None if number else "predicted")
        axis.set(xlabel="displacement [mm]", ylabel="force [N]", title=f"RNL {self.rnl:.4f}, rmse {self.rmse:.4g} N")
        axis.legend()
        return axis


@takes(reading=Reading)
def predict(
    model: ModelSource,
    data: Source | Sequence[Source] | ArrayLike | None = None,
    force: ArrayLike | str | int | None = None,
    time: ArrayLike | str | int | None = None,
    *,
    displacement: ArrayLike | str | int | None = None,
    reading: Reading,
) -> Prediction:
    """Predict the force of records with a model, and compare it with what was measured.

    The path is the displacement as recorded, as if it drove an FMU of the model. The hysteretic state at the start of a
    measured record is unknown; it is estimated as one bounded number, `omega_start`. `Spring.response` gives the force
    along a path without a measured one.

    Parameters
    ----------
    model : Spring, ModelFile or path   A model file, or an FMU that holds one.
    data, force, time, displacement     Records, given as to `identify`.
    reading : Reading                   How they are read, and what of them is used; or its fields as keywords.

    Returns
    -------
    Prediction

    Raises
    ------
    ModelError    If the model is not a physically possible spring, or its uncertainty is damaged.
    RecordError   If the data are no records.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, predict, synthesize
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> prediction = predict(spring, synthesize(spring, noise=0.01))
    >>> round(prediction.rnl, 2)
    0.99
    >>> prediction.to_frame().columns.tolist()
    ['record', 'displacement', 'force', 'predicted', 'lower', 'upper']
    """
    content = model_of(model)
    source = source_of(model)
    interval = _interval(source, content)
    records = tuple(given_records(data, force, time, displacement, reading))
    solver = PathSolver(content.parameters)
    if not records:
        raise ValueError("`data` must hold at least one record, got none.")
    findings = [*of_records(records), *removed_effects(source, content)]
    for record in records:
        findings += outside(record.path, record.displacement, content.parameters)
        findings += unrecorded(source, content, record)
    fits = tuple(predict_record(solver, record) for record in records)
    return Prediction(source, content, records, fits, tuple(findings), interval)


def _interval(source: str, model: ModelFile) -> tuple[ForceInterval, JointCovariance] | None:
    """What the prediction interval is made of; None if the model file does not hold all of it."""
    try:
        interval = ForceInterval.from_uncertainty(model.uncertainty)
        joint = JointCovariance.from_uncertainty(model.parameters, model.uncertainty)
    except ModelError as problem:
        raise ModelError(f"{source}: {problem}") from None
    return None if interval is None or joint is None else (interval, joint)


def prediction_error(
    spring: SpringParameters, joint: JointCovariance, record: Record, omega_start: float
) -> FloatArray:
    """Standard error of the predicted force along a record, shape (K,) [N], by differences.

    Raises
    ------
    ModelError   If the covariance is so large that no neighbour of the spring is physically possible.
    """
    x, time = record.displacement, record.rising_time
    return joint.errors(spring, lambda moved: PathSolver(moved).force(x, omega_start, time))
