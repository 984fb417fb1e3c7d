"""Finished rows on disk, so that an interrupted job goes on where it ended.

A file of JSON lines: a manifest, then one line for each row in the order in which they finished, [checksum, [values of
the row]]; the checksum is that of the manifest continued by the values, so that no row of another job fits. A damaged
end, as a killed program or machine leaves it, is dropped. Rows stay on disk; in memory there are 8
bytes for each place.

A job whose places are the same each time may have an index line after every megabyte of rows,

    [checksum, {"before": offset of the previous index line or null, "at": its own offset,
                "places": [...], "offsets": [...]}]

with the rows since the previous one. Then only these lines and the rows after the last one are read to go on. Rows are
checked again whenever they are read, so that no damaged row is ever used. Where the index does not fit, because lines
were damaged or removed, all rows are read.
"""

from __future__ import annotations

import json
import os
import zlib
from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, fields
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Any, BinaryIO, Generic, NamedTuple, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from ..files import readable, reason_of
from .runners import JobError
from .sole_file import open_alone, remove_open

_CHECKSUM = slice(2, 10)
_CONTENT = slice(13, -1)
_NOT_FINISHED = -1
_GREATEST = (1 << 63) - 1
_INDEX_EVERY = 1 << 20  # bytes of rows
_MOST_INDEXED = 1 << 14  # rows in one index line
_TAIL = 4 * _INDEX_EVERY  # bytes at the end that are searched for an index line
_LONGEST_LINE = 1 << 26  # bytes; the manifest of a million masses has 20 MB
_BLOCK = 1 << 20  # bytes of a file that are counted at a time

_encoded = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode

Row = TypeVar("Row")


_Natural = Annotated[int, Field(ge=0, le=_GREATEST)]


@dataclass(frozen=True)
class _Index:
    """Content of an index line, see above."""

    before: _Natural | None
    at: _Natural
    places: list[_Natural]
    offsets: list[_Natural]


class _IndexedRows(NamedTuple):
    """Rows of an index line, ndarrays of shape (K,)."""

    places: NDArray[np.int64]
    offsets: NDArray[np.int64]


_INDEX = TypeAdapter(_Index)
_INDEX_BEGIN = b'", {"before": '  # not within a row: its quotation marks are escaped


