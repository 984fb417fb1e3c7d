"""Random descriptions: python tests/fuzz/targets/records_descriptions.py [--seed SEED] [--count COUNT] [--keep FOLDER]

Description files (TOML) of campaigns, what options select of a record, and what is given in Python as arrays.
"""

from __future__ import annotations

import decimal
import json
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from harness import main
from pieces.records_judge import judged
from pieces.records_pieces import ABSURD_COLUMNS, ABSURD_NAMES, ABSURD_NUMBERS, ABSURD_UNITS, chance, mutated, one_of
from strandspring.loops.selection import Wanted, entries, read_campaign
from strandspring.records.given import given_records
from strandspring.records.record import Record

_TIME = np.linspace(0.0, 10.0, 2001)
_X = 10.0 * np.sin(2.0 * np.pi * _TIME)  # [mm]
_F = 100.0 * np.sin(2.0 * np.pi * _TIME + 0.1)  # [N]
_COUNTS = (
    "0",
    "1",
    "2",
    "3",
    "9",
    "10",
    "99",
    "999999999",
    "9999999999",
    "-1",
    "",
    " ",
    "1.5",
    "1e3",
    "x",
    "٣",
    "+2",
    "0x2",
    "\0",
    "inf",
)
_ENDS = (
    "0", "1", "-5", "5", "2.5", "1e3", "1e308", "-1e308", "1e999", "1e-999", "inf", "nan", "", " ", "x", "1:2", "٣",
    ".", "1e", "-", "9" * 400,
    "1_0", "0x1", "1,5", "5 mm",
)  # fmt: skip
_FILES = (
    "a.csv", "b.csv", "*.csv", "[ab].csv", "none.csv", "*", "**", "**/*", "../x/a.csv", "../*.csv", "/etc/*",
    "/dev/null", "/dev/zero", "~", "~/a.csv", "~no-such-user/a", "", " ",
    "a\0b", "a" * 300, "folder", "d.toml", "[", "[]", "?", "a.csv/b", "***", "**a", "\ud800", ".", "..", "a.csv ",
    "//", "pipe",
)  # fmt: skip
_KEYS = tuple(field.name for field in fields(Wanted))


def trial(random: np.random.Generator, folder: Path) -> Iterator[str]:
    """One description, selection or set of arrays."""
    what = one_of(random, (_description, _selection, _arrays))
    yield what.__name__.removeprefix("_")
    yield what(random, folder)


def _write_records(folder: Path) -> None:
    for name, sign in (("a.csv", 1.0), ("b.csv", 2.0)):
        rows = "\n".join(f"{t:.4f},{x:.5f},{sign * f:.5f}" for t, x, f in zip(_TIME, _X, _F, strict=True))
        (folder / name).write_text(f"t,x,F\n{rows}\n")
    (folder / "folder").mkdir()


def _ends(random: np.random.Generator, numbers: tuple[str, ...]) -> str:
    form = one_of(
        random, ("{}:{}", "{}:{}", "{}:", ":{}", "{}", "{}-{}", ":", "::", " {} : {} ", "{}:{}:{}", "[{},{}]")
    )
    sound = numbers[:6] if chance(random, 0.6) else numbers
    return form.format(*(one_of(random, sound) for _ in range(3)))


def _value(random: np.random.Generator, key: str) -> Any:
    """A value of a key of a description, mostly of the right type."""
    is_sound = chance(random, 0.8)
    if not is_sound and chance(random, 0.4):
        return one_of(random, (1, -1, 0, 2**70, 1.5, 1e308, True, "", "x", [], [1], {}, {"a": 1}, "\0", "nan"))
    if key == "cycles":
        return one_of(random, (_ends(random, _COUNTS), int(random.integers(-1, 12))))
    if key in ("time_window", "displacement_range"):
        return _ends(random, _ENDS)
    if key.endswith("_unit"):
        return one_of(random, ("mm",) if is_sound else ABSURD_UNITS)
    if key.endswith(("_offset", "_scale")):
        return float(one_of(random, (1.0, 2.0) if is_sound else ABSURD_NUMBERS))
    if key == "reverse":
        return one_of(random, ("displacement", "force") if is_sound else ("time", ""))
    if key == "label":
        return one_of(random, ("lot A",) if is_sound else ABSURD_NAMES)
    own = {"displacement": (2, "x"), "force": (3, "F"), "time": (1, "t")}.get(key, (1,)) if is_sound else ABSURD_COLUMNS
    return one_of(random, own)


def _toml(value: Any) -> str:
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(one)}" for key, one in value.items()) + "}"
    return json.dumps(value)


