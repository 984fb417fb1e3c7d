"""Temporary folders that end with their process, and what processes that were killed have left of them.

A folder is locked as long as its process lives; the system frees the lock whatever ends the process. Folders that
nobody holds are removed when another is made in the same place. Windows has no such locks: there they remain.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
import sys
import tempfile
import weakref
from contextlib import suppress
from functools import cache
from pathlib import Path

from ..errors import StrandspringError
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
        place = "TMPDIR" if beside is None else str(beside)
        try:
            # Absolute, since the program may go to another folder.
            folder = Path(tempfile.gettempdir() if beside is None else beside).absolute()
            _remove_abandoned(folder)
            prefix = f"{'' if beside is None else '.'}{_NAME}{os.getpid()}-"
            while not self._is_made(folder / f"{prefix}{secrets.token_hex(4)}"):
                pass
        except OSError as problem:
            remedy = "set TMPDIR to a folder that can be written" if beside is None else "choose another folder"
            raise StrandspringError(
                f"No temporary folder can be made in {place} ({problem.strerror or problem}); {remedy}."
            ) from None

    def _is_made(self, path: Path) -> bool:
        """Make and lock the folder; False if the name is taken, or another process took it for abandoned meanwhile."""
        self.path = path
        self._content: tuple[Path, list[int], int] = path, [], os.getpid()
        # Before there is a folder: an interrupt while it is made does not leave it.
        self._end = weakref.finalize(self, _discard, *self._content)
        try:
            path.mkdir(0o700)
        except FileExistsError:
            self._end.detach()
            return False
        with suppress(FileNotFoundError, BlockingIOError):
            self._content[1].extend(_lock(path))
            if path.exists():
                return True
        self._end()
        return False

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder with all it holds."""
        # Not by the finalizer, which would not come again after an interrupt.
        _discard(*self._content)
        self._end.detach()


def _discard(path: Path, held: list[int], process: int) -> None:
    """Remove a folder and close the descriptors that lock it; a fork of the process that made it leaves it."""
    if os.getpid() == process:
        try:
            shutil.rmtree(path, ignore_errors=True)
        except OSError as problem:
            # An interrupt as rmtree closes a descriptor makes it close that twice, and fail of this.
            if isinstance(problem.__context__, KeyboardInterrupt):
                raise problem.__context__ from None
            raise
    while held:
        os.close(held.pop())


def _lock(path: Path) -> list[int]:
    """Lock a folder until the file descriptor is closed that is returned; none where the system has no locks.

    Raises
    ------
    OSError   If it is not a folder, but perhaps a link to one; BlockingIOError if it is locked.
    """
    if sys.platform == "win32":
        return []
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    is_ours = lock(folder)
    if is_ours:
        return [folder]
    os.close(folder)
    if is_ours is None:
        return []
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
                for held in _lock(path):
                    if os.fstat(held).st_uid == os.geteuid():
                        shutil.rmtree(path, ignore_errors=True)
                    os.close(held)
