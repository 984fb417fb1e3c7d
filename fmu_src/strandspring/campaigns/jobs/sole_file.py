"""A file that one program at a time appends to and reads."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import BinaryIO

from ...ground.files import readable, reason_of
from ...ground.locks import lock
from .runners import JobError


def open_alone(path: Path) -> BinaryIO:
    """Open a regular file to read and append, and create it if there is none; it is locked until it is closed.

    A symbolic link is followed.

    Raises
    ------
    JobError   If it is not a regular file, another program has it open, or it cannot be written.
    """
    name = readable(path)
    if "\0" in str(path):
        raise JobError(f"{name} is not a possible path; write elsewhere.")
    try:
        while True:
            if path.exists() and not path.is_file():
                raise JobError(f"{name} is a folder or a device; move it away, or write elsewhere.")
            file = path.open("a+b")
            try:
                is_ours = lock(file.fileno()) is not False
                # It may have been removed between the opening and the lock, by the program that had locked it.
                is_current = is_ours and path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat())
            except BaseException:
                file.close()
                raise
            if is_current:
                return file
            file.close()
            if not is_ours:
                raise JobError(
                    f"{name} is in use by another run of the same command; wait until that has ended, or write "
                    "elsewhere."
                )
    except OSError as problem:
        raise JobError(f"{name} cannot be written: {reason_of(problem)}; check the path and its rights.") from None


def remove_open(file: BinaryIO, path: Path) -> None:
    """Remove a file that was opened by `open_alone`, and close it; raises OSError if it cannot be removed.

    Of a symbolic link, what it leads to is removed.
    """
    path = Path(os.path.realpath(path))
    if sys.platform == "win32":  # where a file must be closed first
        file.close()
        path.unlink(missing_ok=True)
        return
    try:
        path.unlink(missing_ok=True)  # while it is locked: nobody else has begun to use it
    finally:
        file.close()
