"""Which table of a file holds the record: that with a displacement and a force, or the named one; and its columns."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import RecordError
from ..ground.quoting import quoted
from .channels import ChannelTable
from .columns import Column, listed_columns, named_columns, split_unit
from .tables import SourceTable
from .units import Quantity

_LISTED = 6  # tables

Asked = Mapping[Quantity, int | str | None]


def choose_table(
    tables: Sequence[SourceTable], asked: Asked, where: str
) -> tuple[SourceTable, dict[Quantity, Column], list[str]]:
    """Find the table and its columns.

    A column of one of several tables is named "sheet/column" or "group/channel", with the name or the number of the
    column.

    Parameters
    ----------
    tables : sequence of SourceTable   At least one.
    asked : mapping                    Name or 1-based number per quantity, None to detect it.
    where : str                        File, for messages.

    Returns
    -------
    (SourceTable, dict, list of str)   The table, its column per quantity, sentences about the decisions.

    Raises
    ------
    RecordError                  If no table holds both, or several do.
    """
    owners = {quantity: _owner(tables, wanted) for quantity, wanted in asked.items()}
    named = list(dict.fromkeys(table for table, _ in owners.values() if table is not None))
    if len(named) == 1:
        columns, notes = choose_columns(named[0].columns, {q: wanted for q, (_, wanted) in owners.items()}, where)
        return named[0], columns, [f"{quoted(named[0].name)} is read, as given", *notes]
    if len(tables) == 1:
        return tables[0], *choose_columns(tables[0].columns, asked, where)
    united = _united(tables, where)
    if named:
        if united is None:
            names = " and ".join(quoted(table.name) for table in named)
            raise RecordError(f"{where}: displacement and force must be in one sheet, got {names}; put them into one.")
        return united, *choose_columns(united.columns, asked, where)
    choices = []
    for table in tables:
        try:
            choices.append((table, *choose_columns(table.columns, asked, where)))
        except RecordError:
            continue
    if len(choices) == 1:
        table, columns, notes = choices[0]
        return table, columns, [f"{quoted(table.name)} is read, which alone holds a displacement and a force", *notes]
    if len(choices) > 1:
        names = _names([table for table, _, _ in choices])
        first, columns, _ = choices[0]
        ways = " ".join(
            f"`{q}={quoted(f'{first.name}/{columns[q].name or columns[q].number}')}`" for q in ("displacement", "force")
        )
        raise RecordError(f"{where}: {names} each hold a displacement and a force; choose one, as with {ways}.")
    if united is not None:
        try:
            return united, *choose_columns(united.columns, asked, where)
        except RecordError:
            pass
    contents = "; ".join(f"{quoted(table.name)}: {listed_columns(table.columns)}" for table in tables[:_LISTED])
    more = f"; and {len(tables) - _LISTED} more" if len(tables) > _LISTED else ""
    raise RecordError(
        f"{where}: a displacement and a force were found in none of {len(tables)} tables ({contents}{more}); name the "
        f"columns, as with `displacement={quoted(f'{tables[0].name}/1')}` `force={quoted(f'{tables[0].name}/2')}`."
    )


def _owner(tables: Sequence[SourceTable], wanted: int | str | None) -> tuple[SourceTable | None, int | str | None]:
    """The table that a column's name begins with, and the rest of the name."""
    if not isinstance(wanted, str):
        return None, wanted
    text = wanted.strip()
    if any(column.name == text for table in tables for column in table.columns):
        return None, wanted
    owners = [table for table in tables if table.name and text.startswith(f"{table.name}/")]
    if not owners:
        return None, wanted
    owner = max(owners, key=lambda table: len(table.name))
    return owner, text[len(owner.name) + 1 :]


def _united(tables: Sequence[SourceTable], where: str) -> ChannelTable | None:
    """All channels of a file as one table, whose columns are called "group/channel"; None for sheets."""
    groups = [table for table in tables if isinstance(table, ChannelTable)]
    channels = [channel for table in groups for channel in table.timed_channels()]
    return ChannelTable(channels, where, qualified=True) if channels else None


def _names(tables: Sequence[SourceTable]) -> str:
    names = ", ".join(quoted(table.name) for table in tables[:_LISTED])
    return names + (f" and {len(tables) - _LISTED} more" if len(tables) > _LISTED else "")


