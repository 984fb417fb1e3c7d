"""Reading files from outside, and writing files completely or not at all."""

from __future__ import annotations

import csv
import os
import secrets
import stat
import sys
import tempfile
import time
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import IO

from ..errors import StrandspringError
from .locks import lock

# Control characters, marks that hide or turn what follows, no characters, bytes that are no UTF-8, ends of lines.
_UNREADABLE = ("Cc", "Cf", "Cn", "Cs", "Zl", "Zp")
_ABANDONED_AFTER = 60.0  # [s], of a file that nobody holds
_PART = "part"
_SIZELESS = 2**20  # [B]
_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # what a spreadsheet takes for the beginning of a formula
_NO_TEXT = frozenset((float, int, bool, type(None)))


def readable(name: str | os.PathLike[str]) -> str:
    """A file name, or what the file is `called`, with all characters replaced that terminal or UTF-8 cannot show."""
    shown: str = getattr(name, "called", None) or os.fspath(name)
    return "".join("\ufffd" if unicodedata.category(c) in _UNREADABLE else c for c in shown)


@contextmanager
def opened(
    path: str | os.PathLike[str], maximum_bytes: int, file_type: str, error: Callable[[str], StrandspringError]
) -> Iterator[IO[bytes]]:
    """A file from outside, opened for reading: only if it is a regular one of a bounded size.

    Parameters
    ----------
    path : path-like
    maximum_bytes : int
    file_type : str      Such as "a model file", for the sentences.
    error : callable     Makes the error of a sentence, which is raised also for what fails while the file is read.
    """
    name = readable(path)
    is_folder = f"{name}: is a folder; give the path of {file_type}."
    try:
        file = open(path, "rb", opener=_without_waiting)  # noqa: SIM115 (a Path's open has no opener)
    except FileNotFoundError:
        raise error(f"{name}: no such file; check the path.") from None
    except OSError as problem:
        if os.path.isdir(path):  # noqa: PTH112 (raises nothing)
            raise error(is_folder) from None
        raise error(f"{name}: cannot be read ({reason_of(problem)}); check the path and rights.") from None
    except ValueError as problem:
        raise error(f"{name}: is not a possible path ({problem}); check it.") from None
    with file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise error(f"{name}: is not a regular file; give the path of {file_type}.")
        if status.st_size > maximum_bytes:
            raise error(
                f"{name}: has {status.st_size} bytes, and {file_type} may have at most {maximum_bytes}; give a "
                "smaller one."
            )
        try:
            yield file
        except OSError as problem:
            raise error(f"{name}: cannot be read ({reason_of(problem)}); check the disk and copy it again.") from None


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without waiting for what may be a pipe that nobody writes to."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def read_bytes(
    path: str | os.PathLike[str], maximum_bytes: int, file_type: str, error: Callable[[str], StrandspringError]
) -> bytes:
    """Content of a file from outside; arguments and errors as for `opened`."""
    with opened(path, maximum_bytes, file_type, error) as file:
        # A buffer for what is there: files of /proc have no size.
        expected = min(max(os.fstat(file.fileno()).st_size, _SIZELESS), maximum_bytes)
        content = file.read(expected + 1)
    if len(content) > expected:
        raise error(f"{readable(path)}: grows while it is read; give {file_type} that is complete.")
    return content


def read_text(
    path: str | os.PathLike[str], maximum_bytes: int, file_type: str, error: Callable[[str], StrandspringError]
) -> str:
    """Content of a UTF-8 file from outside, with \\n as line end and without a byte order mark, which Windows editors
    put before it; arguments and errors as for `opened`.
    """
    content = read_bytes(path, maximum_bytes, file_type, error)
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError:
        raise error(f"{readable(path)}: is not UTF-8 text; give the path of {file_type}.") from None


def reason_of(problem: OSError) -> str:
    """What the system says of a problem; never empty."""
    return problem.strerror or str(problem) or type(problem).__name__


def refuse_unwritable(path: Path, is_folder: bool = False) -> None:
    """Refuse a file, or a folder for files, that cannot be written, before the work for it begins; leaves nothing.

    Raises
    ------
    StrandspringError   If the path is taken by something else, or it or the folder that holds it (or, where there is
                        none yet, the one that it would be created in) is not writable.

    Examples
    --------
    >>> refuse_unwritable(Path(__file__) / "model.json")           # doctest: +ELLIPSIS
    Traceback (most recent call last):
    strandspring.errors.StrandspringError: ... cannot be written: ... is not a folder.
    """
    with refused_in_words(path):
        if is_folder:
            folder = existing_folder(path)
        else:
            target = _target(path)
            if target.exists():
                # Opened for update, a file stays as it is.
                target.open("r+b").close()
            folder = existing_folder(target.parent)
        if not folder.is_dir():
            what = "it is a file; give a folder" if folder == path else f"{readable(folder)} is not a folder"
            raise StrandspringError(f"{readable(path)} cannot be written: {what}.")
        tempfile.TemporaryFile(dir=folder).close()


