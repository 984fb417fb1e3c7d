"""Tables of records made from pieces, sound and absurd, and texts that hold them."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from targets.made import ABSURD_NUMBERS, chance, damaged, numpy_of

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


def size_of_table(dice: random.Random) -> int:
    """Rows: mostly few, so that many tables are tried, and now and then enough for each way of reading."""
    return dice.choice((2, 3, 5, 9, 20, 40, 80, 161, 400))


def columns(dice: random.Random, size: int, absurd: float = 0.04) -> list[Piece]:
    """Columns of a table: displacement, force, and perhaps time and others; names and values absurd now and then."""
    phase = np.linspace(0.0, float(dice.choice((1.0, 4.0, 12.0))) * np.pi, size)
    quantities = ["displacement", "force"]
    quantities += ["time"] if chance(dice, 0.6) else []
    quantities += ["other"] * dice.randrange(0, 3) if chance(dice, 0.4) else []
    dice.shuffle(quantities)
    made = []
    for quantity in quantities:
        name = dice.choice(ABSURD_NAMES if chance(dice, absurd) else NAMES[quantity])
        unit = dice.choice(ABSURD_UNITS) if chance(dice, absurd) else UNITS[quantity][0]
        unit = dice.choice(UNITS[quantity]) if chance(dice, 0.3) else unit
        values = {
            "displacement": 12.5 * np.sin(phase) + 57.0,
            "force": 0.35 * np.sin(phase) + 0.05 * np.sign(np.cos(phase)),
            "time": 0.01 * np.arange(size),
            "other": np.round(20.0 + numpy_of(dice).normal(size=size), 2),
        }[quantity]
        if chance(dice, absurd):
            values = absurd_values(dice, values)
        made.append(Piece(quantity, name, unit, values))
    return made


def absurd_values(dice: random.Random, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values with absurd ones among them, or all of them absurd."""
    values = values.copy()
    match dice.randrange(5):
        case 0:
            values[:] = dice.choice(ABSURD_NUMBERS)
        case 1:
            values = numpy_of(dice).choice(ABSURD_NUMBERS, values.size)
        case 2:
            with np.errstate(all="ignore"):
                values = values * dice.choice(ABSURD_NUMBERS)
        case 3:
            values = np.round(values / 20.0)
        case _:
            values[numpy_of(dice).integers(0, values.size, dice.randrange(1, 4))] = dice.choice(ABSURD_NUMBERS)
    return values


def options(dice: random.Random, pieces: Sequence[Piece]) -> dict[str, Any]:
    """Arguments of `read_record`: mostly none or what the table needs, now and then absurd."""
    given: dict[str, Any] = {}
    if chance(dice, 0.4):
        for quantity in ("displacement", "force"):
            number = next(k for k, piece in enumerate(pieces, 1) if piece.quantity == quantity)
            given[quantity] = dice.choice((number, str(number), pieces[number - 1].name))
    if chance(dice, 0.1):
        for quantity in ("displacement", "force", "time"):
            if chance(dice, 0.5):
                given[quantity] = dice.choice(ABSURD_COLUMNS)
    if chance(dice, 0.15):
        for quantity in ("displacement", "force", "time"):
            if chance(dice, 0.5):
                given[f"{quantity}_unit"] = dice.choice(ABSURD_UNITS if chance(dice, 0.4) else UNITS[quantity])
    if chance(dice, 0.1):
        given["reverse"] = dice.choice(("displacement", "force", "time", ""))
    if chance(dice, 0.1):
        for name in ("displacement_offset", "force_offset", "displacement_scale", "force_scale"):
            if chance(dice, 0.5):
                given[name] = dice.choice(ABSURD_NUMBERS)
    return given


# ---- texts -----------------------------------------------------------------------------------------------------------

_SEPARATORS = ("\t", ";", ",", " ", "  ", "|", ", ", " ; ", ":")
_DECIMALS = (".", ".", ".", ",")
_ENDS = ("\n", "\r\n", "\r", "\n\r")
ENCODINGS = (
    "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252", "gb18030", "shift_jis", "latin-1",
    "utf-32", "utf-7", "koi8-r", "cp037",
)  # fmt: skip
_PREAMBLES = (
    "Test of a spring", "# rig 7", "% comment", "Operator;A;;", "Date,2024-01-01,12:00", "---", "====\t====", "", " ",
    "BZh", "PK", "MATLAB",
    "-1", "   58", "<html>", "\x0c", "sep=;", "1;2", "3.5 4.5", "%PDF", "{", "\\documentclass", "'", '"', "1e5",
)  # fmt: skip


