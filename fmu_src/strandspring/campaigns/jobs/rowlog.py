"""Finished rows on disk, so that an interrupted job goes on where it ended.

A file of JSON lines: a manifest, then one line for each row in the order in which they finished, [checksum, [values of
the row]]. A damaged end, as a killed program or machine leaves it, is dropped. Rows stay on disk; in memory there are 8
bytes for each place. They are checked whenever they are read, so that no damaged row is ever used.
"""

from __future__ import annotations

import json
import os
from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import fields
from operator import attrgetter
from pathlib import Path
from typing import Any, BinaryIO, Generic, TypeVar, get_type_hints

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from ...ground.files import readable, reason_of
from .checked_lines import CheckedLines, json_line
from .row_index import LONGEST_LINE, NOT_FINISHED, RowIndex
from .runners import JobError
from .sole_file import open_alone, remove_open

_BLOCK = 1 << 20  # bytes of a file that are counted at a time

Row = TypeVar("Row")


class RowLog(ABC, Generic[Row]):
    """Finished rows of one job on disk, which no other program can use meanwhile.

    Parameters
    ----------
    path : Path        Created with its folder if it does not exist.
    row_type : type    Dataclass of a row.
    places : int       Number of rows that there can be.
    manifest : dict    First line of the file: what makes it the log of this job.
    indexed : bool     Write index lines, see `row_index`; the places of rows must depend on the manifest alone.

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
        self._offsets = np.full(places, NOT_FINISHED, np.int64)
        self._begin = self._end = 0  # of the rows
        self._lines = CheckedLines(json_line(manifest))
        self._index = RowIndex(self._lines, self._offsets) if indexed else None
        self._new_folders = [folder for folder in (path.parent, *path.parent.parents) if not os.path.lexists(folder)]
        self._is_new = False
        self._file = self._opened()
        try:
            self._check_manifest(json.loads(json.dumps(manifest)))  # as it is read back: tuples are lists
            begin = self._begin if self._index is None else self._index.load(self._file, self._begin)
            self.finished = int(np.count_nonzero(self._offsets != NOT_FINISHED))
            self._read(begin)
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
        line = json_line(manifest)
        self._file.seek(0)
        first = self._file.readline(LONGEST_LINE)
        if first.endswith(b"\n") or not line.startswith(first):
            self.check(_content(first), manifest)
            self._begin = self._end = len(first)
            return
        self._is_new = True  # or the program was killed while writing the manifest
        self._file.truncate(0)
        self._begin = len(line)
        self._write(line)

    def _read(self, begin: int) -> None:
        """Mark the rows from an offset on, and drop a damaged end."""
        self._file.seek(begin)
        offset = self._end = begin
        first_damaged: int | None = None
        while line := self._file.readline(LONGEST_LINE):
            if not self._take(line, offset):
                first_damaged = offset if first_damaged is None else first_damaged
                self.dropped += 1
            elif first_damaged is not None:
                raise self._damaged(first_damaged)
            else:
                self._end = offset + len(line)
            offset += len(line)
        if self.dropped:
            self._file.truncate(self._end)

    def _take(self, line: bytes, offset: int) -> bool:
        """Mark the row in a line at an offset; False if the line is damaged."""
        if self._index is not None and self._index.is_index(line):
            return True
        placed = self._row_and_place(line)
        if placed is None:
            return False
        self._mark(placed[1], offset)
        return True

    def _damaged(self, offset: int) -> JobError:
        """The error for a line at an offset."""
        self._file.seek(0)
        lines = sum(self._file.read(min(_BLOCK, offset - k)).count(b"\n") for k in range(0, offset, _BLOCK))
        return JobError(
            f"{self.name}, line {lines + 1}: damaged, or not of this job; remove this line to have it done again, or "
            "the file to start again."
        )

    def _row_and_place(self, line: bytes) -> tuple[Row, int | None] | None:
        """The row in a line and its place; None if the line is damaged, or cannot be of this job."""
        values = self._lines.content(line)
        if values is None:
            return None
        try:
            row = self._row_type(*self._values.validate_json(values, strict=True))
            return row, self.place(row)
        except (ValidationError, LookupError):
            return None

    def __contains__(self, place: int) -> bool:
        """Whether a row is finished."""
        return bool(self._offsets[place] != NOT_FINISHED)

    def __getitem__(self, place: int) -> Row:
        """A finished row; raises JobError if it has become damaged."""
        offset = int(self._offsets[place])
        try:
            self._file.seek(offset)
            placed = self._row_and_place(self._file.readline(LONGEST_LINE))
        except OSError as problem:
            raise JobError(f"{self.name} cannot be read: {reason_of(problem)}; check the disk that it is on.") from None
        if placed is None or placed[1] != place:
            raise self._damaged(offset)
        return placed[0]

    def missing(self) -> array[int]:
        """Places of the rows that are not finished."""
        return array("q", np.flatnonzero(self._offsets == NOT_FINISHED).astype(np.int64).tobytes())

    def add(self, rows: Iterable[Row]) -> None:
        """Keep finished rows."""
        rows = list(rows)
        lines = [self._lines.line(self._values_of(row)) for row in rows]
        offset = self._end
        self._write(b"".join(lines))
        for row, line in zip(rows, lines, strict=True):
            self._mark(self.place(row), offset)
            offset += len(line)
        if self._index is not None and self._index.is_due(self._end):
            for line in self._index.new_lines(self._end):
                self._write(line)

    def forget(self, place: int) -> None:
        """Take a row as not finished; the next one that is added takes its place."""
        self.finished -= place in self
        self._offsets[place] = NOT_FINISHED

    def _mark(self, place: int | None, offset: int) -> None:
        """Take a row at an offset as finished, if it is wanted now."""
        if place is not None:
            self.finished += place not in self
            self._offsets[place] = offset
            if self._index is not None:
                self._index.add(place)

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
    """The JSON in a line of the file; None if it is none."""
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None
