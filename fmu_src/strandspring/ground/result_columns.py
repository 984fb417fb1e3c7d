"""How the figures of results are presented: name, unit, factor and heading of each, for all forms of output."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

_NOTHING = 1e-9  # of rounding, in the unit for people


@dataclass(frozen=True)
class ResultColumn:
    """One figure of a result."""

    key: str  # attribute of what holds it, key of JSON, and column of data frames, in SI units
    unit: str  # in SI
    words: str  # in sentences and plots; empty where it is in tables for a terminal only
    short: str = ""  # in headings of tables for people; empty where it is not in them
    shown: str = ""  # unit for people; empty for a pure number
    factor: float = 1.0  # from SI to that unit
    digits: int = 4  # significant, for people

    @property
    def heading(self) -> str:
        """Of a table for a terminal."""
        return f"{self.short} {self.shown}".strip()

    @property
    def file_heading(self) -> str:
        """Of a file in SI units."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    @property
    def label(self) -> str:
        """Of an axis of a plot."""
        return f"{self.words} [{self.shown.replace('*', ' ') or '-'}]"

    def drawn(self, figures: Any) -> float:
        """Its value among figures, in the unit for people."""
        return self.factor * float(getattr(figures, self.key))

    def text(self, value: float | str | tuple[float, float] | None) -> str:
        """A value [SI] in the unit for people: empty if there is none, "-" if undefined; texts as they are, ranges."""
        if value is None or isinstance(value, str):
            return value or ""
        if isinstance(value, tuple):
            low, high = map(self.text, value)
            return low if low == high else f"{low}{' to ' if low.startswith('-') else '-'}{high}"
        if not math.isfinite(value):
            return "-"
        shown = f"{value * self.factor if abs(value * self.factor) >= _NOTHING else 0.0:.{self.digits}g}"
        return f"{float(shown):.0f}" if "e+0" in shown else shown


def figure(unit: str, words: str, short: str = "", shown: str = "", factor: float = 1.0, digits: int = 4) -> Any:
    """A field of a dataclass that says how it is presented, as a `ResultColumn` with its name as key."""
    return field(metadata={"column": (unit, words, short, shown, factor, digits)})


def columns_of(kind: type[Any]) -> tuple[ResultColumn, ...]:
    """The columns that the fields of a dataclass are."""
    return tuple(ResultColumn(each.name, *each.metadata["column"]) for each in fields(kind))


def values(columns: Sequence[ResultColumn], figures: Any) -> dict[str, Any]:
    """The figures by their keys, for JSON and data frames."""
    return {column.key: getattr(figures, column.key) for column in columns}


def value(row: Any, key: str) -> Any:
    """What a row holds under a key, a mapping or an object with such an attribute; None if nothing."""
    return row.get(key) if isinstance(row, Mapping) else getattr(row, key, None)


def texts(columns: Sequence[ResultColumn], rows: Sequence[Any]) -> dict[ResultColumn, list[str]]:
    """Texts of the cells of a table for people, by those of its columns of which something is known."""
    held = {column: [value(row, column.key) for row in rows] for column in columns if column.short}
    known = {column: of for column, of in held.items() if any(one is not None for one in of)}
    return {column: [column.text(one) for one in of] for column, of in known.items()}
