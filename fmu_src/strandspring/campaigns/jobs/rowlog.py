"""Finished rows on disk, so that an interrupted job goes on where it ended.

An SQLite file with the manifest of the job, and with each row as JSON under its key. The rows of a batch are one
transaction: after a kill, all or none of them are there. The checksums of rows continue that of the manifest, so that
no damaged row and none of another job is ever used. In memory there is a byte for each place.

It is written in WAL mode, which needs no wait for the disk at each transaction: a power failure costs the last ones at
most. The -wal file beside it ends with the program, unless that is killed; then it holds the last rows.
"""

from __future__ import annotations

import json
import os
import sqlite3
import sys
import zlib
from abc import ABC, abstractmethod
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, Generic, TypeVar, get_type_hints

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from ...errors import JobError
from ...ground.files import readable, reason_of

_APPLICATION, _LAYOUT = 0x53707267, 1  # "Sprg"
_TABLES = {
    "job": "CREATE TABLE job (manifest BLOB)",
    "row": "CREATE TABLE row (key INTEGER PRIMARY KEY, checksum INTEGER, content BLOB)",
}
_SCHEMA = [_APPLICATION, _LAYOUT, *(("table", name, name, statement) for name, statement in _TABLES.items())]
_EMPTY = [0, 0]
_LARGEST = 1 << 26  # bytes of a row or a manifest; that of a million masses has 20 MB

_encoded = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode
_anything: TypeAdapter[Any] = TypeAdapter(Any, config=ConfigDict(ser_json_inf_nan="constants"))
Row = TypeVar("Row")
# Ends a rollback journal that names another file, which SQLite would remove. Only transactions over several databases
# write such a journal.
_NAMES_ANOTHER = b"\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"
_OPENING = (
    "PRAGMA locking_mode = EXCLUSIVE",  # until it is closed; comes first, so that no file of shared memory is made
    "PRAGMA trusted_schema = OFF",
    "PRAGMA cell_size_check = ON",
    "PRAGMA temp_store = MEMORY",
    "PRAGMA synchronous = NORMAL",
    "BEGIN EXCLUSIVE",
)


