"""Identify the springs of a batch, or what is left of them, and write the table of all."""

from __future__ import annotations

import hashlib
import math
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import JobError, Reader, StrandspringError
from ...findings import CAUTIONS, Finding, Outcome, Severity, of_severity, words
from ...ground.files import readable, reason_of, refuse_unwritable, replacing, write_csv, write_text
from ...kernel.arrays import FloatArray
from ...model.joint import HYSTERETIC_UNITS
from ..jobs.cluster import runner_of
from ..jobs.options import Workers
from ..jobs.rowlog import RowLog
from ..jobs.runners import finished_rows
from .figures_in_batch import FEWEST, FIGURES, JUDGED, common_amplitude, figures_at, outlying
from .sources import COLUMNAR_TABLE, JOURNAL, TABLE, SpringFile
from .spring_row import IDENTIFIED, UNREADABLE, BatchWork, Finished, SpringRow, digest

_MOST_NAMED = 20  # files that a summary names
_APART = ("quantity", "unit")  # numbers in which findings of a kind are told apart
_MANIFEST = {"format": "strandspring-batch", "format_version": 6}
_ROW_GROUP = 1000  # rows of Parquet that are in memory at a time
# Columns that are not numbers with a fraction.
_TEXTS = {"file", "sha256", "status", "reason", "verdict", "outlier", "cautions", "model"}
_COUNTS = {"samples", "knots of FE"}
_FLAGS = {"has times"}
_UNCERTAINTY = ("standard error", "low 95 %", "high 95 %")
# A row, its `FIGURES`, and the names of those in which it differs from the batch.
TableRow = tuple[SpringRow, Sequence[float | None], Sequence[str]]


@dataclass
class Tally:
    """Findings of files, by kind: the first of each, and the number of files.

    Examples
    --------
    >>> from strandspring.campaigns.batches.batch import Tally
    >>> tally = Tally()
    >>> for file, line in (("a.csv", 3), ("b.csv", 12), ("c.csv", 3)):
    ...     tally.add([Finding(Outcome.NO_HEADER, {"row": "line", "first": line}, file)])
    >>> tally.lines(Reader.PYTHON, list(Severity))
    ['3 files, first a.csv: The numbers begin in line 3, without a header.']
    """

    kinds: dict[tuple[Any, ...], tuple[Finding, int]] = field(default_factory=dict)

    def add(self, findings: Iterable[Finding]) -> None:
        """Count a file's findings."""
        own = {(one.kind, *(one.numbers.get(name) for name in _APART)): one for one in findings}
        for key, finding in own.items():
            first, count = self.kinds.get(key, (finding, 0))
            self.kinds[key] = first, count + 1

    def ranked(self, severities: Collection[Severity]) -> list[tuple[Finding, int]]:
        """First finding and number of files of the kinds that matter so much, those of most files first."""
        chosen = (pair for pair in self.kinds.values() if pair[0].kind.severity in severities)
        return sorted(chosen, key=lambda pair: -pair[1])

    def lines(self, reader: Reader, severities: Collection[Severity], brief: bool = False) -> list[str]:
        """One line for each kind, of some severities."""
        return [
            f"{'1 file,' if count == 1 else f'{count} files, first'} {words(finding, reader, brief)}"
            for finding, count in self.ranked(severities)
        ]

    def as_json(self, severities: Collection[Severity]) -> list[dict[str, Any]]:
        """The kinds as objects for JSON."""
        return [{**finding.as_json(), "count": count} for finding, count in self.ranked(severities)]


@dataclass
class BatchSummary:
    """What a batch gave.

    Attributes
    ----------
    files : int                       Number of files.
    statuses : Counter                How many are identified, refused, unreadable, failed.
    earlier : int                     How many were finished by an earlier run.
    problems : list of dict           `file`, `status` and `reason` of the first files that are not identified.
    amplitude : float or None         Of the engineering figures [m].
    short : str                       First file whose identified range does not reach that amplitude.
    short_count : int                 How many do not.
    figures : dict                    `median` of each, and `scatter`, the robust standard deviation of its logarithm.
    outliers : dict                   First outliers: the figures in which they differ from the batch.
    outlier_count : int
    judged : bool                     Whether there are springs enough to look for outliers.
    found : Tally                     Findings by kind.
    table, columnar_table : Path      The latter None if it could not be written.
    """

    files: int
    earlier: int
    table: Path
    columnar_table: Path | None = None
    statuses: Counter[str] = field(default_factory=Counter)
    problems: list[dict[str, str]] = field(default_factory=list)
    amplitude: float | None = None
    short: str = ""
    short_count: int = 0
    figures: dict[str, dict[str, float]] = field(default_factory=dict)
    outliers: dict[str, list[str]] = field(default_factory=dict)
    outlier_count: int = 0
    judged: bool = False
    found: Tally = field(default_factory=Tally)


