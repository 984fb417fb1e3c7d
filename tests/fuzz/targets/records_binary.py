"""Random binary records: python tests/fuzz/targets/records_binary.py [--seed SEED] [--count COUNT] [--keep FOLDER]

Most files are then changed in a few places; those that are packed
(workbooks, .npz, compressed files) mostly inside, so that what reads the content is reached.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness import main
from pieces.records_files import FORMATS, LAYERS
from pieces.records_judge import judged
from pieces.records_pieces import (
    ABSURD_CELLS,
    ABSURD_INTEGERS,
    Piece,
    chance,
    columns,
    mutated,
    one_of,
    options,
    size_of_table,
)
from strandspring.records.reading import read_record

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


def trial(random: np.random.Generator, folder: Path) -> Iterator[str]:
    """One file."""
    name = one_of(random, list(FORMATS))
    yield name
    path = folder / "record.dat"
    pieces, sound = _made(name, int(random.integers(_VARIANTS)))
    data = sound
    if chance(random, 0.7):
        data = _changed(random, data)
        # Without its mark, the file would be taken for a text.
        data = data if chance(random, 0.1) else sound[: _MARKS.get(name, 8)] + data[_MARKS.get(name, 8) :]
    if name == "csv" or chance(random, 0.05):
        for _ in range(int(one_of(random, (1, 1, 1, 2, 3)))):
            data = one_of(random, LAYERS)(random, data)
            data = mutated(random, data, 1) if chance(random, 0.2) else data
    path.write_bytes(data)
    given = options(random, pieces)
    yield judged(lambda: read_record(path, **given), path, is_limited=name != "csv")[0]


@cache
def _made(name: str, variant: int) -> tuple[list[Piece], bytes]:
    """A sound file of a format, and its columns; libraries are slower in writing than in reading."""
    random = np.random.default_rng(variant)
    pieces = columns(random, size_of_table(random))
    with TemporaryDirectory() as folder:
        FORMATS[name](random, Path(folder) / name, pieces)
        return pieces, (Path(folder) / name).read_bytes()


def _changed(random: np.random.Generator, data: bytes) -> bytes:
    """A file changed in a few places; of a zip archive mostly in its members."""
    if not data.startswith(_ZIP) or chance(random, 0.2):
        return mutated(random, data)
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        changed = one_of(
            random, [name for name in names if "sheet1" in name or "content" in name or ".npy" in name] or names
        )
        changed = one_of(random, names) if chance(random, 0.2) else changed
        for member in names:
            content = old.read(member)
            if member == changed:
                content = _changed_xml(random, content) if b"<" in content[:9] else mutated(random, content)
                if chance(random, 0.05):
                    continue
            new.writestr(member, content)
    return stream.getvalue()


def _changed_xml(random: np.random.Generator, content: bytes) -> bytes:
    """XML with values replaced by absurd ones, pieces put in, or bytes changed."""
    for _ in range(int(random.integers(1, 5))):
        values = list(_XML_VALUE.finditer(content))
        if not values or chance(random, 0.2):
            content = mutated(random, content, 1)
            continue
        match = one_of(random, values)
        begin, end = match.span()
        absurd = one_of(random, (*ABSURD_CELLS, *map(str, ABSURD_INTEGERS))).encode("utf-8", "replace")
        match int(random.integers(4)):
            case 0 | 1:
                content = content[:begin] + absurd + content[end:]
            case 2:
                content = content[:end] + one_of(random, _XML_PIECES) + content[end:]
            case _:
                other = one_of(random, values)
                content = content[:begin] + other.group() * int(one_of(random, (0, 1, 100))) + content[end:]
    return content


if __name__ == "__main__":
    main(__file__, trial, 8000)
