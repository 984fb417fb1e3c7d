"""The tables of a file, and which of them holds the record: that with a displacement and a force, or the named one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.quoting import quoted
from .columns import Asked, Column, choose_columns, listed_columns
from .record import FloatArray
from .units import Quantity

_LISTED = 6  # tables


class Table(ABC):
    """One table of a file: its text, a sheet, a group of channels.

    Attributes
    ----------
    name : str                Of the sheet or group; "" where the file has but one table.
    columns : list of Column  All of them, numbered from 1.
    findings : tuple of Finding   Where the table lies.
    row : str                 What messages call a row.
    """

    name: str
    columns: list[Column]
    findings: tuple[Finding, ...] = ()
    row: str = "row"

    @abstractmethod
    def read(
        self, wanted: Collection[Column], optional: Column | None = None
    ) -> tuple[dict[int, FloatArray], list[Finding]]:
        """Numbers of columns, shape (K,), by column number, as in the file; what is left out.

        Raises
        ------
        RecordError   If a row is incomplete, unless among the last, or holds no number; of the column `optional` that
            is no more than a reason to leave it out.
        """

    @abstractmethod
    def places(self, rows: Collection[int]) -> list[int]:
        """Numbers by which messages name rows of the table that was read, which count from 0."""


@dataclass(frozen=True)
class FileTables:
    """What a file holds.

    Attributes
    ----------
    path : str               The file, for messages.
    tables : list of Table   At least one.
    united : Table or None   All channels as one table, whose columns are called "group/channel"; None for sheets.
    sha256 : str or None     Digest of the file.
    findings : tuple of Finding   What was unpacked.
    """

    path: str
    tables: Sequence[Table]
    united: Table | None = None
    sha256: str | None = None
    findings: tuple[Finding, ...] = ()


def choose_table(file: FileTables, asked: Asked) -> tuple[Table, dict[Quantity, Column], list[Finding]]:
    """Find the table and its columns.

    A column of one of several tables is named "sheet/column" or "group/channel", with the name or the number of the
    column.

    Parameters
    ----------
    file : FileTables
    asked : mapping              Name or 1-based number per quantity, None to detect it.

    Returns
    -------
    (Table, dict, list of Finding)   The table, its column per quantity, the decisions.

    Raises
    ------
    RecordError                  If no table holds both, or several do.
    """
    where, tables, united = file.path, file.tables, file.united
    owners = {quantity: _owner(tables, wanted) for quantity, wanted in asked.items()}
    named = list(dict.fromkeys(table for table, _ in owners.values() if table is not None))
    if len(named) == 1:
        asked, candidates = {quantity: wanted for quantity, (_, wanted) in owners.items()}, named
    elif named and len(tables) > 1:
        if united is None:
            names = " and ".join(quoted(table.name) for table in named)
            raise RecordError(f"{where}: displacement and force must be in one sheet, got {names}; put them into one.")
        candidates = [united]
    else:
        candidates = [*tables, *([] if united is None else [united])]
    choices: list[tuple[Table, dict[Quantity, Column], list[Finding]]] = []
    for table in candidates:
        if table is united and choices:
            break
        try:
            choices.append((table, *choose_columns(table.columns, asked, where)))
        except RecordError:
            if len(candidates) == 1:
                raise
    if len(choices) > 1:
        first, columns, _ = choices[0]
        names = _names([table for table, _, _ in choices])
        ways = {q: quoted(f"{first.name}/{columns[q].name or columns[q].number}") for q in ("displacement", "force")}
        sentence = (
            "{where}: {names} each hold a displacement and a force; choose one, as with {to[displacement]} "
            "{displacement} and {to[force]} {force}."
        )
        raise RecordError(sentence, where=where, names=names, **ways)
    if not choices:
        contents = "; ".join(f"{_called(table)}: {listed_columns(table.columns)}" for table in tables[:_LISTED])
        more = f"; and {len(tables) - _LISTED} more" if len(tables) > _LISTED else ""
        sentence = (
            "{where}: a displacement and a force were found in none of {count} tables ({contents}); name the columns "
            "with {to[displacement]} and {to[force]}, such as {way}."
        )
        way, contents = quoted(f"{tables[-1].name}/COLUMN"), contents + more
        raise RecordError(sentence, where=where, count=len(tables), contents=contents, way=way)
    table, columns, findings = choices[0]
    if table is not united and (named or len(tables) > 1):
        kind = Outcome.TABLE_GIVEN if named else Outcome.TABLE_CHOSEN
        findings.insert(0, Finding(kind, {"table": _called(table)}))
    return table, columns, findings


def _called(table: Table) -> str:
    return quoted(table.name) if table.name else "what is in no group"


def _owner(tables: Sequence[Table], wanted: int | str | None) -> tuple[Table | None, int | str | None]:
    """The table that a column's name begins with, and the rest of the name."""
    if not isinstance(wanted, str):
        return None, wanted
    text = wanted.strip()
    owners = [table for table in tables if table.name and text.startswith(f"{table.name}/")]
    if not owners or any(column.name == text for table in tables for column in table.columns):
        return None, wanted
    owner = max(owners, key=lambda table: len(table.name))
    return owner, text[len(owner.name) + 1 :]


def _names(tables: Sequence[Table]) -> str:
    names = ", ".join(quoted(table.name) for table in tables[:_LISTED])
    return names + (f" and {len(tables) - _LISTED} more" if len(tables) > _LISTED else "")
