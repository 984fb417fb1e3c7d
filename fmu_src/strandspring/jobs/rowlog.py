"""Finished rows on disk, so that an interrupted job goes on where it ended.

A file of JSON lines: a manifest, then one line for each row in the order in which they finished, [checksum, [values of
the row]]. A damaged end, as a killed program or machine leaves it, is dropped. Rows stay on disk; in memory there are 8
bytes for each place.
"""

from __future__ import annotations

import json
import zlib
from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import astuple
from pathlib import Path
from typing import Any, Generic, TypeVar, get_type_hints

from pydantic import TypeAdapter, ValidationError

from .runners import JobError

_CHECKSUM = slice(2, 10)
_VALUES = slice(13, -1)
_NOT_FINISHED = -1

Row = TypeVar("Row")


class RowLog(ABC, Generic[Row]):
    """Finished rows of one job on disk.

    Parameters
    ----------
    path : Path        Created with its folder if it does not exist.
    row_type : type    Dataclass of a row.
    places : int       Number of rows that there can be.
    manifest : dict    First line of the file: what makes it the log of this job.

    Attributes
    ----------
    path : Path
    finished : int     Number of finished rows.
    dropped : int      Number of damaged lines at the end that were dropped.

    Raises
    ------
    JobError           If the file cannot be read or written, is damaged, or is the log of another job.
    """

    def __init__(self, path: Path, row_type: type[Row], places: int, manifest: dict[str, Any]) -> None:
        self.path = path
        self.finished = self.dropped = 0
        self._row_type = row_type
        self._values = _values_of(row_type)
        self._offsets = array("q", [_NOT_FINISHED]) * places
        self._begin = self._end = 0  # of the rows
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("a+b")
        except OSError as problem:
            raise JobError(f"{self.path} cannot be written: {problem.strerror}.") from None
        try:
            self._read(dict(json.loads(json.dumps(manifest))))  # as it is read back: tuples are lists
        except BaseException:
            self._file.close()
            raise

    @abstractmethod
    def place(self, row: Row) -> int | None:
        """The place of a row, None if it is not wanted now; raises LookupError if it cannot be a row of this job."""

    @abstractmethod
    def check(self, found: object, expected: dict[str, Any]) -> None:
        """Raise JobError for the manifest of another job; `found` is any JSON, None for none."""

    def _read(self, manifest: dict[str, Any]) -> None:
        self._file.seek(0)
        first = self._file.readline()
        if first.endswith(b"\n") or not _line(manifest).startswith(first):
            self.check(_content(first), manifest)
            self._begin = self._end = len(first)
        else:  # new, or killed while writing the manifest
            self._file.truncate(0)
            self._write(_line(manifest))
            self._begin = self._end
            return
        damaged: int | None = None
        for number, line in enumerate(self._file, start=2):
            try:
                row = self._row(line)
                place = None if row is None else self.place(row)
            except LookupError:
                row = None
            if row is None:
                damaged = damaged or number
                self.dropped += 1
            elif damaged is not None:
                raise JobError(
                    f"{self.path}, line {damaged}: damaged, or not of this job; remove the file to start again."
                )
            else:
                if place is not None:
                    self._mark(place, self._end)
                self._end += len(line)
        self._file.truncate(self._end)

    def _row(self, line: bytes) -> Row | None:
        """The row of a complete line; None if it is damaged."""
        values = line.rstrip(b"\n")[_VALUES]
        if not line.endswith(b"]\n") or line[_CHECKSUM] != b"%08x" % zlib.crc32(values):
            return None
        try:
            return self._row_type(*self._values.validate_json(values, strict=True))
        except ValidationError:
            return None

    def __contains__(self, place: int) -> bool:
        """Whether a row is finished."""
        return self._offsets[place] != _NOT_FINISHED

    def __getitem__(self, place: int) -> Row:
        """A finished row."""
        self._file.seek(self._offsets[place])
        row = self._row(self._file.readline()) if place in self else None
        if row is None or self.place(row) != place:
            raise JobError(f"{self.path} was changed meanwhile; give the command again.")
        return row

    def add(self, rows: Iterable[Row]) -> None:
        """Keep finished rows."""
        rows = list(rows)
        lines = [_row_line(row) for row in rows]
        begin = self._end
        self._write(b"".join(lines))
        for row, line in zip(rows, lines, strict=True):
            place = self.place(row)
            if place is not None:
                self._mark(place, begin)
            begin += len(line)

    def forget(self, place: int) -> None:
        """Take a row as not finished; the next one that is added takes its place."""
        self.finished -= place in self
        self._offsets[place] = _NOT_FINISHED

    def _mark(self, place: int, offset: int) -> None:
        self.finished += place not in self
        self._offsets[place] = offset

    def _write(self, content: bytes) -> None:
        try:
            self._file.write(content)
            self._file.flush()
        except OSError as problem:
            raise JobError(f"{self.path} cannot be written: {problem.strerror}.") from None
        self._end += len(content)

    def close(self, remove: bool) -> None:
        """Close the file; remove it if asked to, or if it holds no row."""
        with suppress(OSError):  # of what could not be written, which has been reported
            self._file.close()
        if remove or self._end <= self._begin:
            self.path.unlink(missing_ok=True)


def _content(line: bytes) -> object:
    try:
        return json.loads(line)
    except ValueError:
        return None


def _line(content: Any) -> bytes:
    return f"{json.dumps(content, ensure_ascii=False, allow_nan=False)}\n".encode()


def _row_line(row: Any) -> bytes:
    values = _line(astuple(row))[:-1]
    return b'["%08x", %s]\n' % (zlib.crc32(values), values)


def _values_of(row_type: type[Any]) -> TypeAdapter[tuple[Any, ...]]:
    """The types of a row's values."""
    return TypeAdapter(tuple[tuple(get_type_hints(row_type).values())])  # type: ignore[misc, arg-type]
