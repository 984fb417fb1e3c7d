"""Columns of a record file by name or number: time and whatever else is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import RecordError
from ...kernel.arrays import FloatArray
from ...records.columns import Column, asked_column, choose_unit, listed_columns, named_columns
from ...records.content import FileContent
from ...records.formats.opening import tables_of
from ...records.tables import Table
from .quantity_text import QuantityError, QuantityKind, unit_in_si

MOST_ROWS = 10_000_000


@dataclass(frozen=True)
class RecordColumn:
    """What is asked of a column.

    Parameters
    ----------
    column : int or str      Its number from 1 on, or its name.
    quantity : QuantityKind  What it holds.
    unit : str or None       None for that of the file, which must give one then.
    """

    column: int | str
    quantity: QuantityKind
    unit: str | None = None


def read_columns(content: FileContent, wanted: Mapping[str, RecordColumn]) -> dict[str, FloatArray]:
    """Columns in SI units.

    Parameters
    ----------
    content : FileContent  Of a file of any format that records have.
    wanted : mapping       The columns, by what messages call them.

    Returns
    -------
    dict of ndarray, each of shape (K,)

    Raises
    ------
    RecordError            If the file has no such columns; the message names it.
    """
    table, columns, where = _table(content, {name: record_column.column for name, record_column in wanted.items()})
    factors = {name: _factor(columns[name], record_column, where) for name, record_column in wanted.items()}
    return _read(table, columns, factors, where)


def read_timed_columns(
    content: FileContent, wanted: Mapping[str, RecordColumn], time: int | str | None, time_unit: str | None
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Times [s], and columns in SI units, as `read_columns`; the column of times is found by its name if None."""
    asked: dict[str, int | str | None] = {name: record_column.column for name, record_column in wanted.items()}
    table, columns, where = _table(content, asked | {"time": time})
    factors = {name: _factor(columns[name], record_column, where) for name, record_column in wanted.items()}
    factors["time"] = choose_unit(columns["time"], "time", time_unit, where)[1]
    values = _read(table, columns, factors, where)
    return values.pop("time"), values


def _table(content: FileContent, asked: Mapping[str, int | str | None]) -> tuple[Table, dict[str, Column], str]:
    """The first table that has all columns."""
    refusals = []
    for table in tables_of(content).tables:
        try:
            columns = {name: _column(table, column, name, content.path) for name, column in asked.items()}
        except RecordError as refusal:
            refusals.append(refusal)
            continue
        numbers = [column.number for column in columns.values()]
        if len({*numbers}) < len(numbers):
            raise RecordError(f"{content.path}: each column must be named once, got one twice; name another.")
        return table, columns, content.path
    raise refusals[0]


def _column(table: Table, wanted: int | str | None, name: str, where: str) -> Column:
    if wanted is not None:
        return asked_column(table.columns, wanted, name, where)
    matching = named_columns(table.columns, "time")
    if len(matching) != 1:
        raise RecordError(
            f"{where}: which column holds the {name} is not clear among {listed_columns(table.columns)}; name it by "
            "`time`."
        )
    return matching[0]


def _factor(column: Column, wanted: RecordColumn, where: str) -> float:
    unit = wanted.unit or column.unit
    if unit is None:
        raise RecordError(
            f"{where}, {column}: has no unit; give that of {wanted.quantity.name}, such as "
            f"'{wanted.quantity.example.split(' ', 1)[1]}'."
        )
    try:
        return unit_in_si(unit, wanted.quantity)
    except QuantityError as problem:
        raise RecordError(f"{where}, {column}: its unit {problem}; give its unit.") from None


def _read(
    table: Table, columns: Mapping[str, Column], factors: Mapping[str, float], where: str
) -> dict[str, FloatArray]:
    arrays, _ = table.read(columns.values())
    values = {name: arrays[column.number] for name, column in columns.items()}
    rows = min(array.size for array in values.values())
    if not 2 <= rows <= MOST_ROWS:
        raise RecordError(f"{where}: must have 2 to {MOST_ROWS} rows of numbers, found {rows}.")
    with np.errstate(over="ignore"):  # what overflows is refused as a signal
        return {name: factors[name] * array for name, array in values.items()}