class RowLog(ABC, Generic[Row]):
    """Finished rows of one job on disk, which no other program can use meanwhile.

    Parameters
    ----------
    path : Path        Created with its folder if it does not exist.
    row_type : type    Dataclass of a row.
    places : int       Number of rows that there can be.
    manifest : dict    First line of the file: what makes it the log of this job.
    indexed : bool     Write index lines; the places of rows must depend on the manifest alone.

    Attributes
    ----------
    path : Path
    name : str         The path as it is shown.
    finished : int     Number of finished rows.
    dropped : int      Number of damaged lines at the end that were dropped.

    Raises
    ------
    JobError           If the file cannot be read or written, is damaged, in use, or the log of another job.
    """

    def __init__(
        self, path: Path, row_type: type[Row], places: int, manifest: dict[str, Any], indexed: bool = False
    ) -> None:
        self.path = path
        self.name = readable(path)
        self.finished = self.dropped = 0
        self._row_type = row_type
        self._values = _values_adapter(row_type)
        self._values_of = attrgetter(*(field.name for field in fields(row_type)))  # type: ignore[arg-type]
        self._offsets = np.full(places, _NOT_FINISHED, np.int64)
        self._begin = self._end = 0  # of the rows
        self._job = zlib.crc32(_line(manifest))  # begins every checksum
        self._indexed = indexed
        self._index_before: int | None = None
        self._not_indexed = array("q")  # places of rows since the last index line
        self._new_folders = [folder for folder in (path.parent, *path.parent.parents) if not os.path.lexists(folder)]
        self._is_new = False
        self._file = self._opened()
        try:
            self._check_manifest(json.loads(json.dumps(manifest)))  # as it is read back: tuples are lists
            self._read(self._by_index() if indexed else self._begin)
        except OSError as problem:
            self._abandon()
            raise JobError(f"{self.name} cannot be read: {reason_of(problem)}; check the disk that it is on.") from None
        except BaseException:
            self._abandon()
            raise

    @abstractmethod
    def place(self, row: Row) -> int | None:
        """The place of a row, None if it is not wanted now; raises LookupError if it cannot be a row of this job."""

    @abstractmethod
    def check(self, found: object, expected: dict[str, Any]) -> None:
        """Raise JobError for the manifest of another job; `found` is any JSON, None for none."""

    @property
    def dropped_sentence(self) -> str:
        """What was dropped, in words."""
        return f"{self.dropped} damaged line{' at the end was' if self.dropped == 1 else 's at the end were'} dropped"

    def _opened(self) -> BinaryIO:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            return open_alone(self.path)
        except OSError as problem:
            self._remove_new_folders()
            raise JobError(
                f"{self.name} cannot be written: {reason_of(problem)}; check the path and its rights."
            ) from None
        except JobError:
            self._remove_new_folders()
            raise

    def _check_manifest(self, manifest: dict[str, Any]) -> None:
        """Check the manifest, or write it if there is none."""
        line = _line(manifest)
        self._file.seek(0)
        first = self._file.readline(_LONGEST_LINE)
        if first.endswith(b"\n") or not line.startswith(first):
            self.check(_content(first), manifest)
            self._begin = self._end = len(first)
            return
        self._is_new = True  # or the program was killed while writing the manifest
        self._file.truncate(0)
        self._begin = len(line)
        self._write(line)

    def _by_index(self) -> int:
        """Mark the rows of all index lines; returns the offset of the first line after them."""
        size = self._file.seek(0, os.SEEK_END)
        begin = max(self._begin, size - _TAIL)
        self._file.seek(begin)
        tail = self._file.read(size - begin)
        last = tail.rfind(b"\n", 0, max(tail.rfind(_INDEX_BEGIN), 0)) + 1
        end = begin + tail.find(b"\n", last) + 1
        chain: list[_IndexedRows] = []
        at: int | None = begin + last
        while at is not None:
            self._file.seek(at)
            index = self._index(self._file.readline(_LONGEST_LINE))
            rows = None if index is None else self._indexed_rows(index)
            if index is None or rows is None or index.at != at:
                return self._begin
            chain.append(rows)
            at = index.before
        for places, offsets in reversed(chain):
            self._offsets[places] = offsets
        self.finished = int(np.count_nonzero(self._offsets != _NOT_FINISHED))
        self._index_before = begin + last
        return end

    def _indexed_rows(self, index: _Index) -> _IndexedRows | None:
        """The rows of an index line; None if it cannot be one of this file."""
        places, offsets = np.array(index.places, np.int64), np.array(index.offsets, np.int64)
        is_possible = (
            places.size == offsets.size
            and np.all(places < self._offsets.size)
            and np.all((offsets >= self._begin) & (offsets < index.at))
            and (index.before is None or index.before < index.at)
        )
        return _IndexedRows(places, offsets) if is_possible else None

    def _read(self, begin: int) -> None:
        """Mark the rows from an offset on, and drop a damaged end."""
        self._file.seek(begin)
        self._end = begin
        damaged: int | None = None
        offset = begin
        while line := self._file.readline(_LONGEST_LINE):
            row = place = None
            index = self._index(line)
            if index is None:
                try:
                    row = self._row(line)
                    place = None if row is None else self.place(row)
                except LookupError:
                    row = None
            if index is None and row is None:
                damaged = offset if damaged is None else damaged
                self.dropped += 1
            elif damaged is not None:
                raise self._damaged(damaged)
            else:
                if index is None:
                    self._mark(place, offset)
                self._end = offset + len(line)
            offset += len(line)
        if self.dropped:
            self._file.truncate(self._end)

    def _damaged(self, offset: int) -> JobError:
        """The error for a line at an offset."""
        self._file.seek(0)
        lines = sum(self._file.read(min(_BLOCK, offset - k)).count(b"\n") for k in range(0, offset, _BLOCK))
        return JobError(
            f"{self.name}, line {lines + 1}: damaged, or not of this job; remove this line to have it done again, or "
            "the file to start again."
        )

    def _checksummed(self, content: str) -> bytes:
        """A line of the file."""
        encoded = content.encode(errors="replace")  # names of files need not be text
        return b'["%08x", %s]\n' % (zlib.crc32(encoded, self._job), encoded)

    def _checked(self, line: bytes) -> bytes | None:
        """The content of a line; None if it is damaged."""
        content = line.rstrip(b"\n")[_CONTENT]
        is_whole = line.endswith(b"]\n") and line[_CHECKSUM] == b"%08x" % zlib.crc32(content, self._job)
        return content if is_whole else None

    def _index(self, line: bytes) -> _Index | None:
        """An index line; None if it is another, or damaged."""
        if not line.startswith(_INDEX_BEGIN, 10):
            return None
        content = self._checked(line)
        try:
            return None if content is None else _INDEX.validate_json(content, strict=True)
        except ValidationError:
            return None

    def _row(self, line: bytes) -> Row | None:
        """The row of a complete line; None if it is damaged."""
        values = self._checked(line)
        if values is None:
            return None
        try:
            return self._row_type(*self._values.validate_json(values, strict=True))
        except ValidationError:
            return None

    def __contains__(self, place: int) -> bool:
        """Whether a row is finished."""
        return bool(self._offsets[place] != _NOT_FINISHED)

    def __getitem__(self, place: int) -> Row:
        """A finished row; raises JobError if it has become damaged."""
        offset = int(self._offsets[place])
        try:
            self._file.seek(offset)
            row = self._row(self._file.readline(_LONGEST_LINE))
            is_it = row is not None and self.place(row) == place
        except LookupError:
            is_it = False
        except OSError as problem:
            raise JobError(f"{self.name} cannot be read: {reason_of(problem)}; check the disk that it is on.") from None
        if row is None or not is_it:
            raise self._damaged(offset)
        return row

    def missing(self) -> array[int]:
        """Places of the rows that are not finished."""
        return array("q", np.flatnonzero(self._offsets == _NOT_FINISHED).astype(np.int64).tobytes())

    def add(self, rows: Iterable[Row]) -> None:
        """Keep finished rows."""
        rows = list(rows)
        lines = [self._checksummed(_encoded(self._values_of(row))) for row in rows]
        offset = self._end
        self._write(b"".join(lines))
        for row, line in zip(rows, lines, strict=True):
            self._mark(self.place(row), offset)
            offset += len(line)
        if self._indexed and self._end - self._first_not_indexed() > _INDEX_EVERY:
            self._write_index()

    def forget(self, place: int) -> None:
        """Take a row as not finished; the next one that is added takes its place."""
        self.finished -= place in self
        self._offsets[place] = _NOT_FINISHED

    def _mark(self, place: int | None, offset: int) -> None:
        if place is not None:
            self.finished += place not in self
            self._offsets[place] = offset
            if self._indexed:
                self._not_indexed.append(place)

    def _first_not_indexed(self) -> int:
        return int(self._offsets[self._not_indexed[0]]) if self._not_indexed else self._end

    def _write_index(self) -> None:
        for first in range(0, len(self._not_indexed), _MOST_INDEXED):
            places = self._not_indexed[first : first + _MOST_INDEXED]
            at = self._end
            index = _Index(self._index_before, at, places.tolist(), self._offsets[places].tolist())
            self._write(self._checksummed(_encoded(vars(index))))
            self._index_before = at
        self._not_indexed = array("q")

    def _write(self, content: bytes) -> None:
        try:
            self._file.write(content)
            self._file.flush()
        except OSError as problem:
            raise JobError(
                f"{self.name} cannot be written: {reason_of(problem)}; make room, or write elsewhere."
            ) from None
        self._end += len(content)

    def close(self, remove: bool) -> None:
        """Close the file; remove it if asked to, or if it holds no row.

        Raises
        ------
        JobError   If it cannot be removed as asked.
        """
        if not remove and self._end > self._begin:
            with suppress(OSError):  # of what could not be written, which has been reported
                self._file.close()
            return
        try:
            remove_open(self._file, self.path)
        except OSError as problem:
            if remove:
                raise JobError(
                    f"{self.name} is no longer needed, but cannot be removed: {reason_of(problem)}; remove it."
                ) from None
        self._remove_new_folders()

    def _abandon(self) -> None:
        """Close the file after an error; what it held is left as it was."""
        if self._is_new:
            self.close(remove=False)
        else:
            with suppress(OSError):
                self._file.close()

    def _remove_new_folders(self) -> None:
        """Remove the folders that were made for the file and hold nothing else."""
        with suppress(OSError):
            for folder in self._new_folders:
                folder.rmdir()


def _values_adapter(row_type: type[Any]) -> TypeAdapter[tuple[Any, ...]]:
    """The types of a row's values."""
    types = tuple(get_type_hints(row_type).values())
    return TypeAdapter(tuple[types], config=ConfigDict(allow_inf_nan=False))  # type: ignore[valid-type]


def _content(line: bytes) -> object:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


def _line(content: Any) -> bytes:
    return f"{_encoded(content)}\n".encode()
