"""Reading a measured record from delimited text, in whatever way a test rig has written it."""

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
from .source import load
from .table import read_numbers
from .units import Quantity, quoted

# Larger than any rig: the unit is wrong.
_MAX_TRAVEL = 10.0  # [m]
_MAX_FORCE = 1e9  # [N]


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
    of units are found from the head of the file; what was decided is told in `Record.notes`. A unit that is
    asked for counts more than a row of units, that more than the header; without any, mm, N and s are
    assumed.

    Parameters
    ----------
    path : path-like                               The file.
    displacement, force, time : int, str or None   Columns: a name (case, unit, blanks and underscores may
        differ where only one column fits), or a 1-based number. Text of digits is a number unless a column
        is called so. None finds the column by its name or unit, and without a header takes the first of
        exactly two columns as displacement, the second as force. A column of time is optional.
    displacement_unit, force_unit : str or None    Such as "mm", "inch"; "kN", "lbf".
    reverse : "displacement", "force" or None      The column whose sign is turned.

    Returns
    -------
    Record                                         Displacement [m], force [N], time [s].

    Raises
    ------
    RecordError   With one sentence that says where, what was found and what to do, if the file is no record.
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
        notes.append(f"time is left out: {columns['time']} does not grow")
        del values["time"]
    _refuse_impossible(values, columns, units, source.path)
    if reverse is not None:
        values[reverse] = -values[reverse]
        notes.append(f"the sign of {reverse} is turned, as asked")
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


def _refuse_impossible(
    values: Mapping[Quantity, NDArray[np.float64]],
    columns: Mapping[Quantity, Column],
    units: Mapping[Quantity, str],
    path: str,
) -> None:
    """Refuse what no rig measures: a single sample, a constant, a size that only a wrong unit explains."""
    for quantity in ("displacement", "force"):
        series, where = values[quantity], f"{path}, {columns[quantity]}"
        if series.size < 2:
            raise RecordError(f"{path}: must have at least 2 rows of numbers, found {series.size}.")
        if series.min() == series.max():
            raise RecordError(
                f"{where}: the {quantity} must change, found {series[0]:.6g} in all {series.size} rows; "
                f"name the column of the {quantity}."
            )
    travel = float(np.ptp(values["displacement"]))
    if travel > _MAX_TRAVEL:
        unit = units["displacement"]
        raise RecordError(
            f"{path}, {columns['displacement']}: the displacement must range over at most {_MAX_TRAVEL:g} m, "
            f"found {travel:.6g} m with the unit {unit}; is the unit {'um' if unit == 'mm' else 'mm'}?"
        )
    largest = float(np.abs(values["force"]).max())
    if largest > _MAX_FORCE:
        unit = units["force"]
        raise RecordError(
            f"{path}, {columns['force']}: the force must be at most {_MAX_FORCE:g} N, "
            f"found {largest:.6g} N with the unit {unit}; is the unit {'mN' if unit == 'N' else 'N'}?"
        )
