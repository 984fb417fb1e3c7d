"""Files in zip archives from outside."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Collection

_MOST_FILES = 10_000
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # those of FMI; others may ask for any amount of memory
_MOST_SHOWN = 80  # characters from an archive in a message
_ENCRYPTED = 0x1  # bit of an entry's flags


def unpacked(archive: bytes, maximum_bytes: int, names: Collection[str] | None = None) -> dict[str, bytes]:
    """Content of files by their name.

    Parameters
    ----------
    archive : bytes
    maximum_bytes : int   Of the files together.
    names : collection of str, or None   Files that are wanted, as far as there are such; all if None.

    Raises
    ------
    ValueError            If they cannot be unpacked; the message says why, without advice.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(archive)) as opened:
            entries = [entry for entry in opened.infolist() if not entry.is_dir()]
            if len(entries) > _MOST_FILES:
                raise ValueError(f"it holds more than {_MOST_FILES} files")
            wanted = [entry for entry in entries if names is None or entry.filename in names]
            _check(wanted, maximum_bytes)
            # Reading stops at the size that an entry gives, and checks its checksum.
            return {entry.filename: opened.read(entry) for entry in wanted}
    except (zipfile.BadZipFile, zlib.error, EOFError, OSError, NotImplementedError) as problem:
        # Which may hold names of files, and more of the damaged archive.
        reason = ascii(str(problem).rstrip(".")[:_MOST_SHOWN])[1:-1]
        raise ValueError(f"its archive is damaged: {reason or 'it ends too early'}") from None


def unpacked_text(archive: bytes, maximum_bytes: int, name: str) -> str | None:
    """The text of one file, None if there is none; arguments and errors as for `unpacked`."""
    content = unpacked(archive, maximum_bytes, (name,)).get(name)
    try:
        return None if content is None else content.decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError(f"{name} is not UTF-8 text") from None


def _check(entries: list[zipfile.ZipInfo], maximum_bytes: int) -> None:
    """Refuse entries that are not for reading."""
    if sum(entry.file_size for entry in entries) > maximum_bytes:
        raise ValueError(f"its files have more than {maximum_bytes} bytes together")
    if len({entry.filename for entry in entries}) < len(entries):
        raise ValueError("it holds two files of the same name")
    for entry in entries:
        if entry.flag_bits & _ENCRYPTED:
            raise ValueError(f"{entry.filename[:_MOST_SHOWN]!a} is encrypted")
        if entry.compress_type not in _METHODS:
            raise ValueError(f"{entry.filename[:_MOST_SHOWN]!a} is compressed by a method other than deflate")