def identify_batch(
    springs: Sequence[SpringFile],
    folder: Path,
    work: BatchWork,
    placing: Workers,
    amplitude: float | None = None,
    progress: Callable[[int], None] = lambda _: None,
) -> BatchSummary:
    """Identify the files that are not yet in the journal of the folder, and write the table of all.

    Parameters
    ----------
    springs : sequence of SpringFile
    folder : Path              Of the results.
    work : BatchWork
    placing : Workers
    amplitude : float or None  Of the engineering figures [m]; the largest that all springs have in common if None.
    progress : callable        Called with the number of finished files; first with that of earlier runs.

    Returns
    -------
    BatchSummary

    Raises
    ------
    StrandspringError          If the work cannot be done, or its results cannot be written; what is finished is kept.
    """
    for table in (TABLE, COLUMNAR_TABLE):
        refuse_unwritable(folder / table)
    log = SpringLog(folder, springs)
    try:
        if log.dropped:
            placing.notify(f"{log.name}: {log.dropped_sentence}; their files are identified again.")
        if changed := log.forget_changed(springs, work.settings):
            placing.notify(
                f"{changed} files were identified with other options or another version; they are identified anew."
            )
        earlier = log.finished
        progress(earlier)
        remaining = [spring for place, spring in enumerate(springs) if place not in log]
        finished = finished_rows(work, remaining, runner_of(placing), placing.notify, work.fatal)
        with closing(finished) as batches:
            for batch in batches:
                log.add([_kept(row, log, is_far=placing.scheduler is not None) for row in batch])
                progress(log.finished)
        return _written(log, len(springs), earlier, folder, amplitude)
    except StrandspringError as problem:
        if not log.finished:
            raise
        raise JobError(
            f"{problem} {log.finished} of {len(springs)} files are kept in {log.name}; the same command continues from "
            "there."
        ) from None
    finally:
        log.close(remove=False)


def _kept(finished: Finished, log: SpringLog, is_far: bool) -> SpringRow:
    """The row of a file whose model file has been written."""
    row, text = finished
    if text is not None:
        write_text(log.model_path(row), text)
    if is_far and row.size is None and digest(row.file)[0] is not None:
        raise JobError(
            f"{readable(row.file)} can be read here, but not by a worker of the cluster; put the files where all "
            "workers find them by the same path."
        )
    return row


def _written(log: SpringLog, files: int, earlier: int, folder: Path, amplitude: float | None) -> BatchSummary:
    """Write the tables from the journal, which is read several times for that rather than held in memory."""
    summary = BatchSummary(files, earlier, folder / TABLE)
    coefficients = {"kE": 0, "kA": 0}
    contents: set[str] = set()
    for row in _rows(log, files):
        _add(row, summary)
        if row.sha256 in contents:
            summary.found.add([Finding(Outcome.COPIES, {}, readable(row.file))])
        elif row.sha256 is not None:
            contents.add(row.sha256)
        for name in coefficients:
            coefficients[name] = max(coefficients[name], len(row.numbers(name)))
    summary.amplitude = amplitude or common_amplitude(_rows(log, files))
    figures = _figures(log, files, summary)
    outliers = _judge(log, figures, summary)

    def rows() -> Iterator[TableRow]:
        for place, row in enumerate(_rows(log, files)):
            known = [None if math.isnan(value) else value for value in figures[place, : len(FIGURES)].tolist()]
            yield row, known, outliers.get(place, ())

    layout = Layout(summary.amplitude, coefficients["kE"], coefficients["kA"])
    write_table(summary.table, layout, rows())
    if write_columnar_table(folder / COLUMNAR_TABLE, layout, rows()):
        summary.columnar_table = folder / COLUMNAR_TABLE
    return summary


