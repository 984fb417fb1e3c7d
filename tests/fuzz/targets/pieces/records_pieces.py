"""Pieces of records, sound and absurd, that the fuzzers put together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Item = TypeVar("Item")

NAMES = {
    "displacement": (
        "displacement",
        "Weg",
        "x",
        "Disp.",
        "Federweg",
        "位移",
        "Déplacement",
        "stroke",
        "Position (LVDT)",
    ),
    "force": ("force", "Kraft", "F", "Load cell", "Prüfkraft", "力", "Carga", "load", "F_m"),
    "time": ("time", "Zeit", "t", "时间", "Temps", "elapsed time"),
    "other": ("cycle", "temperature", "remark", "", "rate", "σ", "Kanal 3", "x", "force", "Größe"),
}
UNITS = {
    "displacement": ("mm", "m", "cm", "in", "um", "µm", '"', "inch"),
    "force": ("N", "kN", "lbf", "MN", "mN", "kgf", "牛"),
    "time": ("s", "ms", "min", "sec."),
    "other": ("°C", "-", "%", "V", "", "parsec", "mn"),
}
ABSURD_NAMES = (
    "", " ", "[", "[]", "[[mm]]", "a" * 5000, "x" + "/m" * 400, "\ud800", "\u202eecrof", "force [" * 60, "nan", "1e5",
    "'", "$_$", "<b>",
    "\x1b[31m", "=1+1", "x\u0301" * 90, "🧲", "force\u00a0[kN]", "ﬀorce", "İ", "%s%n", "{0}", "\\x00", "CON", "-", "٣",
    "\ufeffx",
)  # fmt: skip
ABSURD_CELLS = (
    "", " ", "nan", "inf", "-inf", "Infinity", "NA", "n/a", "none", "1e400", "-1e400", "1e-400", "1e308", "1e-308",
    "0x10", "1_000", "٣", "１",
    "+-1", "--1", "1,5", "1.5", "1.234,5", "1,234.5", "1e", "1e+", ".", ",", "+", "-", "e5", "5e5e5", "1.5.2",
    "1 000", "1\u00a0000", "1'000",
    '"', '""', '"1"', "'1'", '"1', "1\x00", "\x00", "\x1a", "\x0b", "\x0c", "\x1c", "\x85", "\u2028", "true",
    "#DIV/0!", "#N/A", "12:30:05",
    "2024-01-01", "1/2", "1%", "$5", "(5)", "1d5", "1D+05", "1e+0005", "9" * 400, "0." + "0" * 400 + "1", "1" * 5000,
    "-0", "+0.0", "00012",
    "1e9999999999", "½", "²", "−5", "1\u2009000", "\ud800", "\ufeff1", "=1+1", "NULL", "\\N", "1;2", "1\t2",
)  # fmt: skip
ABSURD_NUMBERS = (
    0.0, -0.0, 1.0, -1.0, 5e-324, 1e-308, 1e-30, 1e-9, 1e9, 1e15, 1e30, 1e154, 1e300, 1.7976931348623157e308,
    -1.7976931348623157e308,
    float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
ABSURD_INTEGERS = (
    0, 1, 2, 3, 7, 8, 16, 127, 128, 255, 256, 32767, 32768, 65535, 65536, 10**6, 2**24, 2**31 - 1, 2**31, 2**32 - 1,
    2**32, 2**48, 2**62,
    2**63 - 1, 2**63, 2**64 - 1,
)  # fmt: skip
ABSURD_COLUMNS = (
    0,
    -1,
    1,
    2,
    3,
    4,
    99,
    10**9,
    10**30,
    "",
    " ",
    "0",
    "-1",
    "1",
    "2",
    "9" * 400,
    "1.5",
    "x/1",
    "/",
    "//",
    "rig/1",
    "rig/force",
    "٣",
    "\x00",
)
ABSURD_UNITS = (
    "",
    " ",
    "mm",
    "N",
    "s",
    "kN",
    "inch",
    "parsec",
    "m" * 500,
    "\x00",
    "mn",
    "Mm",
    "[mm]",
    "\ud800",
    "ＫＮ",
    "ﷺ" * 30,
)


@dataclass(frozen=True)
class Piece:
    """A column of a table.

    Attributes
    ----------
    quantity : str          "displacement", "force", "time" or "other".
    name, unit : str
    values : ndarray, shape (K,)   In that unit.
    """

    quantity: str
    name: str
    unit: str
    values: NDArray[np.float64]


def one_of(random: np.random.Generator, items: Sequence[Item]) -> Item:
    return items[int(random.integers(len(items)))]


def chance(random: np.random.Generator, probability: float) -> bool:
    return bool(random.random() < probability)


def size_of_table(random: np.random.Generator) -> int:
    """Rows: mostly few, so that many tables are tried, and now and then enough for each way of reading."""
    return int(one_of(random, (2, 3, 5, 9, 20, 40, 80, 161, 400)))


def columns(random: np.random.Generator, size: int, absurd: float = 0.04) -> list[Piece]:
    """Columns of a table: displacement, force, and perhaps time and others; names and values absurd now and then."""
    phase = np.linspace(0.0, float(one_of(random, (1.0, 4.0, 12.0))) * np.pi, size)
    quantities = ["displacement", "force"]
    quantities += ["time"] if chance(random, 0.6) else []
    quantities += ["other"] * int(random.integers(0, 3)) if chance(random, 0.4) else []
    random.shuffle(quantities)
    made = []
    for quantity in quantities:
        name = one_of(random, ABSURD_NAMES if chance(random, absurd) else NAMES[quantity])
        unit = one_of(random, ABSURD_UNITS) if chance(random, absurd) else UNITS[quantity][0]
        unit = one_of(random, UNITS[quantity]) if chance(random, 0.3) else unit
        values = {
            "displacement": 12.5 * np.sin(phase) + 57.0,
            "force": 0.35 * np.sin(phase) + 0.05 * np.sign(np.cos(phase)),
            "time": 0.01 * np.arange(size),
            "other": np.round(20.0 + random.normal(size=size), 2),
        }[quantity]
        if chance(random, absurd):
            values = absurd_values(random, values)
        made.append(Piece(quantity, name, unit, values))
    return made


def absurd_values(random: np.random.Generator, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values with absurd ones among them, or all of them absurd."""
    values = values.copy()
    match int(random.integers(5)):
        case 0:
            values[:] = one_of(random, ABSURD_NUMBERS)
        case 1:
            values = random.choice(ABSURD_NUMBERS, values.size)
        case 2:
            with np.errstate(all="ignore"):
                values = values * one_of(random, ABSURD_NUMBERS)
        case 3:
            values = np.round(values / 20.0)
        case _:
            values[random.integers(0, values.size, int(random.integers(1, 4)))] = one_of(random, ABSURD_NUMBERS)
    return values


