"""The table of a batch: one row for each file, as CSV and as Parquet, written row by row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from ...ground.files import readable, replacing, write_csv
from ...model.joint import HYSTERETIC_UNITS
from .figures_in_batch import FIGURES
from .spring_row import UNREADABLE, SpringRow

_ROW_GROUP = 1000  # rows of Parquet that are in memory at a time
# Columns that are not numbers with a fraction.
_TEXTS = {"file", "sha256", "status", "reason", "outlier", "cautions", "model"}
_COUNTS = {"samples", "knots of FE"}
_FLAGS = {"has times"}
_UNCERTAINTY = ("standard error", "low 95 %", "high 95 %")


# A row, its `FIGURES`, and the names of those in which it differs from the batch.
TableRow = tuple[SpringRow, Sequence[float | None], Sequence[str]]


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
        cells: dict[str, Any] = {
            "file": readable(row.file),
            "sha256": row.sha256,
            "status": row.status,
            "reason": readable(row.reason) or None,
            "outlier": "; ".join(outlier) or None,
            "cautions": "; ".join(row.cautions) or None,
            "model": None if row.model_sha256 is None else f"{row.model}.json",
            "samples": row.samples,
            "has times": row.times,
            "rmse [N]": row.rmse,
            "RNL [1]": row.rnl,
            "energy over measured [1]": row.energy_ratio,
            "RNL as fitted [1]": row.fitted_rnl,
            "misfit over noise [1]": row.over_noise,
            "misfit over hysteretic force [1]": row.of_hysteresis,
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