def _rows(log: SpringLog, files: int) -> Iterator[SpringRow]:
    return (log[place] for place in range(files))


def _add(row: SpringRow, summary: BatchSummary) -> None:
    file = readable(row.file)
    summary.statuses[row.status] += 1
    if row.status != IDENTIFIED and len(summary.problems) < _MOST_NAMED:
        summary.problems.append({"file": file, "status": row.status, "reason": readable(row.reason)})
    summary.found.add(row.findings)


def _figures(log: SpringLog, files: int, summary: BatchSummary) -> FloatArray:
    """`FIGURES`, then the other ones of `JUDGED`, of every file, shape (K, figures); NaN where unknown."""
    values = array("d")
    for row in _rows(log, files):
        known = [math.nan] * len(FIGURES)
        if row.status == IDENTIFIED and summary.amplitude is not None:
            known = figures_at(row, summary.amplitude)
            if math.isnan(known[0]):
                summary.short_count += 1
                summary.short = summary.short or readable(row.file)
        others = (row.number("kappa_omega"), row.number("rho"), row.rmse)
        values.extend([*known, *(math.nan if value is None else value for value in others)])
    return np.frombuffer(values, dtype=np.float64).reshape(files, -1)


def _judge(log: SpringLog, figures: FloatArray, summary: BatchSummary) -> dict[int, list[str]]:
    """Outliers by place; they are summed up too."""
    named = dict(zip([*FIGURES, "kappa_omega", "rho", "rmse"], figures.T, strict=True))
    summary.judged = summary.statuses[IDENTIFIED] >= FEWEST
    for name, values in named.items():
        known = values[np.isfinite(values) & (values > 0.0)]
        if known.size:
            middle = float(np.median(known))
            scatter = 1.4826 * float(np.median(np.abs(np.log(known / middle))))
            summary.figures[name] = {"median": middle, "scatter": scatter}
    outliers = outlying({name: named[name] for name in JUDGED})
    summary.outlier_count = len(outliers)
    for place in list(outliers)[:_MOST_NAMED]:
        summary.outliers[readable(log[place].file)] = outliers[place]
    return outliers


class SpringLog(RowLog[SpringRow]):
    """Rows of the files of a batch, and of other files that were identified into the same folder.

    Parameters
    ----------
    folder : Path                      Of the results.
    springs : sequence of SpringFile

    Raises
    ------
    JobError                           See `RowLog`.
    """

    def __init__(self, folder: Path, springs: Sequence[SpringFile]) -> None:
        self._folder = folder
        keys = [_key(spring.file) for spring in springs]
        self._places = {key: place for place, key in enumerate(keys)}
        super().__init__(folder / JOURNAL, SpringRow, keys, _MANIFEST)

    def key(self, row: SpringRow) -> int:
        """See `RowLog`."""
        return _key(row.file)

    def place(self, key: int) -> int | None:
        """See `RowLog`."""
        return self._places.get(key)

    def check(self, manifest: object, expected: dict[str, Any]) -> None:
        """Refuse any other file."""
        if manifest != expected:
            raise JobError(
                f"{self.name} is not the journal of a batch that this version of strandspring reads; move it away, or "
                "write to another folder."
            )

    def model_path(self, row: SpringRow) -> Path:
        """Path of a spring's model file."""
        return self._folder / f"{row.model}.json"

    @staticmethod
    def _remove_model(path: Path) -> None:
        try:
            path.unlink(missing_ok=True)
        except OSError as problem:
            raise JobError(
                f"{readable(path)} belongs to a record that has changed, but cannot be removed: {reason_of(problem)}; "
                "remove it."
            ) from None

    def forget_changed(self, springs: Sequence[SpringFile], settings: str) -> int:
        """Forget rows that cannot be, of files that have changed, of other settings, or whose model file is missing or
        changed; the model files that belong to them are removed. Returns the number of those of other settings.
        """
        of_other_settings = 0
        for place, spring in enumerate(springs):
            if place not in self:
                continue
            row = self[place]
            if not row.is_possible:
                self.forget(place)
                continue
            is_there = row.status != IDENTIFIED or digest(str(self.model_path(row)))[1] == row.model_sha256
            is_known = row.sha256 is not None and digest(spring.path) == (row.size, row.sha256)
            if is_there and is_known and (row.settings, row.model) == (settings, spring.name):
                continue
            of_other_settings += row.settings != settings
            self.forget(place)
            if row.status == IDENTIFIED and is_there:
                self._remove_model(self.model_path(row))
        return of_other_settings