class RowLog(ABC, Generic[Row]):
    """Finished rows of one job on disk, which no other program can use meanwhile.

    Parameters
    ----------
    path : Path              Created with its folder if it does not exist.
    row_type : type          Dataclass of a row.
    keys : sequence of int   Key of the row at each place.
    manifest : dict          What makes the file the log of this job.

    Attributes
    ----------
    path : Path
    name : str         The path as it is shown.
    finished : int     Number of finished rows.
    dropped : int      Number of damaged rows that were dropped.

    Raises
    ------
    JobError           If the file cannot be read or written, is damaged, in use, or the log of another job.
    """

    def __init__(self, path: Path, row_type: type[Row], keys: Sequence[int], manifest: dict[str, Any]) -> None:
        self.path = path
        self.name = readable(path)
        self.finished = self.dropped = 0
        self._row_type = row_type
        self._values = _values_adapter(row_type)
        self._keys = keys
        self._has_rows = False
        self._is_finished = np.zeros(len(keys), bool)
        self._new_folders = [folder for folder in (path.parent, *path.parent.parents) if not os.path.lexists(folder)]
        content = _encoded(manifest).encode()
        self._job = zlib.crc32(content)
        try:
            self._database = self._opened(json.loads(content))  # as it is read back: tuples are lists
        except BaseException:
            self._remove_new_folders()
            raise
        try:
            with self._refused("cannot be written", "make room, or write elsewhere"):
                self._begin(content)
            with self._refused("is damaged", "remove it to start again"):
                self._read()
        except BaseException:
            self.close(remove=False)
            raise

    @abstractmethod
    def key(self, row: Row) -> int:
        """The key of a row."""

    @abstractmethod
    def place(self, key: int) -> int | None:
        """The place of a key, None if it is not wanted now; raises LookupError if it cannot be one of this job."""

    @abstractmethod
    def check(self, manifest: object, expected: dict[str, Any]) -> None:
        """Raise JobError for the manifest of another job; `manifest` is any JSON, None for none."""

    @property
    def dropped_sentence(self) -> str:
        """What was dropped, in words."""
        return f"{self.dropped} damaged row{' was' if self.dropped == 1 else 's were'} dropped"

    @contextmanager
    def _refused(self, what: str, advice: str) -> Iterator[None]:
        try:
            yield
        except (sqlite3.Error, OSError) as problem:
            reason = reason_of(problem) if isinstance(problem, OSError) else str(problem)
            raise JobError(f"{self.name} {what}: {reason}; {advice}.") from None

    def _opened(self, manifest: dict[str, Any]) -> sqlite3.Connection:
        """The database, empty or with this manifest; what is not ours is left as it is."""
        with self._refused("cannot be written", "check the path and its rights"):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            try:
                database = open_alone(self.path)
            except sqlite3.DatabaseError as problem:
                if "malformed" not in str(problem):
                    self.check(None, manifest)
                raise JobError(f"{self.name} is damaged: {problem}; remove it to start again.") from None
        try:
            with self._refused("is damaged", "remove it to start again"):
                if _schema(database) != _EMPTY:
                    self.check(_manifest(database), manifest)
                    # Without indices and constraints, integrity_check would find nothing more.
                    state = database.execute("PRAGMA quick_check(1)").fetchone()[0]
                    if state != "ok":
                        raise sqlite3.DatabaseError(state.replace("\n", ", "))
        except BaseException:
            database.close()
            raise
        return database

    def _begin(self, manifest: bytes) -> None:
        """Write what comes before the rows, if the file is empty."""
        self._database.execute("PRAGMA journal_mode = WAL")
        if _schema(self._database) == _EMPTY:
            with self._database:
                self._database.execute("BEGIN")
                self._database.execute(f"PRAGMA application_id = {_APPLICATION}")
                self._database.execute(f"PRAGMA user_version = {_LAYOUT}")
                for statement in _TABLES.values():
                    self._database.execute(statement)
                self._database.execute("INSERT INTO job VALUES (?)", (manifest,))

    def _read(self) -> None:
        """Mark the rows, and drop damaged ones."""
        with self._database:
            too_large = "DELETE FROM row WHERE typeof(content) <> 'blob' OR length(content) > ?"
            self.dropped = self._database.execute(too_large, (_LARGEST,)).rowcount
            damaged = []
            for key, checksum, content in self._database.execute("SELECT key, checksum, content FROM row"):
                is_whole = checksum == zlib.crc32(content, self._job)
                try:
                    place = self.place(key)
                except LookupError:
                    is_whole = False
                if is_whole:
                    self._has_rows = True
                    self._mark(place)
                else:
                    damaged.append((key,))
            self.dropped += len(damaged)
            self._database.executemany("DELETE FROM row WHERE key = ?", damaged)

    def __contains__(self, place: int) -> bool:
        """Whether a row is finished."""
        return bool(self._is_finished[place])

    def __getitem__(self, place: int) -> Row:
        """A finished row; if it is or has become damaged, it is dropped, and JobError raised."""
        key = self._keys[place]
        with self._refused("cannot be read", "check the disk that it is on"):
            stored = self._database.execute("SELECT checksum, content FROM row WHERE key = ?", (key,)).fetchone()
            if stored is not None and stored[0] == zlib.crc32(stored[1], self._job):
                with suppress(ValidationError):
                    row = self._row_type(*self._values.validate_json(stored[1], strict=True))
                    if self.key(row) == key:
                        return row
            with self._database:
                self._database.execute("DELETE FROM row WHERE key = ?", (key,))
        self.forget(place)
        raise JobError(f"{self.name} had a damaged row, which was dropped; start the same command again.")

    def missing(self) -> array[int]:
        """Places of the rows that are not finished."""
        return array("q", np.flatnonzero(~self._is_finished).astype(np.int64).tobytes())

    def add(self, rows: Iterable[Row]) -> None:
        """Keep finished rows."""
        self.add_encoded([(self.key(row), encoded_row(row)) for row in rows])

    def add_encoded(self, rows: Iterable[tuple[int, bytes]]) -> None:
        """Keep finished rows, given by their keys and as `encoded_row` has them."""
        lines = [(key, zlib.crc32(content, self._job), content) for key, content in rows]
        with self._refused("cannot be written", "make room, or write elsewhere"), self._database:
            self._database.executemany("INSERT OR REPLACE INTO row VALUES (?, ?, ?)", lines)
        self._has_rows = True
        for key, _, _ in lines:
            self._mark(self.place(key))

    def forget(self, place: int) -> None:
        """Take a row as not finished; the next one that is added takes its place."""
        self.finished -= place in self
        self._is_finished[place] = False

    def _mark(self, place: int | None) -> None:
        """Take a row as finished, if it is wanted now."""
        if place is not None:
            self.finished += place not in self
            self._is_finished[place] = True

    def close(self, remove: bool) -> None:
        """Close the file; remove it if asked to, or if it holds no row.

        Raises
        ------
        JobError   If it cannot be removed as asked.
        """
        if not remove and self._has_rows:
            self._database.close()
            return
        try:
            remove_open(self._database, self.path)
        except OSError as problem:
            if remove:
                raise JobError(
                    f"{self.name} is no longer needed, but cannot be removed: {reason_of(problem)}; remove it."
                ) from None
        self._remove_new_folders()

    def _remove_new_folders(self) -> None:
        """Remove the folders that were made for the file and hold nothing else."""
        with suppress(OSError):
            for folder in self._new_folders:
                folder.rmdir()


