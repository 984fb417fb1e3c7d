"""Rows of a table that cannot be read: which of them are left out, and what is said of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from ..findings import Finding, Outcome
from .record import FloatArray

# A rig stopped while writing leaves an incomplete row or, with buffering, a few.
MAX_DROPPED_ROWS = 3
_MOST_BAD = 10  # one row of so many may be left out: with more, the columns or the dialect are not those of the table


@dataclass(frozen=True, slots=True)
class BadRow:
    """A row that cannot be used.

    Attributes
    ----------
    line : int              1-based in the file.
    column : int or None    1-based, None where the row as a whole is wrong.
    message : str
    is_incomplete : bool    Whether it may be dropped at the end of the file.
    has_thousands : bool    Whether it looks like numbers with marks between thousands, which the largest alone have.
    """

    line: int
    column: int | None
    message: str
    is_incomplete: bool
    has_thousands: bool = False


@dataclass(frozen=True, eq=False)
class ReadRows:
    """The rows of a table.

    Attributes
    ----------
    values : ndarray, shape (K, columns)   Of the rows that can be read; none of them where reading was given up.
    bad : sequence of BadRow               Those that cannot be read, as far as the table was read.
    dropped : sequence of BadRow           Incomplete ones at the end, which are always left out.
    skips : bool                           Whether bad rows may be left out.
    """

    values: FloatArray
    bad: Sequence[BadRow]
    dropped: Sequence[BadRow] = ()
    skips: bool = False

    @property
    def refused(self) -> BadRow | None:
        """The row for which the table is refused; None if all bad rows may be left out.

        With rows that have marks between thousands the ends of the loop would be left out.
        """
        if not self.bad:
            return None
        is_refused = not self.skips or _MOST_BAD * len(self.bad) > len(self.values) + len(self.bad)
        return self.bad[0] if is_refused else next((row for row in self.bad if row.has_thousands), None)

    def findings(self, row: str, place: Callable[[BadRow], str]) -> Iterator[Finding]:
        """What is left out; `row` is what messages call a row, and `place` gives what they call that of a bad one."""
        if self.bad:
            first = {"place": place(self.bad[0]), "problem": self.bad[0].message}
            yield Finding(Outcome.UNREADABLE_ROWS, {"count": len(self.bad), "row": row, **first})
        if self.dropped:
            yield incomplete(len(self.dropped), row, self.dropped[0].line)


def incomplete(count: int, row: str, first: int) -> Finding:
    """Rows at the end that are left out, of which the first is so numbered."""
    return Finding(Outcome.INCOMPLETE_ROWS, {"count": count, "row": row, "line": first})


def most_bad(rows: int) -> int:
    """Number of bad rows from which on a table of so many rows is refused in any case, those at its end included."""
    return rows // _MOST_BAD + MAX_DROPPED_ROWS