def _key(file: str) -> int:
    """The key of a file, which is no number, in 64 bits."""
    return int.from_bytes(hashlib.sha256(file.encode(errors="replace")).digest()[:8], "big", signed=True)


@dataclass(frozen=True)
class Layout:
    """What the columns of a table depend on.

    Parameters
    ----------
    amplitude : float or None            Common amplitude [m].
    elastic, amplifier : int             Greatest number of coefficients kE and kA.
    """

    amplitude: float | None
    elastic: int
    amplifier: int

    @property
    def headings(self) -> list[str]:
        """Of the columns."""
        nothing = SpringRow("", None, None, "", "", UNREADABLE)
        return list(self.cells((nothing, [None] * len(FIGURES), ())))

    def cells(self, table_row: TableRow) -> dict[str, Any]:
        """Values of a row by heading; None where there is none."""
        row, figures, outlier = table_row
        cautions = dict.fromkeys(finding.name for finding in of_severity(row.findings, CAUTIONS))
        cells: dict[str, Any] = {
            "file": readable(row.file),
            "sha256": row.sha256,
            "status": row.status,
            "reason": readable(row.reason) or None,
            "verdict": row.verdict,
            "outlier": "; ".join(outlier) or None,
            "cautions": "; ".join(cautions) or None,
            "model": None if row.model_sha256 is None else f"{row.model}.json",
            "samples": row.samples,
            "has times": row.times,
            "rmse [N]": row.rmse,
            "RNL [1]": row.rnl,
            "energy over measured [1]": row.energy_ratio,
            "RNL as fitted [1]": row.fitted_rnl,
            "held-out error [%]": None if row.held_out_error is None else 100.0 * row.held_out_error,
            "misfit that is not noise [1]": row.missed,
            "amplitude [m]": None if figures[0] is None else self.amplitude,
        }
        cells |= {f"{name} [{unit}]": value for (name, unit), value in zip(FIGURES.items(), figures, strict=True)}
        for name, unit in HYSTERETIC_UNITS.items():
            cells[f"{name} [{unit}]"] = row.number(name)
            known = row.uncertainty.get(name, (None, None, None))
            cells |= dict(zip((f"{name} {what} [{unit}]" for what in _UNCERTAINTY), known, strict=True))
        for name in ("displacement_offset", "displacement_min", "displacement_max"):
            cells[f"{name} [m]"] = row.number(name)
        cells["knots of FE"] = len(row.numbers("FE_knots")) or None
        for name, unit, count in (("kE", "N/m^{}", self.elastic), ("kA", "1/m^{}", self.amplifier)):
            errors = row.uncertainty.get(name, ())
            for k in range(count):
                cells[f"{name}_{k} [{unit.format(k)}]"] = dict(enumerate(row.numbers(name))).get(k)
                cells[f"{name}_{k} standard error [{unit.format(k)}]"] = dict(enumerate(errors)).get(k)
        return cells


def write_table(path: Path, layout: Layout, rows: Iterable[TableRow]) -> None:
    """Write the table as CSV."""
    write_csv(path, layout.headings, (list(layout.cells(row).values()) for row in rows))


def write_columnar_table(path: Path, layout: Layout, rows: Iterator[TableRow]) -> bool:
    """Write the table as Parquet; False if the package pyarrow is missing."""
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        return False

    def kind(heading: str) -> Any:
        if heading in _TEXTS:
            return pa.string()
        return pa.int64() if heading in _COUNTS else pa.bool_() if heading in _FLAGS else pa.float64()

    schema = pa.schema([(heading, kind(heading)) for heading in layout.headings])
    with replacing(path) as part, parquet.ParquetWriter(part, schema) as writer:
        while group := [layout.cells(row) for row in islice(rows, _ROW_GROUP)]:
            writer.write_table(pa.Table.from_pylist(group, schema=schema))
    return True