def encoded_row(row: Any) -> bytes:
    """The JSON of a row, most often by the faster encoder."""
    values = _values_of(row.__class__)(row)
    with suppress(ValueError):  # names of files need not be text
        content = _anything.dump_json(values)
        if b"NaN" not in content and b"Infinity" not in content:
            return content
    return _encoded(values).encode(errors="replace")


@cache
def _values_of(row_type: type[Any]) -> Callable[[object], object]:
    return attrgetter(*(field.name for field in fields(row_type)))


def _schema(database: sqlite3.Connection) -> list[object]:
    """What tells our databases from others, and all their tables, views, indices and triggers."""
    numbers = (database.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version"))
    return [*numbers, *database.execute("SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY name LIMIT 3")]


def _manifest(database: sqlite3.Connection) -> object:
    """The JSON of the manifest; None if the database is not exactly as it is written here."""
    if _schema(database) != _SCHEMA:
        return None
    possible = "SELECT manifest FROM job WHERE typeof(manifest) = 'blob' AND length(manifest) <= ? LIMIT 2"
    stored = database.execute(possible, (_LARGEST,)).fetchall()
    try:
        return json.loads(stored[0][0]) if len(stored) == 1 else None
    except (ValueError, RecursionError):
        return None


def _values_adapter(row_type: type[Any]) -> TypeAdapter[tuple[Any, ...]]:
    """The types of a row's values."""
    types = tuple(get_type_hints(row_type).values())
    return TypeAdapter(tuple[types], config=ConfigDict(allow_inf_nan=False))  # type: ignore[valid-type]


def open_alone(path: Path) -> sqlite3.Connection:
    """Open a database, and create it if there is none; it is locked until it is closed.

    A symbolic link is followed. What an interrupted transaction left is rolled back.

    Raises
    ------
    JobError                 If it is not a regular file, another program has it open, or it cannot be written.
    sqlite3.DatabaseError    If it is not a database.
    """
    name = readable(path)
    if "\0" in str(path):
        raise JobError(f"{name} is not a possible path; write elsewhere.")
    is_new = False
    try:
        while True:
            before = _identity(path)
            is_new |= before is None
            database = sqlite3.connect(os.path.realpath(path), timeout=0.0)
            try:
                for statement in _OPENING:
                    database.execute(statement)
                database.rollback()
                if before is not None and _identity(path) == before:
                    return database
            except BaseException as problem:
                database.close()
                if not isinstance(problem, sqlite3.Error) or _identity(path) == before:
                    if is_new and "locked" not in str(problem):
                        path.unlink(missing_ok=True)
                    raise
            database.close()  # it is new, or was removed before the lock by the program that had locked it
    except OSError as problem:
        raise JobError(f"{name} cannot be written: {reason_of(problem)}; check the path and its rights.") from None
    except UnicodeDecodeError:
        # SQLite's message quotes bytes of the file.
        raise sqlite3.DatabaseError("malformed database schema") from None
    except sqlite3.OperationalError as problem:
        if "locked" in str(problem):
            raise JobError(
                f"{name} is in use by another run of the same command; wait until that has ended, or write elsewhere."
            ) from None
        raise JobError(f"{name} cannot be written: {problem}; check the path and its rights.") from None


def _identity(path: Path) -> tuple[int, int] | None:
    """What tells a file from others, None if there is none; raises JobError for what SQLite must not open."""
    target = os.path.realpath(path)
    interrupted = Path(f"{target}-journal")
    for beside in (path, Path(f"{target}-wal"), interrupted):
        if beside.exists() and not beside.is_file():
            raise JobError(f"{readable(beside)} is a folder or a device; move it away, or write elsewhere.")
    if interrupted.exists():
        with interrupted.open("rb") as file:
            file.seek(-min(len(_NAMES_ANOTHER), interrupted.stat().st_size), os.SEEK_END)
            if file.read() == _NAMES_ANOTHER:
                raise JobError(f"{readable(interrupted)} was not written by strandspring; move it away.")
    if not path.exists():
        return None
    status = path.stat()
    return status.st_dev, status.st_ino


def remove_open(database: sqlite3.Connection, path: Path) -> None:
    """Remove a file that was opened by `open_alone`, and close it; raises OSError if it cannot be removed.

    Of a symbolic link, what it leads to is removed.
    """
    path = Path(os.path.realpath(path))
    try:
        with suppress(sqlite3.Error):  # the -wal file first: once the file is removed, it would be that of another run
            database.execute("PRAGMA journal_mode = DELETE")
        if sys.platform == "win32":  # where a file must be closed first
            database.close()
        path.unlink(missing_ok=True)  # elsewhere while it is locked: nobody else has begun to use it
    finally:
        database.close()
