"""Records, texts and files of all formats, read; and descriptions of campaigns.

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

from strandspring.loops.selection import Wanted, entries, read_campaign
from strandspring.records.reading import read_record
from strandspring.records.record import Record
from targets.mutator import ABSURD, FLOATS, OTHERS, TOKENS, changed, mutated, numpy_of, toml_file

_CORPUS = Path(__file__).parents[1] / "corpus"
_INTERNAL = re.compile(r"<[\w.]+ object|object at 0x|Traceback|\bdtype\(|^\(.*\)$|errno", re.IGNORECASE)
_NAMES = {
    "displacement": ("displacement", "Weg", "x", "Disp.", "位移", "Déplacement", "stroke", "Position (LVDT)"),
    "force": ("force", "Kraft", "F", "Load cell", "Prüfkraft", "力", "Carga", "F_m"),
    "time": ("time", "Zeit", "t", "时间", "elapsed time"),
    "other": ("cycle", "temperature", "remark", "", "rate", "σ", "Kanal 3"),
}
_UNITS = {
    "displacement": ("mm", "m", "cm", "in", "µm", '"'), "force": ("N", "kN", "lbf", "MN", "kgf"),
    "time": ("s", "ms", "min"), "other": ("°C", "-", "%", "V", "parsec"),
}  # fmt: skip
_COLUMNS = (0, -1, 1, 2, 3, 99, 10**30, "", "0", "1", "9" * 400, "1.5", "x/1", "/", "rig/force", "٣", "\x00")


def _sound(record: Record) -> str:
    for values in (record.displacement, record.force, record.time):
        assert values is None or (values.size >= 2 and np.isfinite(values).all() and not values.flags.writeable)
        assert values is None or values.size == len(record)
    for note in record.notes:
        assert note.isprintable(), note
        assert not _INTERNAL.search(note), note
    return "accepted"


def judge(path: Path) -> str:
    """A file of the corpus, packed or not, read."""
    return _sound(read_record(path))


def _options(dice: random.Random) -> dict[str, Any]:
    """Arguments of `read_record`, mostly none."""
    choices: dict[str, tuple[Any, ...]] = {"reverse": ("displacement", "force", "time", "")}
    choices |= dict.fromkeys(("displacement", "force", "time"), _COLUMNS)
    choices |= {f"{quantity}_unit": (*units, *TOKENS[:40]) for quantity, units in _UNITS.items() if quantity != "other"}
    choices |= dict.fromkeys(("displacement_offset", "force_offset", "displacement_scale", "force_scale"), FLOATS)
    share = dice.choice((0.0, 0.0, 0.0, 0.2))
    return {name: dice.choice(values) for name, values in choices.items() if dice.random() < share}


# ---- texts -----------------------------------------------------------------------------------------------------------


def table(dice: random.Random) -> tuple[str, list[np.ndarray]]:
    """A table as text, in one of the forms that programs write, and its columns."""
    size = dice.choice((2, 3, 5, 9, 20, 40, 161, 400))
    phase = np.linspace(0.0, dice.choice((1.0, 4.0, 12.0)) * np.pi, size)
    quantities = ["displacement", "force", *dice.choice(([], ["time"], ["time", "other"], ["other", "time", "other"]))]
    dice.shuffle(quantities)
    values = {
        "displacement": 12.5 * np.sin(phase) + 57.0, "force": 0.35 * np.sin(phase) + 0.05 * np.sign(np.cos(phase)),
        "time": 0.01 * np.arange(size), "other": np.round(20.0 + numpy_of(dice).normal(size=size), 2),
    }  # fmt: skip
    separator, decimal_mark = dice.choice(
        (("\t", "."), (";", "."), (",", "."), (" ", "."), (";", ","), ("\t", ","), ("|", "."))
    )
    quote, tail = dice.choice(("", "", "", '"')), dice.choice(("", "", "", separator))
    named = [(dice.choice(_NAMES[q]), dice.choice(_UNITS[q][: dice.choice((1, 9))])) for q in quantities]
    form = dice.choice(
        ("{0}", "{0} [{1}]", "{0} ({1})", "{0}/{1}", "{0}_{1}", "{0} in {1}", '"{0} [{1}]"', "{0}（{1}）")
    )
    head = dice.choice(([], [], [], ["Test of a spring"], ["# rig 7", ""], ["Date" + separator + "2024-01-01", "---"]))
    lines = [*head, dice.choice(("", "", "#")) + separator.join(form.format(*each) for each in named)]
    lines += [separator.join(f"[{unit}]" for _, unit in named)] if dice.random() < 0.2 else []
    for row in np.column_stack([values[q] for q in quantities]).tolist():
        lines.append(separator.join(f"{quote}{cell!r}{quote}".replace(".", decimal_mark) for cell in row) + tail)
    end = dice.choice(("\n", "\n", "\r\n", "\r"))
    return end.join(lines) + dice.choice((end, end, "", 3 * end)), [values[q] for q in quantities]


def text(dice: random.Random, folder: Path) -> str:
    """One text."""
    path = folder / "record.csv"
    content, columns = table(dice)
    data = content.encode()
    if dice.random() < 0.1:
        data = dice.choice(_files("records_text"))
    if is_changed := dice.random() < 0.7:
        data = mutated(dice, data)
    path.write_bytes(data)
    given = _options(dice)
    record = read_record(path, **given)
    _sound(record)
    if is_changed or given or data != content.encode():
        return "accepted"
    for values in (record.displacement, record.force):
        mismatch = min(_mismatch(values, each) for each in columns)
        assert mismatch <= 1e-5, f"no column has these numbers: {values[:5]}"
    return "accepted, as it was made"


def _mismatch(values: np.ndarray, column: np.ndarray) -> float:
    """Largest difference of two columns, whatever their units, share of the largest number."""
    scale = np.dot(values, column) / np.dot(column, column) if values.size == column.size else 0.0
    return float(np.abs(values - scale * column).max() / np.abs(values).max()) if scale else np.inf


# ---- files of all formats --------------------------------------------------------------------------------------------


@cache
def _files(folder: str) -> list[bytes]:
    """The files of the corpus, sound ones and past findings."""
    found = []
    for path in sorted((_CORPUS / folder).iterdir()):
        found.append(gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes())
    return found


def _zipped(dice: random.Random, data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", dice.choice((0, 8, 8, 12, 14))) as archive:
        archive.writestr(dice.choice(("lot/record.csv", "a", "../../etc/x", "C:\\x", "é\u202e.csv", "x" * 300)), data)
        for other in dice.choice(((), (), ("__MACOSX/._record.csv",), ("b.csv",))):
            archive.writestr(other, data)
    return stream.getvalue()


def binary(dice: random.Random, folder: Path) -> str:
    """One file of any format, or a text packed."""
    path = folder / "record.dat"
    data = dice.choice(_files("records_binary"))
    if dice.random() < 0.8:
        made = mutated(dice, data)
        # Without its mark, the file would be taken for a text.
        data = made if dice.random() < 0.1 or data.startswith(b"PK") else data[:8] + made[8:]
    if dice.random() < 0.1:
        data = table(dice)[0].encode() if dice.random() < 0.5 else data
        for _ in range(dice.choice((1, 1, 2, 3))):
            layer = dice.choice((gzip.compress, bz2.compress, lzma.compress, lambda data: _zipped(dice, data)))
            data = layer(data)
            data = mutated(dice, data) if dice.random() < 0.2 else data
    path.write_bytes(data)
    return _sound(read_record(path, **_options(dice)))


# ---- descriptions of campaigns ---------------------------------------------------------------------------------------

_VALUES = (*OTHERS, *ABSURD["of campaigns"], "a" * 300)
_TIME = np.linspace(0.0, 10.0, 2001)
_X, _F = 10.0 * np.sin(2.0 * np.pi * _TIME), 100.0 * np.sin(2.0 * np.pi * _TIME + 0.1)  # [mm], [N]


def descriptions(dice: random.Random, folder: Path) -> str:
    """One description of a campaign, or what options select of a record."""
    for name, sign in (("a.csv", 1.0), ("b.csv", 2.0)):
        rows = "\n".join(f"{t:.4f},{x:.5f},{sign * f:.5f}" for t, x, f in zip(_TIME, _X, _F, strict=True))
        (folder / name).write_text(f"t,x,F\n{rows}\n")
    (folder / "folder").mkdir()
    keys: dict[str, Any] = {
        "cycles": dice.choice(("2:4", "1:", 2)), "time_window": "1:9", "displacement_range": "-5:5", "label": "lot A",
        "reverse": "force", "displacement_offset": 1.0, "force_scale": 2.0, "displacement": dice.choice((2, "x")),
        "force": dice.choice((3, "F")), "force_unit": "N", "displacement_unit": "mm",
    }  # fmt: skip
    part = {name: keys[name] for name in dice.sample(sorted(keys), 3)}
    if dice.random() < 0.3:
        changed(dice, part, _VALUES)
        try:
            wanted = Wanted(**part)
        except TypeError:  # an unknown name, or not a number where arithmetic needs one
            return "accepted, no selection"
        return _sound(wanted.read(folder / "a.csv"))
    files = [{"file": dice.choice(("a.csv", "b.csv", "*.csv")), **part} for _ in range(dice.choice((1, 2, 2, 50)))]
    content = {**dict(list(keys.items())[: dice.randrange(3)]), "record": files}
    for _ in range(dice.choice((0, 1, 1, 2))):
        changed(dice, content, _VALUES)
    (folder / "d.toml").write_bytes(toml_file(dice, content))
    record, *_ = read_campaign(folder / "d.toml")
    assert len(entries([folder / "d.toml"])) >= 1
    return _sound(record)
