"""An SQLite file that one program at a time uses, and that anyone may have written."""

from __future__ import annotations

import os
import sqlite3
import sys
from contextlib import suppress
from pathlib import Path

from ...ground.files import readable, reason_of
from .runners import JobError

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
