"""Random records, texts and binary files, read.

Texts are put together from pieces (separator, decimal mark, header, units, preamble, encoding, line ends) and then
changed in a few places. One that was not changed must give the numbers that it was made of, or be refused. Most binary
files are changed, too; those that are packed mostly inside, so that what reads the content is reached.
"""

from __future__ import annotations

import io
import random
import re
import zipfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from strandspring.errors import RecordError
from strandspring.records.reading import read_record
from strandspring.records.record import Record
from targets.made import ABSURD_INTEGERS, chance, damaged
from targets.made_records import ABSURD_CELLS, ENCODINGS, Piece, changed_text, columns, options, size_of_table, text_of
from targets.record_formats import FORMATS, LAYERS

_LONGEST = 2500  # characters of a message; tables with all their columns are listed
_INTERNAL = re.compile(r"<[\w.]+ object|object at 0x|Traceback|\bdtype\(|^\(.*\)$|errno", re.IGNORECASE)
_QUOTED = re.compile(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"")


_VARIANTS = 150  # sound files of each format
_MARKS = {"mat": 20, "mat_4": 0, "mat_73": 20, "csv": 0}  # length of the mark by which the format is known
_ZIP = b"PK\x03\x04"
_XML_VALUE = re.compile(rb'(?<=[">])[^"<>]*(?=["<])')
_XML_PIECES = (
    b"<!DOCTYPE a [<!ENTITY b 'cccccccccc'>]>", b"&b;", b"&#0;", b"<c", b"</row>", b"<row r='1048576'>",
    b"<c r='XFD1048576'><v>1</v></c>",
    b"<table:table-row table:number-rows-repeated='1048576'>", b"\xff\xfe", b"]]>", b"<![CDATA[", b"<!--",
    b"<f>1/0</f>", b"<is><t>x</t></is>",
)  # fmt: skip


def judged(read: Callable[[], Record], path: Path | str = "", is_limited: bool = False) -> tuple[str, Record | None]:
    """The outcome of reading, in few words, and the record.

    Parameters
    ----------
    read : callable
    path : path-like    Which a refusal must name, if it is of the file.
    is_limited : bool   Whether it is read by a process that limits its memory itself.

    Raises
    ------
    AssertionError   If the record is unsound, or the refusal no sentence with place and advice.
    """
    try:
        record = read()
    except RecordError as problem:
        message = str(problem)
        assert message.startswith((str(path), "`")), message
        assert message.isprintable(), message
        assert message.endswith((".", "?")), message
        assert ";" in message or "?" in message or re.search("must|should", message), f"no advice: {message}"
        assert len(message) <= _LONGEST, f"{len(message)} characters: {message[:300]}"
        assert not _INTERNAL.search(message), message
        assert "more data than fits into memory" not in message or is_limited, message
        return f"refused: {_kind(message.removeprefix(str(path)))}", None
    for values in (record.displacement, record.force, record.time):
        assert values is None or (values.size >= 2 and np.isfinite(values).all() and not values.flags.writeable)
        assert values is None or values.size == len(record)
    for note in record.notes:
        assert note.isprintable(), note
        assert not _INTERNAL.search(note), note
    return "accepted", record


def _kind(message: str) -> str:
    """A message without what differs from file to file."""
    text = re.sub(r"[-+]?[0-9][0-9.e+]*", "0", _QUOTED.sub("0", message))
    text = re.sub(r"^[:, ]*(?:(?:line|row) 0)?[:, ]*(?:column (?:0 ?)+)?[:, ]*", "", text)
    return re.split(r"[(;,]", text)[0][:60].strip()


# ---- texts -----------------------------------------------------------------------------------------------------------


def text(dice: random.Random, folder: Path) -> Iterator[str]:
    """One text."""
    yield "text"
    path = folder / "record.csv"
    pieces = columns(dice, size_of_table(dice))
    content, is_plain = text_of(dice, pieces)
    encoding = dice.choice(ENCODINGS) if chance(dice, 0.25) else "utf-8"
    errors = "surrogatepass" if encoding.startswith("utf") and encoding != "utf-7" else "replace"
    data = content.encode(encoding, errors)
    if is_changed := chance(dice, 0.3):
        data = changed_text(dice, data)
    path.write_bytes(data)
    given = options(dice, pieces)
    outcome, record = judged(lambda: read_record(path, **given), path)
    if record is not None and is_plain and not is_changed and not given:
        _check(record, pieces)
        outcome = "accepted, as it was made"
    yield outcome


