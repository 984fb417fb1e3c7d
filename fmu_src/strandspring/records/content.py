"""The bytes of a record file, bounded in size; what is compressed or in a zip archive is unpacked."""

from __future__ import annotations

import bz2
import gzip
import hashlib
import io
import lzma
import os
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.files import read_bytes, readable
from ..ground.quoting import quoted

MAX_BYTES = 2 * 1024**3
MAX_UNPACKED_BYTES = 512 * 1024**2  # a few compressed kilobytes may unpack to any size
_MAX_LAYERS = 2  # a compressed file in an archive
_LISTED = 12
_BLOCK = 1024 * 1024
ZIP = b"PK\x03\x04"
# Names in an archive that show that it is a format of its own.
_OF_FORMATS = ("[Content_Types].xml", "mimetype")


@dataclass(frozen=True)
class FileContent:
    """What a record file holds.

    Attributes
    ----------
    path : str        As given by the user, made printable.
    data : bytes      Unpacked.
    sha256 : str      Digest of the file as it is on disk (hexadecimal).
    findings : tuple of Finding   What was unpacked.
    """

    path: str
    data: bytes
    sha256: str
    findings: tuple[Finding, ...] = ()


def read_content(path: str | os.PathLike[str]) -> FileContent:
    """Read a file, and unpack it if it is compressed (gzip, bzip2, xz) or a zip archive of records.

    Of an archive with several files one is named as if the archive were a folder: "campaign.zip/a13.csv".

    Raises
    ------
    RecordError   If the file cannot be read, is too large, or is an archive of several files none of which is named.
    """
    file, member = _member_of_archive(Path(path))
    name = readable(path)
    raw = read_bytes(path if member is None else file, MAX_BYTES, "a record file", RecordError)
    content = FileContent(name, raw, hashlib.sha256(raw).hexdigest())
    for _ in range(_MAX_LAYERS):
        unpacked = _unpacked(content, member)
        if unpacked is None:
            break
        content, member = unpacked, None
    else:
        if _unpacked(content, None) is not None:
            raise RecordError(f"{name}: is compressed more than {_MAX_LAYERS} times; unpack it first.")
    if member is not None:
        raise RecordError(f"{name}: {readable(file.name)} is a file, but not a zip archive; check the path.")
    return content


def bounded(stream: IO[bytes], where: str) -> bytes:
    """All bytes of a stream that unpacks something.

    Raises
    ------
    RecordError   If they are too many.
    """
    data = stream.read(MAX_UNPACKED_BYTES + 1)
    if len(data) > MAX_UNPACKED_BYTES:
        raise too_large(where)
    return data


def too_large(where: str) -> RecordError:
    """The refusal of what unpacks to too much."""
    return RecordError(
        f"{where}: must unpack to at most {MAX_UNPACKED_BYTES} bytes, and holds more; thin the record out or split it."
    )


def check_members(archive: zipfile.ZipFile, where: str) -> None:
    """Refuse an archive that is damaged or unpacks to too much, whatever sizes it declares."""
    left = MAX_UNPACKED_BYTES
    for info in archive.infolist():
        with archive.open(info) as stream:
            while block := stream.read(_BLOCK):
                left -= len(block)
                if left < 0:
                    raise too_large(where)


def _member_of_archive(path: Path) -> tuple[Path, str | None]:
    """The file on disk and, where the path goes on as if that were a folder, the name of what is in it."""
    try:
        for parent in path.parents:
            if parent.is_file():
                return parent, path.relative_to(parent).as_posix()
            if parent.exists():
                break
    except (OSError, ValueError):
        pass  # reading says what is wrong
    return path, None


def _unpacked(content: FileContent, member: str | None) -> FileContent | None:
    for magic, (kind, opened) in _COMPRESSED.items():
        if content.data.startswith(magic):
            return _decompressed(content, kind, opened)
    return _from_zip(content, member) if content.data.startswith(ZIP) else None


_COMPRESSED: Mapping[bytes, tuple[str, Callable[[IO[bytes]], Any]]] = {
    b"\x1f\x8b": ("gzip", gzip.open),
    b"BZh": ("bzip2", bz2.open),
    b"\xfd7zXZ\0": ("xz", lzma.open),
}


def _decompressed(content: FileContent, kind: str, opened: Callable[[IO[bytes]], Any]) -> FileContent | None:
    try:
        with opened(io.BytesIO(content.data)) as stream:
            data = bounded(stream, content.path)
    except RecordError:
        raise
    except (OSError, EOFError, ValueError, zlib.error, lzma.LZMAError):
        if content.data[:_BLOCK].isascii():
            return None  # text that begins with "BZh"
        raise RecordError(
            f"{content.path}: is a {kind} file that is damaged or cut off; compress or copy it again."
        ) from None
    return replace(content, data=data, findings=(*content.findings, Finding(Outcome.UNPACKED, {"archive": kind})))


def _from_zip(content: FileContent, member: str | None) -> FileContent | None:
    where = content.path
    try:
        with zipfile.ZipFile(io.BytesIO(content.data)) as archive:
            names = [name for name in archive.namelist() if not name.endswith("/")]
            if any(name in _OF_FORMATS for name in names) or (names and all(n.endswith(".npy") for n in names)):
                return None
            records = [name for name in names if not name.startswith("__MACOSX/") and Path(name).name[:1] != "."]
            chosen = _chosen(records, member, where)
            if archive.getinfo(chosen).flag_bits & 1:
                raise RecordError(f"{where}: {quoted(chosen)} is encrypted in the zip archive; unpack it first.")
            with archive.open(chosen) as stream:
                data = bounded(stream, where)
    except RecordError:
        raise
    # zipfile raises various errors for damaged archives, struct.error among them.
    except Exception:
        raise RecordError(
            f"{where}: is a zip archive (as .xlsx, .ods and .npz files are) that is damaged or cut off; copy or export "
            "it again."
        ) from None
    unpacked = Finding(Outcome.UNPACKED, {"archive": "the zip archive", "member": quoted(chosen)})
    return replace(content, data=data, findings=(*content.findings, unpacked))


def _chosen(records: list[str], member: str | None, where: str) -> str:
    listed = ", ".join(map(quoted, records[:_LISTED]))
    listed += f" and {len(records) - _LISTED} more" if len(records) > _LISTED else ""
    if not records:
        raise RecordError(f"{where}: is a zip archive without any file; give one with a record.")
    if member is not None:
        if member not in records:
            raise RecordError(f"{where}: {quoted(member)} is not in the zip archive, which holds {listed}.")
        return member
    if len(records) > 1:
        raise RecordError(
            f"{where}: is a zip archive of {len(records)} files ({listed}); name one of them as in "
            f"{readable(Path(where).name)}/{readable(records[0])}."
        )
    return records[0]
