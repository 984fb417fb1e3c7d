"""Reading text files, and writing files completely or not at all."""

from __future__ import annotations

import csv
import os
import secrets
import stat
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import StrandspringError


def read_text(path: Path, maximum_bytes: int, file_type: str, error: Callable[[str], StrandspringError]) -> str:
    """Content of a UTF-8 file; raises `error` with one sentence if it cannot be read."""
    try:
        is_folder = path.is_dir()
        size = 0 if is_folder else path.stat().st_size
        text = path.read_text(encoding="utf-8") if not is_folder and size <= maximum_bytes else ""
    except UnicodeDecodeError:
        raise error(f"{path} is not UTF-8 text; give the path of a {file_type}.") from None
    except OSError as problem:
        raise error(f"{path} cannot be read: {problem.strerror}.") from None
    except ValueError:
        raise error(f"{str(path)!a} is not a possible path; give the path of a {file_type}.") from None
    if is_folder:
        raise error(f"{path} is a directory; give the path of a {file_type}.")
    if size > maximum_bytes:
        raise error(f"{path} has {size} bytes, but a {file_type} may have at most {maximum_bytes}.")
    return text


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
    try:
        if is_folder:
            folder = existing_folder(path)
        else:
            target = _target(path)
            if target.exists():
                # Opened for update, a file stays as it is.
                target.open("r+b").close()
            folder = existing_folder(target.parent)
        if not folder.is_dir():
            what = "it is a file; give a folder" if folder == path else f"{folder} is not a folder"
            raise StrandspringError(f"{path} cannot be written: {what}.")
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as problem:
        raise StrandspringError(f"{path} cannot be written: {problem.strerror}.") from None


def existing_folder(folder: Path) -> Path:
    """The folder, or the nearest one above it that exists."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file in the folder of `path` that replaces `path` if the block ends without an exception.

    As with a shell's redirection, a symbolic link stays one and its target is written, an existing file keeps its
    permissions, a new one has those of the umask, and a read-only file is refused.

    Raises
    ------
    StrandspringError   If the file or its folder is not writable, or `path` is not a regular file.
    """
    try:
        target = _target(path)
        mode = None
        if target.exists():
            target.open("r+b").close()
            mode = target.stat().st_mode
        target.parent.mkdir(parents=True, exist_ok=True)
        part = target.with_name(f".{target.name[:40]}.{secrets.token_hex(4)}.part")
        part.touch(exist_ok=False)
    except OSError as problem:
        raise StrandspringError(f"{path} cannot be written: {problem.strerror}.") from None
    try:
        yield part
        if mode is not None:
            part.chmod(stat.S_IMODE(mode))
        part.replace(target)
    except OSError as problem:
        raise StrandspringError(f"{path} cannot be written: {problem.strerror}.") from None
    finally:
        part.unlink(missing_ok=True)


def _target(path: Path) -> Path:
    """The path of the file that is to be written: of a symbolic link, what it leads to."""
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        raise StrandspringError(f"{path} cannot be written: it is a folder or a device; give the path of a file.")
    return target


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text with \\n as line end."""
    with replacing(path) as part:
        part.write_bytes(text.encode("utf-8"))


def write_csv(path: Path, header: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a table, every number with all its digits and None as an empty cell."""
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


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
    package = Path(__file__).resolve().parent
    installed = package / "examples" / name
    return installed if installed.is_file() else package.parents[1] / "models" / name