def text_of(dice: random.Random, pieces: list[Piece]) -> tuple[str, bool]:
    """A table as text; and whether its numbers are known."""
    separator, decimal = (dice.choice(_SEPARATORS if chance(dice, 0.2) else _SEPARATORS[:4]), dice.choice(_DECIMALS))
    is_plain = True
    form = dice.choice(("{!r}", "{:.3f}", "{:.6e}", "{:+.4g}", "{:10.4f}"))
    rows = [[form.format(value) for value in row] for row in np.column_stack([p.values for p in pieces]).tolist()]
    if form != "{!r}":
        is_plain = False
    rows = [[cell.replace(".", decimal) for cell in row] for row in rows]
    for _ in range(dice.randrange(1, 4) if chance(dice, 0.3) else 0):
        row = dice.choice(rows)
        row[dice.randrange(len(row))] = dice.choice(ABSURD_CELLS)
        is_plain = False
    quote = dice.choice(("'", '"', '"', '"')) if chance(dice, 0.2) else ""
    head = _head(dice, pieces, separator)
    quoted_rows = [separator.join(f"{quote}{cell}{quote}" for cell in row) for row in rows]
    tail = dice.choice(("", separator, ";", " ", "\t")) if chance(dice, 0.2) else ""
    lines = [*head, *(f"{row}{tail}" for row in quoted_rows)]
    if chance(dice, 0.25):
        is_plain = False
        _disturb(dice, lines, separator)
    end = dice.choice(_ENDS) if chance(dice, 0.3) else "\n"
    text = end.join(lines) + (
        dice.choice(("", 3 * end, f"{separator}{end}", "\x1a", "\0\0\0")) if chance(dice, 0.3) else end
    )
    if chance(dice, 0.1):
        text = "".join(dice.choice(_ENDS) if character == "\n" else character for character in text)
    return text, is_plain


def _head(dice: random.Random, pieces: list[Piece], separator: str) -> list[str]:
    lines = [dice.choice(_PREAMBLES) for _ in range(dice.randrange(0, 4))] if chance(dice, 0.3) else []
    comment = dice.choice(("", "", "", "#", "# ", "%", "//"))
    forms = ("{0}", "{0} [{1}]", "{0} ({1})", "{0}/{1}", "{0}_{1}", "{0} in {1}", '"{0} [{1}]"', "{0}（{1}）")
    form = dice.choice(forms)
    if chance(dice, 0.9):
        lines.append(comment + separator.join(form.format(piece.name, piece.unit) for piece in pieces))
    if chance(dice, 0.2):
        unit = dice.choice(("{}", "[{}]", "({})"))
        lines.append(comment + separator.join(unit.format(piece.unit) for piece in pieces))
    if chance(dice, 0.1):
        lines.append(dice.choice(("-" * 30, "=====", "", separator * len(pieces))))
    return lines


def _disturb(dice: random.Random, lines: list[str], separator: str) -> None:
    """Change lines of a text."""
    for _ in range(dice.randrange(1, 4)):
        k = dice.randrange(len(lines))
        match dice.randrange(14):
            case 0:
                del lines[k]
            case 1:
                lines[k:k] = [lines[k]] * dice.choice((1, 3, 1000))
            case 2:
                lines.insert(k, dice.choice(_PREAMBLES))
            case 3:
                lines[k] = lines[k][: dice.randrange(0, len(lines[k]) + 1)]
            case 4:
                lines[k] += separator * dice.choice((1, 2, 5, 5, 9, 1000, 1000, 200_000))
            case 5:
                lines[k] += separator.join(["1"] * dice.choice((1, 1, 2, 3, 9, 100, 100, 100_000)))
            case 6:
                lines[k] = dice.choice(("x", "1", '"', "\0", "(", "[mm] ", "1 ", "_", "/")) * int(
                    dice.choice((20, 200, 200, 200, 10**4, 10**4, 10**5, 10**6))
                )
            case 7:
                lines[k] = lines[k].replace(separator, dice.choice(_SEPARATORS))
            case 8:
                lines[k] = dice.choice(ABSURD_NAMES) + separator + dice.choice(ABSURD_CELLS)
            case 9:
                lines[k:] = [""] * dice.choice((1, 2, 3, 5, 9, 30_000))
            case 10:
                place = dice.randrange(0, len(lines[k]) + 1)
                lines[k] = (
                    lines[k][:place] + dice.choice(('"', "'", "#", "\0", "\r", "\ufeff", "\ud800")) + lines[k][place:]
                )
            case 11:
                lines[:] = lines[k:] + lines[:k]
            case 12:
                lines.append(lines[-1][: max(1, len(lines[-1]) // 2)])
            case _:
                lines += lines
        if not lines:
            lines.append("")


def changed_text(dice: random.Random, data: bytes) -> bytes:
    """A text with its end cut off, doubled in another encoding, or with bytes changed."""
    if chance(dice, 0.3):
        return data[: dice.randrange(0, len(data) + 1)]
    if chance(dice, 0.1):
        return data + data.decode("latin-1").encode("utf-16")
    # With a NUL byte it would be refused as binary most times.
    return damaged(dice, data).replace(b"\0", b"" if chance(dice, 0.9) else b"\0")
