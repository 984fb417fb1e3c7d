"""Records, texts and files of all formats, read.

Texts are tables in the forms that programs write, and files those of the corpus, a sound one of each format at least;
most are then changed. A table that was not changed must give the numbers that it was made of, or be refused.
"""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import random
import re
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from strandspring.loops.reading import read_record
from strandspring.records.record import Record
from targets.mutator import ABSURD, CORPUS, FLOATS, mutated

_OF: dict[str, Any] = ABSURD["records"]  # names, units and columns


def sound(record: Record) -> str:
    for values in (record.displacement, record.force, record.time):
        assert values is None or (values.size >= 2 and np.isfinite(values).all() and not values.flags.writeable)
        assert values is None or values.size == len(record)
    for note in record.notes:
        assert note.isprintable(), note
        assert not re.search(r"(?i)<[\w.]+ object|object at 0x|Traceback|\bdtype\(|^\(.*\)$|errno", note), note
    return "accepted"


def judge(path: Path) -> str:
    """A file of the corpus, packed or not, read."""
    return sound(read_record(path))


def _options(dice: random.Random) -> dict[str, Any]:
    """Arguments of `read_record`, mostly none."""
    choices: dict[str, Any] = {"reverse": ("displacement", "force", "time", "")}
    for quantity in ("displacement", "force", "time"):
        choices |= {quantity: _OF["columns"], f"{quantity}_unit": (*_OF["units"][quantity], *ABSURD["tokens"][:40])}
    choices |= dict.fromkeys(("displacement_offset", "force_offset", "displacement_scale", "force_scale"), FLOATS)
    share = dice.choice((0.0, 0.0, 0.0, 0.2))
    return {name: dice.choice(values) for name, values in choices.items() if dice.random() < share}


def _table(dice: random.Random) -> tuple[str, list[np.ndarray]]:
    """A table as text, in one of the forms that programs write, and its columns."""
    size = dice.choice((2, 3, 5, 9, 20, 40, 161, 400))
    phase = np.linspace(0.0, dice.choice((1.0, 4.0, 12.0)) * np.pi, size)
    quantities = ["displacement", "force", *dice.choice(([], ["time"], ["time", "other"], ["other", "time", "other"]))]
    dice.shuffle(quantities)
    made = {
        "displacement": 12.5 * np.sin(phase) + 57.0, "force": 0.35 * np.sin(phase) + 0.05 * np.sign(np.cos(phase)),
        "time": 0.01 * np.arange(size), "other": np.array([round(dice.gauss(20.0, 1.0), 2) for _ in phase]),
    }  # fmt: skip
    columns = [made[quantity] for quantity in quantities]
    separator, decimal_mark = dice.choice(_OF["separators"])
    quote, tail = dice.choice(("", "", "", '"')), dice.choice(("", "", "", separator))
    named = [(dice.choice(_OF["names"][q]), dice.choice(_OF["units"][q][: dice.choice((1, 9))])) for q in quantities]
    form = dice.choice(_OF["forms"])
    header = separator.join(form.format(*one) for one in named)
    lines = [*dice.choice(_OF["heads"]), dice.choice(("", "", "#")) + header]
    lines += [separator.join(f"[{unit}]" for _, unit in named)] if dice.random() < 0.2 else []
    for row in np.column_stack(columns).tolist():
        lines.append(separator.join(f"{quote}{cell!r}{quote}".replace(".", decimal_mark) for cell in row) + tail)
    end = dice.choice(("\n", "\n", "\r\n", "\r"))
    return end.join(lines) + dice.choice((end, end, "", 3 * end)), columns


def text(dice: random.Random, folder: Path) -> str:
    """One text."""
    content, columns = _table(dice)
    data = content.encode()
    if dice.random() < 0.1:
        data = dice.choice(_files("records_text"))
    if is_changed := dice.random() < 0.7:
        data = mutated(dice, data)
    (folder / "record.csv").write_bytes(data)
    given = _options(dice)
    record = read_record(folder / "record.csv", **given)
    sound(record)
    if is_changed or given or data != content.encode():
        return "accepted"
    for values in (record.displacement, record.force):
        # Whatever their units, as a share of the largest number.
        same = [(column, np.dot(values, column) / np.dot(column, column)) for column in columns if column.any()]
        off = [np.abs(values - scale * column).max() for column, scale in same if scale and values.size == column.size]
        assert min(off) <= 1e-5 * np.abs(values).max(), f"no column has these numbers: {values[:5]}"
    return "accepted, as it was made"


@cache
def _files(folder: str) -> list[bytes]:
    """The files of the corpus, sound ones and past findings."""
    files = [(path.suffix, path.read_bytes()) for path in sorted((CORPUS / folder).iterdir())]
    return [gzip.decompress(data) if suffix == ".gz" else data for suffix, data in files]


def _zipped(dice: random.Random, data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", dice.choice((0, 8, 8, 12, 14))) as archive:
        others = dice.choice(((), ("__MACOSX/._record.csv",), ("b.csv", "lot/a.csv")))
        for name in {dice.choice(ABSURD["names"]), *others}:
            archive.writestr(name, data)
    return stream.getvalue()


def binary(dice: random.Random, folder: Path) -> str:
    """One file of any format, or a text packed."""
    data = dice.choice(_files("records_binary"))
    if dice.random() < 0.8:
        made = mutated(dice, data)
        # Without its mark, the file would be taken for a text.
        data = made if dice.random() < 0.1 or data.startswith(b"PK") else data[:8] + made[8:]
    if dice.random() < 0.1:
        data = _table(dice)[0].encode() if dice.random() < 0.5 else data
        for _ in range(dice.choice((1, 1, 2, 3))):
            data = dice.choice((gzip.compress, bz2.compress, lzma.compress, lambda data: _zipped(dice, data)))(data)
            data = mutated(dice, data) if dice.random() < 0.2 else data
    (folder / "record.dat").write_bytes(data)
    return sound(read_record(folder / "record.dat", **_options(dice)))
