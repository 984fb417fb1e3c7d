"""The normalized bytes of a record file: one line end, no byte order mark, ASCII as ASCII.

Whatever the encoding, the result keeps every line of the file in its place, so that line numbers in
messages are those of an editor. Only header texts need the exact encoding; numbers read the same in all
the 8-bit ones.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass

from ..errors import RecordError
from ..findings import Finding, Outcome
from .content import FileContent

MAX_ROWS = 50_000_000
HEAD_BYTES = 64 * 1024

_BOMS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))
_BLANK = b" \t,;\n\0\x1a"
# Chinese text uses the punctuation and the first level of GB 2312 nearly always (lead bytes A1-A9, B0-D7);
# two accented small letters in a row, as in German "Größe", have lead bytes from E0 on.
_GBK = re.compile(rb"(?:[\x00-\x7f]|[\xa1-\xa9\xb0-\xd7][\xa1-\xfe])*")


@dataclass(frozen=True)
class Source:
    """Contents of a record file.

    Attributes
    ----------
    path : str        As given by the user, made printable.
    data : bytes      Text whose lines end in a line feed, without blank lines at the end.
    encoding : str    How to decode `data`.
    findings : tuple of Finding   What was changed.
    row : str         What messages call a line: "row" in a sheet.
    """

    path: str
    data: bytes
    encoding: str
    findings: tuple[Finding, ...]
    row: str = "line"

    @property
    def head(self) -> list[str]:
        """The first lines, without their ends, from which the dialect is detected."""
        head = self.data[:HEAD_BYTES]
        if len(self.data) > HEAD_BYTES and b"\n" in head:
            head = head[: head.rindex(b"\n")]
        return [line.decode(self.encoding, errors="replace") for line in head.split(b"\n")]


def text_source(content: FileContent) -> Source:
    """The normalized text of a record file.

    Raises
    ------
    RecordError   If it is empty, has too many lines or is not text.
    """
    name, raw = content.path, content.data
    data, encoding = _as_bytes_of_ascii(raw)
    findings = [Finding(Outcome.ENCODING, {"encoding": encoding})] if encoding != "utf-8" else []
    if encoding.startswith("utf-16"):
        encoding = "utf-8"  # transcoded
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    text = data.rstrip(b"\0\x1a")
    if b"\0" in data[len(text) :]:
        findings.append(Finding(Outcome.NUL_BYTES, {"count": len(data) - len(text)}))
    text = _without_blank_end(text)
    if not text:
        raise RecordError(f"{name}: the file is empty; give a file with columns of displacement and force.")
    if (nul := text.find(b"\0")) >= 0:
        line = text.count(b"\n", 0, nul) + 1
        raise RecordError(
            f"{name}, line {line}: must be text, found a NUL byte as in a binary file; export the record as CSV."
        )
    if (rows := text.count(b"\n")) > MAX_ROWS:
        raise RecordError(f"{name}: must have at most {MAX_ROWS} lines, found {rows}; thin the record out or split it.")
    return Source(name, text, encoding, tuple(findings))


def _as_bytes_of_ascii(raw: bytes) -> tuple[bytes, str]:
    """Bytes in which digits and separators are ASCII, and the encoding the file has."""
    for bom, encoding in _BOMS:
        if raw.startswith(bom):
            return _transcoded(raw[len(bom) :], encoding), encoding
    head = raw[:HEAD_BYTES]
    # Numbers in UTF-16 have a NUL in every second byte; binary files have them on both sides.
    even, odd = head[0::2].count(0), head[1::2].count(0)
    if max(even, odd) > len(head) // 5 and min(even, odd) < len(head) // 50:
        encoding = "utf-16-le" if odd > even else "utf-16-be"
        return _transcoded(raw, encoding), encoding
    return raw, _eight_bit_encoding(head)


def _transcoded(data: bytes, encoding: str) -> bytes:
    return data if encoding == "utf-8" else data.decode(encoding, errors="replace").encode()


def _eight_bit_encoding(head: bytes) -> str:
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)  # incremental: the head may cut a character
        return "utf-8"
    except UnicodeDecodeError:
        pass
    # Numbers say nothing about the encoding and would drown the few characters that do.
    lines = [line for line in head.splitlines() if not line.isascii()]
    sample = b"\n".join(lines[:200])
    if _GBK.fullmatch(sample):
        return "gb18030"
    # Western text has single characters beyond ASCII between ASCII ones ("µm", "Prüfkraft", "Größe").
    if not re.search(rb"[\x80-\xff]{3}", sample):
        return "cp1252"
    import charset_normalizer  # slow to import and rarely needed

    best = charset_normalizer.from_bytes(sample).best()
    # An encoding that is not a superset of ASCII would garble the numbers' separators.
    return best.encoding if best and b"0,;\t".decode(best.encoding, "replace") == "0,;\t" else "cp1252"


def _without_blank_end(text: bytes) -> bytes:
    """Cut off last lines that hold separators at most, as spreadsheets leave them; keep a final line end."""
    end = len(text)
    while end:
        start = text.rfind(b"\n", 0, end - 1) + 1
        if text[start:end].strip(_BLANK):
            break
        end = start
    return text[:end]
