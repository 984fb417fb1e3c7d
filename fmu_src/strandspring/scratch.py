"""Temporary folders that end with their process, and what processes that were killed have left of them.

A folder is locked as long as its process lives; the system frees the lock whatever ends the process. Folders that
nobody holds are removed when another is made in the same place. Windows has no such locks: there they remain.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
import weakref
from contextlib import suppress
from functools import cache
from pathlib import Path

from .errors import StrandspringError
from .locks import lock

_NAME = "strandspring-"
# With the process in its name, so that folders of users are not meant, such as strandspring-results.
_ABANDONED = re.compile(rf"\.?{_NAME}\d+-[a-z0-9_]{{8}}")


class TemporaryFolder:
    """An empty folder for this process alone, removed at the end of a with statement, at the latest with the process.

    Parameters
    ----------
    beside : Path or None   Folder in which it is hidden, where what it holds is to be moved to; by default it is made
                            where the system has temporary files.

    Attributes
    ----------
    path : Path

    Raises
    ------
    StrandspringError       If it cannot be made.
    """

    def __init__(self, beside: Path | None = None) -> None:
        try:
            # Absolute, since the program may go to another folder.
            place = Path(tempfile.gettempdir() if beside is None else beside).absolute()
            _remove_abandoned(place)
            self.path, held = _locked_folder(place, "" if beside is None else ".")
        except OSError as problem:
            remedy = "set TMPDIR to a folder that can be written" if beside is None else "choose another folder"
            raise StrandspringError(
                f"No temporary folder can be made in {beside or 'the system'} ({problem.strerror}); {remedy}."
            ) from None
        self._end = weakref.finalize(self, _discard, self.path, held, os.getpid())

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder with all it holds."""
        self._end()


def _discard(path: Path, held: int | None, process: int) -> None:
    """Remove a folder; a fork of the process that made it leaves it."""
    if os.getpid() == process:
        shutil.rmtree(path, ignore_errors=True)
    if held is not None:
        os.close(held)


def _locked_folder(place: Path, prefix: str) -> tuple[Path, int | None]:
    """A new folder, and the file descriptor that holds its lock, if the system has locks."""
    while True:
        path = Path(tempfile.mkdtemp(prefix=f"{prefix}{_NAME}{os.getpid()}-", dir=place))
        if sys.platform == "win32":
            return path, None
        with suppress(FileNotFoundError, BlockingIOError):  # another process took it for abandoned before it was locked
            held = _lock(path)
            if held is None or path.exists():
                return path, held
            os.close(held)


def _lock(path: Path) -> int | None:
    """Lock a folder until the file descriptor is closed; None where the file system has no locks.

    Raises
    ------
    OSError   If it is not a folder, but perhaps a link to one; BlockingIOError if it is locked.
    """
    if sys.platform == "win32":
        return None
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    is_ours = lock(folder)
    if is_ours:
        return folder
    os.close(folder)
    if is_ours is None:
        return None
    raise BlockingIOError(str(path))


@cache
def _remove_abandoned(place: Path) -> None:
    """Remove this user's folders whose processes have ended, once in a process."""
    if sys.platform == "win32":
        return
    with suppress(OSError), os.scandir(place) as entries:
        for path in [Path(entry) for entry in entries if _ABANDONED.fullmatch(entry.name)]:
            # Another process may be removing it.
            with suppress(OSError):
                held = _lock(path)
                if held is not None:
                    if os.fstat(held).st_uid == os.geteuid():
                        shutil.rmtree(path, ignore_errors=True)
                    os.close(held)