def existing_folder(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file in the folder of `path` that replaces `path` if the block ends without an exception.

    As with a shell's redirection, a symbolic link stays one and its target is written, an existing file keeps its
    permissions, a new one has those of the umask, and a read-only file is refused. The content is on the disk before
    the name is: after a power cut the file is the old one or the new one. What programs that were killed have left of
    the same file is removed.

    Raises
    ------
    StrandspringError   If the file or its folder is not writable, the disk is full, or `path` is not a regular file.
    """
    with refused_in_words(path):
        target = _target(path)
        mode = None
        if target.exists():
            target.open("r+b").close()
            mode = target.stat().st_mode
        target.parent.mkdir(parents=True, exist_ok=True)
        stem = f".{target.name[:40]}."
        _remove_abandoned(target.parent, stem)
        part = target.with_name(f"{stem}{secrets.token_hex(4)}.{_PART}")
    try:
        with refused_in_words(path), part.open("xb") as held:
            lock(held.fileno())
            yield part
            if mode is not None:
                part.chmod(stat.S_IMODE(mode))
            with part.open("r+b") as written:
                os.fsync(written.fileno())
            held.close()
            part.replace(target)
            _sync_folder(target.parent)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def refused_in_words(path: Path) -> Iterator[None]:
    """What fails in the block as a sentence on the file that is to be written."""
    try:
        yield
    except OSError as problem:
        raise StrandspringError(
            f"{readable(path)} cannot be written: {reason_of(problem)}; check the path, the rights and the room there."
        ) from None
    except ValueError as problem:
        if isinstance(problem, StrandspringError) or "\0" not in os.fspath(path):
            raise
        raise StrandspringError(f"{readable(path)} cannot be written: it is not a possible path.") from None


def _remove_abandoned(folder: Path, stem: str) -> None:
    """Remove temporary files of a name whose programs were killed: nobody holds them any more."""
    for path in _parts(folder, int(time.monotonic() / _ABANDONED_AFTER)):
        if path.name.startswith(stem):
            # Another program may be removing it, too.
            with suppress(OSError):
                is_old = time.time() - path.lstat().st_mtime > _ABANDONED_AFTER
                if is_old and not path.is_symlink() and not is_locked(path):
                    path.unlink()


@lru_cache(maxsize=8)
def _parts(folder: Path, minute: int) -> list[Path]:  # noqa: ARG001
    """Temporary files in a folder, which is searched once a minute: thousands of files may be written into it."""
    with os.scandir(folder) as entries:
        return [folder / entry.name for entry in entries if entry.name.endswith(f".{_PART}")]


def _sync_folder(folder: Path) -> None:
    """Put a folder's names on the disk, where a system can."""
    with suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def is_locked(path: Path) -> bool:
    """Whether somebody holds a file's lock; raises OSError if it cannot be opened."""
    with path.open("rb") as file:
        return lock(file.fileno()) is False


def _target(path: Path) -> Path:
    """The path of the file that is to be written: of a symbolic link, what it leads to."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise StrandspringError(f"{readable(path)} cannot be written: it is a link that leads to itself.")
    if target.exists() and not target.is_file():
        raise StrandspringError(
            f"{readable(path)} cannot be written: it is a folder or a device; give the path of a file."
        )
    return target


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text with \\n as line end."""
    with replacing(path) as part:
        part.write_bytes(text.encode("utf-8"))


def write_csv(path: Path, header: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a table, every number with all its digits and None as an empty cell.

    Text that a spreadsheet would take for a formula is preceded by an apostrophe, also in the header, and a carriage
    return, which some readers take for the end of a row, becomes a blank.
    """
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(map(_harmless, header))
        writer.writerows(
            row if _NO_TEXT.issuperset(map(type, row)) else list(map(_harmless, row)) for row in map(tuple, rows)
        )


def _harmless(cell: object) -> object:
    if not isinstance(cell, str):
        return cell
    text = cell.replace("\r", " ")
    return f"'{text}" if cell.startswith(_FORMULA) else text


def user_cache() -> Path:
    """The folder for files that can be made again; it may not exist."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or "~/AppData/Local")
    elif sys.platform == "darwin":
        base = Path("~/Library/Caches")
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache")
    return base.expanduser() / "strandspring"


def bundled_file(name: Path) -> Path:
    """A file that comes with the program: that of the installed package, or of the folder `models` of a checkout.

    Examples
    --------
    >>> bundled_file(Path("records") / "rubber_stretch.csv").is_file()
    True
    """
    package = Path(__file__).resolve().parent.parent
    installed = package / "examples" / name
    return installed if installed.is_file() else package.parents[1] / "models" / name