def choose_columns(
    columns: Sequence[Column], asked: Mapping[Quantity, int | str | None], where: str
) -> tuple[dict[Quantity, Column], list[str]]:
    """Find the columns of displacement, force and, where there is one, time.

    Parameters
    ----------
    columns : sequence of Column   All columns of the table.
    asked : mapping                Name or 1-based number per quantity, None to detect it by its name.
    where : str                    File, for messages.

    Returns
    -------
    (dict, list of str)            Column per quantity; sentences about the decisions.

    Raises
    ------
    RecordError                    If a column is missing, ambiguous or given twice.
    """
    chosen: dict[Quantity, Column] = {
        quantity: asked_column(columns, wanted, quantity, where)
        for quantity, wanted in asked.items()
        if wanted is not None
    }
    quantities: dict[int, Quantity] = {}
    for quantity, column in chosen.items():
        if column.number in quantities:
            raise RecordError(
                f"{where}: {column} must not be both {quantities[column.number]} and {quantity}; name two columns."
            )
        quantities[column.number] = quantity
    notes = [f"{quantity} is {column}, as given" for quantity, column in chosen.items()]
    has_names = any(column.name for column in columns)
    for quantity in ("displacement", "force", "time"):
        if quantity in chosen:
            continue
        free = [column for column in columns if column not in chosen.values()]
        candidates = named_columns(free, quantity)
        if len(candidates) == 1:
            chosen[quantity] = candidates[0]
            notes.append(f"{quantity} is {candidates[0]}, chosen by its name or unit")
        elif quantity == "time":
            if candidates:
                notes.append(f"time is left out, since {listed_columns(candidates)} could hold it")
        elif not has_names and len(columns) == 2 and free and not candidates:
            chosen[quantity] = free[0]
            notes.append(f"{quantity} is assumed to be {free[0]}, as there is no header")
        else:
            raise RecordError(_ambiguity(free, candidates, quantity, has_names, where))
    return chosen, notes


def asked_column(columns: Sequence[Column], wanted: int | str, quantity: str, where: str) -> Column:
    """The column of a name or 1-based number; `quantity` says in messages what it holds."""
    if isinstance(wanted, str):
        text = wanted.strip()
        rules = (
            lambda column: column.name == text,
            lambda column: column.name.casefold() == text.casefold(),
            lambda column: _squeezed(column.name) == _squeezed(text),
            lambda column: _squeezed(column.label) == _squeezed(split_unit(text)[0]),
        )
        for rule in rules:
            fitting = [column for column in columns if column.name and rule(column)]
            if len(fitting) == 1:
                return fitting[0]
            if fitting:
                raise RecordError(
                    f"{where}: {quantity} column {quoted(wanted)} must name one column, "
                    f"but it fits {listed_columns(fitting)}; give a number."
                )
        if not re.fullmatch(r"[0-9]{1,9}", text):
            raise RecordError(
                f"{where}: {quantity} column {quoted(wanted)} is not in the file, "
                f"which has {listed_columns(columns)}; give one of these names or numbers."
            )
    elif not isinstance(wanted, int | np.integer):
        raise RecordError(
            f"{where}: {quantity} column must be a name or a number from 1 on, got {type(wanted).__name__}; the file "
            f"has {listed_columns(columns)}."
        )
    number = int(wanted)
    if not 1 <= number <= len(columns):
        raise RecordError(
            f"{where}: {quantity} column must be 1 to {len(columns)}, got {number}; the file has "
            f"{listed_columns(columns)}."
        )
    return columns[number - 1]


def _ambiguity(
    columns: Sequence[Column], candidates: Sequence[Column], quantity: Quantity, has_names: bool, where: str
) -> str:
    if candidates:
        reason = f"{listed_columns(candidates)} could be the {quantity}"
    elif has_names:
        reason = f"no column is named like a {quantity} among {listed_columns(columns)}"
    else:
        reason = f"there is no header to find the {quantity} by among {listed_columns(columns)}"
    return f"{where}: {reason}; name the columns with `displacement=...` and `force=...`."


def _squeezed(name: str) -> str:
    return re.sub(r"[\s_]+", "", name).casefold()