def _description(random: np.random.Generator, folder: Path) -> str:
    _write_records(folder)
    lines = [f"{key} = {_toml(_value(random, key))}" for key in _some(random, 2)]
    for _ in range(int(one_of(random, (0, 1, 1, 2, 2, 50)))):
        lines.append(
            one_of(
                random, ("[[record]]",) * 100 + ("[record]", "[[records]]", "[[record", "[[record.x]]", "record = 3")
            )
        )
        lines.append(f"file = {_toml(one_of(random, _FILES[:4] if chance(random, 0.9) else _FILES))}")
        lines += [f"{key} = {_toml(_value(random, key))}" for key in _some(random, 2)]
    if chance(random, 0.1):
        absurd = (
            "x = 1",
            "= 1",
            "a.b.c = 1",
            "x = " + "[" * 3000,
            "[a]\n[a]",
            "x = 2024-01-01",
            "x = 'a",
            "#",
            "\ufeff",
            "x = 0x_1",
            '"" = 1',
        )
        lines.insert(int(random.integers(len(lines) + 1)), one_of(random, absurd))
    data = "\n".join(lines).encode("utf-8", "surrogatepass")
    if chance(random, 0.2):
        data = mutated(random, data)
    path = folder / "d.toml"
    path.write_bytes(data)

    def read() -> Record:
        (record, *_) = read_campaign(path)
        assert len(entries([path])) >= 1
        return record

    # A refusal names the description, or the record of it that is not one, which may be elsewhere.
    return judged(read, "" if re.search(rb'"[/~]', data) else folder)[0]


def _some(random: np.random.Generator, most: int) -> list[str]:
    keys = [one_of(random, _KEYS) for _ in range(int(random.integers(0, most + 1)))]
    return [
        one_of(random, ("speed", "file", "é", "Force")) if chance(random, 0.03) else key for key in dict.fromkeys(keys)
    ]


def _selection(random: np.random.Generator, folder: Path) -> str:
    _write_records(folder)
    keys = (
        "cycles",
        "time_window",
        "displacement_range",
        "displacement_offset",
        "displacement_scale",
        "displacement_unit",
        "reverse",
    )
    given = {key: _value(random, key) for key in keys if chance(random, 0.3)}
    return judged(lambda: Wanted(**given).read(folder / "a.csv"), "")[0]


def _arrays(random: np.random.Generator, _: Path) -> str:
    size = int(one_of(random, (1, 2, 3, 200)))
    x, force = 1e-3 * _X[:size], _F[:size]
    made = [_array(random, values) for values in (x, force, _TIME[:size])]
    count = int(one_of(random, (2, 2, 3)))
    if chance(random, 0.3):
        columns = one_of(
            random,
            (["x", "F", "t"], ["x", "x", "x"], [1, 2, 3], [("a", "x"), ("a", "F"), ("b", "t")], list(ABSURD_NAMES[:3])),
        )
        try:
            frame = pd.DataFrame(dict(enumerate(made[:count])))
        except (ValueError, TypeError):
            return "accepted: no table"  # refused by pandas
        frame.columns = columns[:count]
        return _given(frame, units=_units(random))
    return _given(*made[:count], units=_units(random))


def _given(*data: Any, units: Any) -> str:
    try:
        return judged(lambda: given_records(*data, units=units)[0], "")[0]
    except TypeError as problem:  # what is neither an array nor a record
        if not any(words in str(problem) for words in ("Arrays are given as", "must be a path")):
            raise
        return "refused: TypeError"


def _units(random: np.random.Generator) -> Any:
    if chance(random, 0.6):
        return None
    return {
        name: one_of(random, ("mm", "N", "s", *ABSURD_UNITS, None, 3))
        for name in ("displacement", "force", "time")
        if chance(random, 0.4)
    }


def _array(random: np.random.Generator, values: np.ndarray) -> Any:
    kind = int(random.integers(24)) if chance(random, 0.5) else 99
    with np.errstate(all="ignore"):
        match kind:
            case 0:
                return values + 1j
            case 1:
                return np.ma.array(values, mask=random.random(values.size) < 0.1)
            case 2:
                return [*values.tolist(), 10**400]
            case 3:
                return values.astype(
                    one_of(random, ("f2", "f4", ">f8", "i2", "u1", "?", "g", "U", "S9", "O", "M8[s]", "m8[ns]"))
                )
            case 4:
                return values[:, None]
            case 5:
                return [[1.0], [1.0, 2.0]]
            case 6:
                return values * one_of(random, ABSURD_NUMBERS)
            case 7:
                return values.astype("g") * np.longdouble("1e4000")
            case 8:
                return pd.Series(values, index=range(100, 100 + values.size))
            case 9:
                return pd.Series(values).astype(
                    one_of(random, ("Float64", "float64[pyarrow]", "category", "string", "object"))
                )
            case 10:
                return [decimal.Decimal(1), decimal.Decimal(2)]
            case 11:
                return values[::-1]
            case 12:
                return np.full_like(values, one_of(random, ABSURD_NUMBERS))
            case 13:
                return one_of(
                    random,
                    (
                        None,
                        3.0,
                        "x",
                        b"x",
                        {},
                        {1.0, 2.0},
                        iter(values),
                        np.array(1.0),
                        np.array(None),
                        [None],
                        [""],
                        object(),
                    ),
                )
            case 14:
                return pd.arrays.SparseArray(values)
            case 15:
                return memoryview(np.ascontiguousarray(values))
            case 16:
                return np.lib.stride_tricks.as_strided(values[:1], (1000,), (0,)) if values.size else values
            case 17:
                return pd.Series([1, 2, None], dtype="Int64")
            case _:
                return values.tolist() if chance(random, 0.3) else values


if __name__ == "__main__":
    main(__file__, trial, 3000)
