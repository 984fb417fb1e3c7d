"""Reading of measured records from delimited text as test rigs write it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from .columns import Column, choose_columns, choose_unit, table_columns
from .dialect import Dialect, find_dialect
from .record import Record
from .rows import lines_of_rows, read_numbers
from .source import Source, load
from .spikes import find_spikes, spikes_of
from .units import Quantity, quoted, unit_factor

# Beyond any rig: the unit is wrong.
_MAX_TRAVEL = 10.0  # [m]
_MAX_FORCE = 1e9  # [N]
_SI: Mapping[Quantity, str] = {"displacement": "m", "force": "N"}


def read_record(
    path: str | os.PathLike[str],
    *,
    displacement: int | str | None = None,
    force: int | str | None = None,
    time: int | str | None = None,
    displacement_unit: str | None = None,
    force_unit: str | None = None,
    reverse: Literal["displacement", "force"] | None = None,
) -> Record:
    """Read displacement and force, and time where there is one, from a delimited text file.

    Separator (comma, semicolon, tab, blanks), decimal mark, encoding, lines before the table, header and row
    of units are detected from the head of the file and reported in `Record.notes`. A given unit takes
    precedence over a row of units, and that over the header; without any, mm, N and s are assumed.

    Parameters
    ----------
    path : path-like                               The file.
    displacement, force, time : int, str or None   Columns: a name (case, unit, blanks and underscores may
        differ where only one column fits), or a 1-based number. Text of digits is a number unless a column
        is called so. None finds the column by its name or unit, and without a header takes the first of
        exactly two columns as displacement, the second as force. The time column is optional.
    displacement_unit, force_unit : str or None    Such as "mm", "inch"; "kN", "lbf".
    reverse : "displacement", "force" or None      The column to negate.

    Returns
    -------
    Record                                         Displacement [m], force [N], time [s].

    Raises
    ------
    RecordError   If the file is not a record, with place, finding and advice in one sentence.
    """
    if reverse not in (None, "displacement", "force"):
        raise RecordError(f"`reverse` must be 'displacement' or 'force', got {quoted(str(reverse))}.")
    source = load(path)
    dialect = find_dialect(source.head, source.path)
    asked: dict[Quantity, int | str | None] = {"displacement": displacement, "force": force, "time": time}
    asked_units = {"displacement": displacement_unit, "force": force_unit}
    columns, chosen_notes = choose_columns(table_columns(dialect), asked, source.path)
    notes = [*source.notes, *_layout_notes(dialect), *chosen_notes]

    arrays, table_notes = read_numbers(
        source, dialect, columns.values(), optional=columns.get("time") if time is None else None
    )
    notes += table_notes
    values: dict[Quantity, NDArray[np.float64]] = {}
    units: dict[Quantity, str] = {}
    for quantity, column in columns.items():
        if column.number not in arrays:
            continue
        try:
            units[quantity], factor, note = choose_unit(column, quantity, asked_units.get(quantity), source.path)
        except RecordError as error:
            if quantity == "time" and time is None:
                notes.append(f"time is left out: {error}")
                continue
            raise
        values[quantity] = arrays[column.number] * factor
        notes.append(note)
    if time is None and "time" in values and not _is_a_clock(values["time"]):
        notes.append(f"time is left out: {columns['time']} does not increase")
        del values["time"]
    _refuse_impossible(values, columns, units, source, dialect)
    notes += _spike_notes(values, source, dialect)
    if reverse is not None:
        values[reverse] = -values[reverse]
        notes.append(f"{reverse} negated, as given")
    return Record(
        values["displacement"],
        values["force"],
        values.get("time"),
        path=source.path,
        sha256=source.sha256,
        notes=tuple(notes),
    )


def _layout_notes(dialect: Dialect) -> list[str]:
    notes = []
    if dialect.first_line > 1:
        header = "no header" if dialect.header_line is None else f"the header in line {dialect.header_line}"
        notes.append(f"the numbers begin in line {dialect.first_line}, with {header}")
    if dialect.decimal == ",":
        notes.append("the decimal mark is a comma")
    return notes


def _is_a_clock(time: NDArray[np.float64]) -> bool:
    return time.size > 1 and bool((np.diff(time) >= 0.0).all() and time[-1] > time[0])


def _spike_notes(values: Mapping[Quantity, NDArray[np.float64]], source: Source, dialect: Dialect) -> list[str]:
    """A sentence about the isolated outliers of each quantity, with their lines."""
    notes = []
    for quantity, spikes in zip(_SI, spikes_of(values["displacement"], values["force"]), strict=True):
        if spikes.size:
            lines = lines_of_rows(source, dialect, spikes.tolist())
            found = zip(lines, values[quantity][spikes], strict=True)
            places = ", ".join(f"line {line} ({value:.6g} {_SI[quantity]})" for line, value in found)
            notes.append(
                f"the {quantity} in {places} is far outside all others and from its neighbours; "
                "correct or delete faulty samples"
            )
    return notes


def _refuse_impossible(
    values: Mapping[Quantity, NDArray[np.float64]],
    columns: Mapping[Quantity, Column],
    units: Mapping[Quantity, str],
    source: Source,
    dialect: Dialect,
) -> None:
    """Refuse what no rig measures: a single sample, a constant, a size that only a wrong unit or value explains."""
    for quantity in ("displacement", "force"):
        series, where = values[quantity], f"{source.path}, {columns[quantity]}"
        if series.size < 2:
            raise RecordError(f"{source.path}: must have at least 2 rows of numbers, found {series.size}.")
        if series.min() == series.max():
            raise RecordError(
                f"{where}: the {quantity} must change, found {series[0]:.6g} in all {series.size} rows; "
                f"name the column of the {quantity}."
            )
    # The range may overflow.
    with np.errstate(over="ignore"):
        travel = float(np.ptp(values["displacement"]))
    largest = float(np.abs(values["force"]).max())
    sizes: Mapping[Quantity, tuple[float, float, str]] = {
        "displacement": (travel, _MAX_TRAVEL, "range over"),
        "force": (largest, _MAX_FORCE, "be"),
    }
    for quantity, (size, limit, rule) in sizes.items():
        if size > limit:
            series, unit = values[quantity], units[quantity]
            middle = np.median(series) if quantity == "displacement" else 0.0
            (line,) = lines_of_rows(source, dialect, [int(np.argmax(np.abs(0.5 * series - 0.5 * middle)))])
            raise RecordError(
                f"{source.path}, line {line}, {columns[quantity]}: the {quantity} must {rule} at most "
                f"{limit:g} {_SI[quantity]}, found {size:.6g} {_SI[quantity]} with the unit {unit}; "
                f"{_advice(series, quantity, unit, limit / size)}"
            )


def _advice(series: NDArray[np.float64], quantity: Quantity, unit: str, needed: float) -> str:
    """Advice for too large numbers: another unit only if that makes all of them possible."""
    if find_spikes(series).size:
        return "correct or delete the line."
    smaller = {"mm": "um", "N": "mN"}.get(unit, "mm" if quantity == "displacement" else "N")
    if unit_factor(smaller, quantity) <= needed * unit_factor(unit, quantity):
        return f"is the unit {smaller}?"
    return "correct the values, or name another column."
