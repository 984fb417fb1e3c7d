"""Index lines of a row log, so that a job with many finished rows goes on without reading them all.

After every megabyte of rows there is a line

    [checksum, {"before": offset of the previous index line or null, "at": its own offset,
                "places": [...], "offsets": [...]}]

with the rows since the previous one. The last index line is found from the end of the file, and leads to all others.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter, ValidationError

from .checked_lines import CheckedLines

LONGEST_LINE = 1 << 26  # bytes; the manifest of a million masses has 20 MB
NOT_FINISHED = -1  # offset of a row
_EVERY = 1 << 20  # bytes of rows from one index line to the next
_MOST_ROWS = 1 << 14  # in one index line
_TAIL = 4 * _EVERY  # bytes at the end of the file that are searched for an index line
_BEGIN = b'", {"before": '  # follows the checksum; not within a row: its quotation marks are escaped
_AFTER_CHECKSUM = 10

_Natural = Annotated[int, Field(ge=0, le=(1 << 63) - 1)]


@dataclass(frozen=True)
class _IndexLine:
    """Content of an index line, see above."""

    before: _Natural | None
    at: _Natural
    places: list[_Natural]
    offsets: list[_Natural]


class _Rows(NamedTuple):
    """Rows of an index line, ndarrays of shape (K,)."""

    places: NDArray[np.int64]
    offsets: NDArray[np.int64]


_INDEX_LINE = TypeAdapter(_IndexLine)


class RowIndex:
    """The index lines of one log.

    Parameters
    ----------
    lines : CheckedLines
    offsets : ndarray, shape (places,)   Offset of the row of each place in the file, NOT_FINISHED if there is none;
                                         shared with the log, which fills in what is not in an index line.
    """

    def __init__(self, lines: CheckedLines, offsets: NDArray[np.int64]) -> None:
        self._lines = lines
        self._offsets = offsets
        self._last: int | None = None  # offset of the last index line
        self._unindexed = array("q")  # places of the rows after it

    def load(self, file: BinaryIO, begin: int) -> int:
        """Fill in the rows of all index lines.

        Parameters
        ----------
        file : BinaryIO
        begin : int       Offset of the first row.

        Returns
        -------
        int               Offset of the first line after the last index line; `begin` if there is no usable index, as
                          where lines were damaged or removed.
        """
        size = file.seek(0, os.SEEK_END)
        tail_begin = max(begin, size - _TAIL)
        file.seek(tail_begin)
        tail = file.read(size - tail_begin)
        last = tail.rfind(b"\n", 0, max(tail.rfind(_BEGIN), 0)) + 1
        chain: list[_Rows] = []
        at: int | None = tail_begin + last
        while at is not None:
            file.seek(at)
            index = self._parsed(file.readline(LONGEST_LINE))
            rows = None if index is None or index.at != at else self._rows(index, begin)
            if index is None or rows is None:
                return begin
            chain.append(rows)
            at = index.before
        for places, offsets in reversed(chain):
            self._offsets[places] = offsets
        self._last = tail_begin + last
        return tail_begin + tail.find(b"\n", last) + 1

    def is_index(self, line: bytes) -> bool:
        """Whether a line of the file is an index line, and undamaged."""
        return self._parsed(line) is not None

    def add(self, place: int) -> None:
        """Take in a row that comes after the last index line."""
        self._unindexed.append(place)

    def is_due(self, end: int) -> bool:
        """Whether rows up to an offset are to be followed by index lines."""
        return len(self._unindexed) > 0 and end - int(self._offsets[self._unindexed[0]]) > _EVERY

    def new_lines(self, end: int) -> Iterator[bytes]:
        """Index lines of the rows since the last one, to be written one after the other from an offset on."""
        for first in range(0, len(self._unindexed), _MOST_ROWS):
            places = self._unindexed[first : first + _MOST_ROWS]
            index = _IndexLine(self._last, end, places.tolist(), self._offsets[places].tolist())
            line = self._lines.line(vars(index))
            yield line
            self._last = end
            end += len(line)
        self._unindexed = array("q")

    def _parsed(self, line: bytes) -> _IndexLine | None:
        """The content of an index line; None if it is another line, or damaged."""
        if not line.startswith(_BEGIN, _AFTER_CHECKSUM):
            return None
        content = self._lines.content(line)
        try:
            return None if content is None else _INDEX_LINE.validate_json(content, strict=True)
        except ValidationError:
            return None

    def _rows(self, index: _IndexLine, begin: int) -> _Rows | None:
        """The rows of an index line; None if it cannot be one of this file."""
        places, offsets = np.array(index.places, np.int64), np.array(index.offsets, np.int64)
        is_possible = (
            places.size == offsets.size
            and np.all(places < self._offsets.size)
            and np.all((offsets >= begin) & (offsets < index.at))
            and (index.before is None or index.before < index.at)
        )
        return _Rows(places, offsets) if is_possible else None
