"""Lines of JSON with a checksum each: ["checksum", content]."""

from __future__ import annotations

import json
import zlib
from typing import Any

_CHECKSUM = slice(2, 10)
_CONTENT = slice(13, -1)

_encoded = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode


class CheckedLines:
    """Lines of one job: their checksums continue that of its manifest, so that no line of another job fits.

    Parameters
    ----------
    manifest : bytes   The first line of the file, which has no checksum.
    """

    def __init__(self, manifest: bytes) -> None:
        self._job = zlib.crc32(manifest)

    def line(self, content: Any) -> bytes:
        """The line of a content, which JSON must be able to represent."""
        encoded = _encoded(content).encode(errors="replace")  # names of files need not be text
        return b'["%08x", %s]\n' % (zlib.crc32(encoded, self._job), encoded)

    def content(self, line: bytes) -> bytes | None:
        """The JSON in a line; None if the line is damaged or incomplete."""
        content = line.rstrip(b"\n")[_CONTENT]
        is_whole = line.endswith(b"]\n") and line[_CHECKSUM] == b"%08x" % zlib.crc32(content, self._job)
        return content if is_whole else None


def json_line(content: Any) -> bytes:
    """A line of JSON without a checksum."""
    return f"{_encoded(content)}\n".encode()
