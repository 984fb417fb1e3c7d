"""Locks of files and folders that end with their process, whatever ends it."""

from __future__ import annotations

import os
import sys

if sys.platform == "win32":
    import msvcrt

    _IsHeld = PermissionError
else:
    import fcntl

    _IsHeld = BlockingIOError

# On Windows, where what is locked cannot be read, it is a byte that is never written.
_LOCKED_BYTE = 1 << 62


def lock(descriptor: int) -> bool | None:
    """Lock an open file, or on other systems than Windows a folder, until it is closed, also by the end of the process.

    Returns
    -------
    bool or None   Whether it is locked now: False if another holds it, None if there are no such locks, as on some
                   network drives.
    """
    try:
        if sys.platform == "win32":
            position = os.lseek(descriptor, 0, os.SEEK_CUR)
            os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
            try:
                msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            finally:
                os.lseek(descriptor, position, os.SEEK_SET)
        else:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except _IsHeld:
        return False
    except OSError:
        return None
    return True
