"""Reading of measured records from the files that test rigs write."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Literal

import numpy as np

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.arguments import is_finite_number
from ..ground.quoting import quoted
from .columns import DEFAULT_UNITS, Asked, Column, choose_unit
from .content import read_content
from .formats.opening import tables_of
from .record import FloatArray, Record
from .spikes import find_spikes, spikes_of
from .tables import FileTables, Table, choose_table
from .units import Quantity, unit_factor

# Beyond any rig: the unit is wrong.
_MAX_TRAVEL = 10.0  # [m]
_MAX_FORCE = 1e9  # [N]
_SI: Mapping[Quantity, str] = {"displacement": "m", "force": "N"}


def record_of_file(
    path: str | os.PathLike[str],
    asked: Asked,
    units: Mapping[Quantity, str | None],
    adjustments: Mapping[Quantity, tuple[float, float]],
    reverse: Literal["displacement", "force"] | None = None,
    skip_bad_lines: bool = False,
) -> Record:
    """The record that a file holds; see `record_of_tables`.

    Parameters
    ----------
    skip_bad_lines : bool   Whether lines that cannot be read are left out, up to a tenth of all.

    Raises
    ------
    RecordError   If the file is not a record, with place, finding and advice in one sentence.
    """
    tables = tables_of(read_content(path), skip_bad_lines)
    return record_of_tables(tables, asked, units, adjustments, reverse)


def record_of_tables(
    file: FileTables,
    asked: Asked,
    units: Mapping[Quantity, str | None],
    adjustments: Mapping[Quantity, tuple[float, float]],
    reverse: Literal["displacement", "force"] | None,
    default_units: Mapping[Quantity, str] = DEFAULT_UNITS,
) -> Record:
    """The record that the tables of a file hold.

    Parameters
    ----------
    file : FileTables
    asked, units : mapping       Column and unit of each quantity; None to detect it.
    adjustments : mapping        Offset and factor of displacement and force.
    reverse : "displacement", "force" or None   The column to negate.
    default_units : mapping      Units where neither file nor caller gives one.

    Raises
    ------
    RecordError                  If the tables hold no record.
    """
    _refuse_useless(adjustments)
    where = file.path
    table, columns, chosen = choose_table(file, asked)
    seeks_time = asked["time"] is None
    arrays, left_out = table.read(columns.values(), optional=columns.get("time") if seeks_time else None)
    findings = [*file.findings, *table.findings, *chosen, *left_out]
    values: dict[Quantity, FloatArray] = {}
    own_units: dict[Quantity, str] = {}
    for quantity, column in columns.items():
        if column.number not in arrays:
            continue
        try:
            unit, factor, origin = choose_unit(column, quantity, units.get(quantity), where, default_units)
        except RecordError as error:
            if quantity == "time" and seeks_time and units.get("time") is None:
                findings.append(Finding(Outcome.TIME_LEFT_OUT, {"problem": str(error)}))
                continue
            raise
        own_units[quantity] = unit
        findings.append(origin)
        series = arrays.pop(column.number)  # of a long record each array counts
        offset, scale = adjustments.get(quantity, (0.0, 1.0))
        if offset != 0.0:
            findings.append(Finding(Outcome.OFFSET, {"quantity": quantity, "offset": offset}))
        if scale != 1.0:
            findings.append(Finding(Outcome.SCALE, {"quantity": quantity, "scale": scale}))
        with np.errstate(over="ignore"):  # what overflows is refused below
            values[quantity] = (series - offset) * scale * factor if (offset, scale) != (0.0, 1.0) else series * factor
        del series
    if seeks_time and "time" in values and not _is_a_clock(values["time"]):
        findings.append(Finding(Outcome.TIME_LEFT_OUT, {"column": str(columns["time"]), "problem": "it does not rise"}))
        del values["time"]
    _refuse_impossible(values, columns, own_units, table, where)
    findings += _outliers(values, table)
    if reverse is not None:
        values[reverse] = -values[reverse]
        findings.append(Finding(Outcome.REVERSED, {"quantity": reverse}))
    return Record(
        values["displacement"],
        values["force"],
        values.get("time"),
        path=where,
        sha256=file.sha256,
        findings=tuple(findings),
    )


def _refuse_useless(adjustments: Mapping[Quantity, tuple[float, float]]) -> None:
    for quantity, (offset, scale) in adjustments.items():
        if not is_finite_number(offset):
            raise RecordError(f"`{quantity}_offset` must be a finite number, got {quoted(str(offset))}.")
        if not (is_finite_number(scale) and scale > 0.0):
            raise RecordError(
                f"`{quantity}_scale` must be a finite number > 0, got {quoted(str(scale))}; negate a column with "
                "`reverse`."
            )


def _is_a_clock(time: FloatArray) -> bool:
    with np.errstate(invalid="ignore"):  # numbers may be infinite
        return time.size > 1 and bool((np.diff(time) >= 0.0).all() and time[-1] > time[0])


def _outliers(values: Mapping[Quantity, FloatArray], table: Table) -> Iterator[Finding]:
    """The isolated outliers of displacement and force, with their rows."""
    for quantity, spikes in zip(_SI, spikes_of(values["displacement"], values["force"]), strict=True):
        if spikes.size:
            places = tuple(f"{table.row} {place}" for place in table.places(spikes.tolist()))
            numbers = {quantity: tuple(values[quantity][spikes].tolist()), f"{quantity}_at": places}
            yield Finding(Outcome.OUTLIERS, numbers)


def _refuse_impossible(
    values: Mapping[Quantity, FloatArray],
    columns: Mapping[Quantity, Column],
    units: Mapping[Quantity, str],
    table: Table,
    where: str,
) -> None:
    """Refuse what no rig measures: a single sample, a constant, a size that only a wrong unit or value explains."""
    for quantity in ("displacement", "force"):
        series, place = values[quantity], f"{where}, {columns[quantity]}"
        if series.size < 2:
            raise RecordError(f"{where}: must have at least 2 rows of numbers, found {series.size}.")
        if series.min() == series.max():
            raise RecordError(
                f"{place}: the {quantity} must change, found {series[0]:.6g} in all {series.size} rows; "
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
            with np.errstate(invalid="ignore"):  # numbers may be infinite
                middle = np.median(series) if quantity == "displacement" else 0.0
                (row,) = table.places([int(np.argmax(np.abs(0.5 * series - 0.5 * middle)))])
            raise RecordError(
                f"{where}, {table.row} {row}, {columns[quantity]}: the {quantity} must {rule} at most "
                f"{limit:g} {_SI[quantity]}, found {size:.6g} {_SI[quantity]} with the unit {unit}; "
                f"{_advice(series, quantity, unit, limit / size, table.row)}"
            )


def _advice(series: FloatArray, quantity: Quantity, unit: str, needed: float, row: str) -> str:
    """Advice for too large numbers: another unit only if that makes all of them possible."""
    if find_spikes(series).size:
        return f"correct or delete the {row}."
    smaller = {"mm": "um", "N": "mN"}.get(unit, "mm" if quantity == "displacement" else "N")
    if unit_factor(smaller, quantity) <= needed * unit_factor(unit, quantity):
        return f"is the unit {smaller}?"
    return "correct the values, or name another column."