def options(random: np.random.Generator, pieces: Sequence[Piece]) -> dict[str, Any]:
    """Arguments of `read_record`: mostly none or what the table needs, now and then absurd."""
    given: dict[str, Any] = {}
    if chance(random, 0.4):
        for quantity in ("displacement", "force"):
            number = next(k for k, piece in enumerate(pieces, 1) if piece.quantity == quantity)
            given[quantity] = one_of(random, (number, str(number), pieces[number - 1].name))
    if chance(random, 0.1):
        for quantity in ("displacement", "force", "time"):
            if chance(random, 0.5):
                given[quantity] = one_of(random, ABSURD_COLUMNS)
    if chance(random, 0.15):
        for quantity in ("displacement", "force", "time"):
            if chance(random, 0.5):
                given[f"{quantity}_unit"] = one_of(random, ABSURD_UNITS if chance(random, 0.4) else UNITS[quantity])
    if chance(random, 0.1):
        given["reverse"] = one_of(random, ("displacement", "force", "time", ""))
    if chance(random, 0.1):
        for name in ("displacement_offset", "force_offset", "displacement_scale", "force_scale"):
            if chance(random, 0.5):
                given[name] = one_of(random, ABSURD_NUMBERS)
    return given


def mutated(random: np.random.Generator, data: bytes, count: int | None = None) -> bytes:
    """Bytes with a few of them flipped, replaced by absurd integers, cut out, cut off or repeated."""
    made = bytearray(data)
    for _ in range(int(one_of(random, (1, 1, 1, 2, 4))) if count is None else count):
        if not made:
            break
        # The beginning and the end, where formats keep their tables, are as often changed as the rest.
        span = int(one_of(random, (64, 512, len(made))))
        place = int(random.integers(min(span, len(made))))
        place = len(made) - 1 - place if chance(random, 0.3) else place
        match int(random.integers(8)):
            case 0 | 1:
                made[place] ^= 1 << int(random.integers(8))
            case 2:
                made[place] = int(random.integers(256))
            case 3 | 4:
                width = int(one_of(random, (1, 2, 4, 8)))
                place -= place % width if chance(random, 0.8) else 0
                order = one_of(random, ("little", "big"))
                value = one_of(random, ABSURD_INTEGERS) % 256**width
                made[place : place + width] = value.to_bytes(width, "big" if order == "big" else "little")
            case 5:
                del made[place : place + int(one_of(random, (1, 4, 8, 100)))]
            case 6:
                length = int(one_of(random, (1, 8, 100, 1000)))
                made[place:place] = made[place : place + length] * int(one_of(random, (1, 2, 20)))
            case _:
                if chance(random, 0.4):
                    del made[place:]
                else:
                    made[place : place + 8] = np.float64(one_of(random, ABSURD_NUMBERS)).tobytes()
    return bytes(made)