def _check(record: Record, pieces: list[Piece]) -> None:
    """The record must be made of columns of the table: any that is named so, since names may be absurd."""
    series = [piece.values for piece in pieces]
    for values in (record.displacement, record.force):
        smallest = min(_mismatch(values, each) for each in series)
        assert smallest <= 1e-5, f"no column has these numbers: {values[:5]}"


def _mismatch(values: np.ndarray, series: np.ndarray) -> float:
    """Largest difference of two series, whatever their units, share of the largest number."""
    with np.errstate(all="ignore"):
        if values.size != series.size or not np.isfinite(series).all():
            return np.inf
        scale = np.dot(values, series / np.abs(series).max()) / np.dot(series, series / np.abs(series).max())
        mismatch = float(np.abs(values - scale * series).max() / np.abs(values).max())
        return mismatch if np.isfinite(mismatch) else np.inf


def judge(path: Path) -> Iterator[str]:
    """A file of the corpus, read."""
    yield f"corpus, {path.name}"
    yield judged(lambda: read_record(path), path)[0]


# ---- binary files ----------------------------------------------------------------------------------------------------


def binary(dice: random.Random, folder: Path) -> Iterator[str]:
    """One file."""
    name = dice.choice(list(FORMATS))
    yield name
    path = folder / "record.dat"
    pieces, sound = _made(name, dice.randrange(_VARIANTS))
    data = sound
    if chance(dice, 0.7):
        data = _changed(dice, data)
        # Without its mark, the file would be taken for a text.
        data = data if chance(dice, 0.1) else sound[: _MARKS.get(name, 8)] + data[_MARKS.get(name, 8) :]
    if name == "csv" or chance(dice, 0.05):
        for _ in range(dice.choice((1, 1, 1, 2, 3))):
            data = dice.choice(LAYERS)(dice, data)
            data = damaged(dice, data, 1) if chance(dice, 0.2) else data
    path.write_bytes(data)
    given = options(dice, pieces)
    yield judged(lambda: read_record(path, **given), path, is_limited=name != "csv")[0]


@cache
def _made(name: str, variant: int) -> tuple[list[Piece], bytes]:
    """A sound file of a format, and its columns; libraries are slower in writing than in reading."""
    dice = random.Random(variant)
    pieces = columns(dice, size_of_table(dice))
    with TemporaryDirectory() as folder:
        FORMATS[name](dice, Path(folder) / name, pieces)
        return pieces, (Path(folder) / name).read_bytes()


def _changed(dice: random.Random, data: bytes) -> bytes:
    """A file changed in a few places; of a zip archive mostly in its members."""
    if not data.startswith(_ZIP) or chance(dice, 0.2):
        return damaged(dice, data)
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        held = [name for name in names if "sheet1" in name or "content" in name or ".npy" in name]
        changed = dice.choice(held or names)
        changed = dice.choice(names) if chance(dice, 0.2) else changed
        for member in names:
            content = old.read(member)
            if member == changed:
                content = _changed_xml(dice, content) if b"<" in content[:9] else damaged(dice, content)
                if chance(dice, 0.05):
                    continue
            new.writestr(member, content)
    return stream.getvalue()


def _changed_xml(dice: random.Random, content: bytes) -> bytes:
    """XML with values replaced by absurd ones, pieces put in, or bytes changed."""
    for _ in range(dice.randrange(1, 5)):
        values = list(_XML_VALUE.finditer(content))
        if not values or chance(dice, 0.2):
            content = damaged(dice, content, 1)
            continue
        match = dice.choice(values)
        begin, end = match.span()
        absurd = dice.choice((*ABSURD_CELLS, *map(str, ABSURD_INTEGERS))).encode("utf-8", "replace")
        match dice.randrange(4):
            case 0 | 1:
                content = content[:begin] + absurd + content[end:]
            case 2:
                content = content[:end] + dice.choice(_XML_PIECES) + content[end:]
            case _:
                other = dice.choice(values)
                content = content[:begin] + other.group() * dice.choice((0, 1, 100)) + content[end:]
    return content
