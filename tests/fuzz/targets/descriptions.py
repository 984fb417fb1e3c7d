"""Random descriptions: files (TOML) of campaigns, what options select of a record, and arrays given in Python."""

from __future__ import annotations

import decimal
import json
import random
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from strandspring.loops.selection import Wanted, entries, read_campaign
from strandspring.records.given import given_records
from strandspring.records.record import Record
from targets.made import ABSURD_NUMBERS, as_toml, chance, damaged, numpy_of
from targets.made_records import ABSURD_COLUMNS, ABSURD_NAMES, ABSURD_UNITS
from targets.records import judged

_TIME = np.linspace(0.0, 10.0, 2001)
_X = 10.0 * np.sin(2.0 * np.pi * _TIME)  # [mm]
_F = 100.0 * np.sin(2.0 * np.pi * _TIME + 0.1)  # [N]
_COUNTS = (
    "0", "1", "2", "3", "9", "10", "99", "999999999", "9999999999", "-1", "", " ", "1.5", "1e3", "x", "٣", "+2", "0x2",
    "\0", "inf",
)  # fmt: skip
_ENDS = (
    "0", "1", "-5", "5", "2.5", "1e3", "1e308", "-1e308", "1e999", "1e-999", "inf", "nan", "", " ", "x", "1:2", "٣",
    ".", "1e", "-", "9" * 400, "1_0", "0x1", "1,5", "5 mm",
)  # fmt: skip
_SPANS = ("{}:{}", "{}:{}", "{}:", ":{}", "{}", "{}-{}", ":", "::", " {} : {} ", "{}:{}:{}", "[{},{}]")
_FILES = (
    "a.csv", "b.csv", "*.csv", "[ab].csv", "none.csv", "*", "**", "**/*", "../x/a.csv", "../*.csv", "/etc/*",
    "/dev/null", "/dev/zero", "~", "~/a.csv", "~no-such-user/a", "", " ",
    "a\0b", "a" * 300, "folder", "d.toml", "[", "[]", "?", "a.csv/b", "***", "**a", "\ud800", ".", "..", "a.csv ",
    "//", "pipe",
)  # fmt: skip
_LINES = (
    "x = 1", "= 1", "a.b.c = 1", "x = " + "[" * 3000, "[a]\n[a]", "x = 2024-01-01", "x = 'a", "#", "\ufeff", "x = 0x_1",
    '"" = 1', "[record]", "[[records]]", "[[record", "[[record.x]]", "record = 3",
)  # fmt: skip
_KEYS = tuple(field.name for field in fields(Wanted))


def trial(dice: random.Random, folder: Path) -> Iterator[str]:
    """One description, selection or set of arrays."""
    what = dice.choice((_description, _selection, _arrays))
    yield what.__name__.removeprefix("_")
    for name, sign in (("a.csv", 1.0), ("b.csv", 2.0)):
        rows = "\n".join(f"{t:.4f},{x:.5f},{sign * f:.5f}" for t, x, f in zip(_TIME, _X, _F, strict=True))
        (folder / name).write_text(f"t,x,F\n{rows}\n")
    (folder / "folder").mkdir()
    yield what(dice, folder)


def _span(dice: random.Random, numbers: tuple[str, ...]) -> str:
    sound = numbers[:6] if chance(dice, 0.6) else numbers
    return dice.choice(_SPANS).format(*(dice.choice(sound) for _ in range(3)))


def _value(dice: random.Random, key: str) -> Any:
    """A value of a key of a description, mostly of the right type."""
    is_sound = chance(dice, 0.8)
    if not is_sound and chance(dice, 0.4):
        return dice.choice((1, -1, 0, 2**70, 1.5, 1e308, True, "", "x", [], [1], {}, {"a": 1}, "\0", "nan"))
    if key == "cycles":
        return dice.choice((_span(dice, _COUNTS), dice.randrange(-1, 12)))
    if key in ("time_window", "displacement_range"):
        return _span(dice, _ENDS)
    if key.endswith(("_offset", "_scale")):
        return dice.choice((1.0, 2.0) if is_sound else ABSURD_NUMBERS)
    sound, absurd = {
        "reverse": (("displacement", "force"), ("time", "")), "label": (("lot A",), ABSURD_NAMES),
        "displacement": ((2, "x"), ABSURD_COLUMNS), "force": ((3, "F"), ABSURD_COLUMNS),
        "time": ((1, "t"), ABSURD_COLUMNS),
    }.get(key, (("mm",), ABSURD_UNITS) if key.endswith("_unit") else ((1,), ABSURD_COLUMNS))  # fmt: skip
    return dice.choice(sound if is_sound else absurd)


