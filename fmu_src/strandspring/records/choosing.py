"""Which table of a file holds the record: that with a displacement and a force, or the one that is named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..errors import RecordError
from .channels import ChannelTable
from .columns import Column, choose_columns, listed_columns
from .tables import Table
from .units import Quantity, quoted

_LISTED = 6  # tables

Asked = Mapping[Quantity, int | str | None]


def choose_table(tables: Sequence[Table], asked: Asked, where: str) -> tuple[Table, dict[Quantity, Column], list[str]]:
    """Find the table and its columns.

    A column of one of several tables is named "sheet/column" or "group/channel", with the name or the number of the
    column.

    Parameters
    ----------
    tables : sequence of Table   At least one.
    asked : mapping              Name or 1-based number per quantity, None to detect it.
    where : str                  File, for messages.

    Returns
    -------
    (Table, dict, list of str)   The table, its column per quantity, sentences about the decisions.

    Raises
    ------
    RecordError                  If no table holds both, or several do.
    """
    own = {quantity: _owner(tables, wanted) for quantity, wanted in asked.items()}
    named = list(dict.fromkeys(table for table, _ in own.values() if table is not None))
    if len(named) == 1:
        columns, notes = choose_columns(named[0].columns, {q: wanted for q, (_, wanted) in own.items()}, where)
        return named[0], columns, [f"{quoted(named[0].name)} is read, as given", *notes]
    if len(tables) == 1:
        return tables[0], *choose_columns(tables[0].columns, asked, where)
    united = _united(tables, where)
    if named:
        if united is None:
            names = " and ".join(quoted(table.name) for table in named)
            raise RecordError(f"{where}: displacement and force must be in one sheet, got {names}; put them into one.")
        return united, *choose_columns(united.columns, asked, where)
    found = []
    for table in tables:
        try:
            found.append((table, *choose_columns(table.columns, asked, where)))
        except RecordError:
            continue
    if len(found) == 1:
        table, columns, notes = found[0]
        return table, columns, [f"{quoted(table.name)} is read, which alone holds a displacement and a force", *notes]
    if len(found) > 1:
        names = _names([table for table, _, _ in found])
        first, columns, _ = found[0]
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


def _owner(tables: Sequence[Table], wanted: int | str | None) -> tuple[Table | None, int | str | None]:
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


def _united(tables: Sequence[Table], where: str) -> ChannelTable | None:
    """All channels of a file as one table, whose columns are called "group/channel"; None for sheets."""
    groups = [table for table in tables if isinstance(table, ChannelTable)]
    channels = [channel for table in groups for channel in table.timed_channels()]
    return ChannelTable(channels, where, qualified=True) if channels else None


def _names(tables: Sequence[Table]) -> str:
    names = ", ".join(quoted(table.name) for table in tables[:_LISTED])
    return names + (f" and {len(tables) - _LISTED} more" if len(tables) > _LISTED else "")