def _lines(dice: random.Random) -> list[str]:
    keys = dict.fromkeys(dice.choice(_KEYS) for _ in range(dice.randrange(3)))
    return [
        f"{json.dumps(dice.choice(('speed', 'file', 'é', 'Force'))) if chance(dice, 0.03) else key} = "
        f"{as_toml(_value(dice, key))}"
        for key in keys
    ]


def _description(dice: random.Random, folder: Path) -> str:
    lines = _lines(dice)
    for _ in range(dice.choice((0, 1, 1, 2, 2, 50))):
        lines.append("[[record]]")
        lines.append(f"file = {as_toml(dice.choice(_FILES[:4] if chance(dice, 0.9) else _FILES))}")
        lines += _lines(dice)
    if chance(dice, 0.1):
        lines.insert(dice.randrange(len(lines) + 1), dice.choice(_LINES))
    data = "\n".join(lines).encode("utf-8", "surrogatepass")
    data = damaged(dice, data) if chance(dice, 0.2) else data
    path = folder / "d.toml"
    path.write_bytes(data)

    def read() -> Record:
        (record, *_) = read_campaign(path)
        assert len(entries([path])) >= 1
        return record

    # A refusal names the description, or the record of it that is not one, which may be elsewhere.
    return judged(read, "" if re.search(rb'"[/~]', data) else folder)[0]


def _selection(dice: random.Random, folder: Path) -> str:
    keys = [key for key in _KEYS if key.startswith(("cycles", "time_w", "displacement_", "reverse"))]
    given = {key: _value(dice, key) for key in keys if chance(dice, 0.3)}
    return judged(lambda: Wanted(**given).read(folder / "a.csv"), "")[0]


def _arrays(dice: random.Random, _: Path) -> str:
    size = dice.choice((1, 2, 3, 200))
    made = [_array(dice, values) for values in (1e-3 * _X[:size], _F[:size], _TIME[:size])][: dice.choice((2, 2, 3))]
    units = None
    if chance(dice, 0.4):
        named = [name for name in ("displacement", "force", "time") if chance(dice, 0.4)]
        units = {name: dice.choice(("mm", "N", "s", *ABSURD_UNITS, None, 3)) for name in named}
    if chance(dice, 0.3):
        names = (["x", "F", "t"], ["x", "x", "x"], [1, 2, 3], [("a", "x"), ("a", "F"), ("b", "t")], [*ABSURD_NAMES[:3]])
        try:
            frame = pd.DataFrame(dict(enumerate(made)))
        except (ValueError, TypeError):
            return "accepted: no table"  # refused by pandas
        frame.columns = dice.choice(names)[: len(made)]
        made = [frame]
    try:
        return judged(lambda: given_records(*made, units=units)[0], "")[0]
    except TypeError as problem:  # what is neither an array nor a record
        if not any(words in str(problem) for words in ("Arrays are given as", "must be a path")):
            raise
        return "refused: TypeError"


def _array(dice: random.Random, values: np.ndarray) -> Any:
    types = ("f2", "f4", ">f8", "i2", "u1", "?", "g", "U", "S9", "O", "M8[s]", "m8[ns]")
    kinds = ("Float64", "float64[pyarrow]", "category", "string", "object")
    strange = (None, 3.0, "x", b"x", {}, {1.0, 2.0}, iter(values), np.array(1.0), np.array(None), [None], [""])
    makers = (
        lambda: values + 1j,
        lambda: np.ma.array(values, mask=numpy_of(dice).random(values.size) < 0.1),
        lambda: [*values.tolist(), 10**400],
        lambda: values.astype(dice.choice(types)),
        lambda: values[:, None],
        lambda: [[1.0], [1.0, 2.0]],
        lambda: values * dice.choice(ABSURD_NUMBERS),
        lambda: values.astype("g") * np.longdouble("1e4000"),
        lambda: pd.Series(values, index=range(100, 100 + values.size)),
        lambda: pd.Series(values).astype(dice.choice(kinds)),
        lambda: [decimal.Decimal(1), decimal.Decimal(2)],
        lambda: values[::-1],
        lambda: np.full_like(values, dice.choice(ABSURD_NUMBERS)),
        lambda: dice.choice(strange),
        lambda: pd.arrays.SparseArray(values),
        lambda: memoryview(np.ascontiguousarray(values)),
        lambda: np.lib.stride_tricks.as_strided(values[:1], (1000,), (0,)) if values.size else values,
        lambda: pd.Series([1, 2, None], dtype="Int64"),
    )
    with np.errstate(all="ignore"):
        return dice.choice(makers)() if chance(dice, 0.35) else values.tolist() if chance(dice, 0.3) else values
