"""Random text records: python tests/fuzz/targets/records_text.py [--seed SEED] [--count COUNT] [--keep FOLDER]

Texts are put together from pieces (separator, decimal mark, header, units, preamble, encoding, line ends) and then
changed in a few places. One that was not changed must give the numbers that it was made of, or be refused.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from harness import main
from pieces.records_judge import judged
from pieces.records_pieces import (
    ABSURD_CELLS,
    ABSURD_NAMES,
    Piece,
    chance,
    columns,
    mutated,
    one_of,
    options,
    size_of_table,
)
from strandspring.records.reading import read_record
from strandspring.records.record import Record

_SEPARATORS = ("\t", ";", ",", " ", "  ", "|", ", ", " ; ", ":")
_DECIMALS = (".", ".", ".", ",")
_ENDS = ("\n", "\r\n", "\r", "\n\r")
_ENCODINGS = (
    "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252", "gb18030", "shift_jis", "latin-1",
    "utf-32", "utf-7", "koi8-r", "cp037",
)  # fmt: skip
_PREAMBLES = (
    "Test of a spring", "# rig 7", "% comment", "Operator;A;;", "Date,2024-01-01,12:00", "---", "====\t====", "", " ",
    "BZh", "PK", "MATLAB",
    "-1", "   58", "<html>", "\x0c", "sep=;", "1;2", "3.5 4.5", "%PDF", "{", "\\documentclass", "'", '"', "1e5",
)  # fmt: skip


def trial(random: np.random.Generator, folder: Path) -> Iterator[str]:
    """One text."""
    yield "text"
    path = folder / "record.csv"
    pieces = columns(random, size_of_table(random))
    text, is_plain = _text(random, pieces)
    encoding = one_of(random, _ENCODINGS) if chance(random, 0.25) else "utf-8"
    data = text.encode(encoding, "surrogatepass" if encoding.startswith("utf") and encoding != "utf-7" else "replace")
    if is_changed := chance(random, 0.3):
        data = _changed(random, data)
    path.write_bytes(data)
    given = options(random, pieces)
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


def _text(random: np.random.Generator, pieces: list[Piece]) -> tuple[str, bool]:
    """A table as text; and whether its numbers are known."""
    separator, decimal = (
        one_of(random, _SEPARATORS if chance(random, 0.2) else _SEPARATORS[:4]),
        one_of(random, _DECIMALS),
    )
    is_plain = True
    form = one_of(random, ("{!r}", "{:.3f}", "{:.6e}", "{:+.4g}", "{:10.4f}"))
    rows = [[form.format(value) for value in row] for row in np.column_stack([p.values for p in pieces]).tolist()]
    if form != "{!r}":
        is_plain = False
    rows = [[cell.replace(".", decimal) for cell in row] for row in rows]
    for _ in range(int(random.integers(1, 4)) if chance(random, 0.3) else 0):
        row = one_of(random, rows)
        row[int(random.integers(len(row)))] = one_of(random, ABSURD_CELLS)
        is_plain = False
    quote = one_of(random, ("'", '"', '"', '"')) if chance(random, 0.2) else ""
    head = _head(random, pieces, separator)
    quoted_rows = [separator.join(f"{quote}{cell}{quote}" for cell in row) for row in rows]
    tail = one_of(random, ("", separator, ";", " ", "\t")) if chance(random, 0.2) else ""
    lines = [*head, *(f"{row}{tail}" for row in quoted_rows)]
    if chance(random, 0.25):
        is_plain = False
        _disturb(random, lines, separator)
    end = one_of(random, _ENDS) if chance(random, 0.3) else "\n"
    text = end.join(lines) + (
        one_of(random, ("", 3 * end, f"{separator}{end}", "\x1a", "\0\0\0")) if chance(random, 0.3) else end
    )
    if chance(random, 0.1):
        text = "".join(one_of(random, _ENDS) if character == "\n" else character for character in text)
    return text, is_plain


def _head(random: np.random.Generator, pieces: list[Piece], separator: str) -> list[str]:
    lines = [one_of(random, _PREAMBLES) for _ in range(int(random.integers(0, 4)))] if chance(random, 0.3) else []
    comment = one_of(random, ("", "", "", "#", "# ", "%", "//"))
    form = one_of(
        random, ("{0}", "{0} [{1}]", "{0} ({1})", "{0}/{1}", "{0}_{1}", "{0} in {1}", '"{0} [{1}]"', "{0}（{1}）")
    )
    if chance(random, 0.9):
        lines.append(comment + separator.join(form.format(piece.name, piece.unit) for piece in pieces))
    if chance(random, 0.2):
        unit = one_of(random, ("{}", "[{}]", "({})"))
        lines.append(comment + separator.join(unit.format(piece.unit) for piece in pieces))
    if chance(random, 0.1):
        lines.append(one_of(random, ("-" * 30, "=====", "", separator * len(pieces))))
    return lines


def _disturb(random: np.random.Generator, lines: list[str], separator: str) -> None:
    """Change lines of a text."""
    for _ in range(int(random.integers(1, 4))):
        k = int(random.integers(len(lines)))
        match int(random.integers(14)):
            case 0:
                del lines[k]
            case 1:
                lines[k:k] = [lines[k]] * int(one_of(random, (1, 3, 1000)))
            case 2:
                lines.insert(k, one_of(random, _PREAMBLES))
            case 3:
                lines[k] = lines[k][: int(random.integers(0, len(lines[k]) + 1))]
            case 4:
                lines[k] += separator * int(one_of(random, (1, 2, 5, 5, 9, 1000, 1000, 200_000)))
            case 5:
                lines[k] += separator.join(["1"] * int(one_of(random, (1, 1, 2, 3, 9, 100, 100, 100_000))))
            case 6:
                lines[k] = one_of(random, ("x", "1", '"', "\0", "(", "[mm] ", "1 ", "_", "/")) * int(
                    one_of(random, (20, 200, 200, 200, 10**4, 10**4, 10**5, 10**6))
                )
            case 7:
                lines[k] = lines[k].replace(separator, one_of(random, _SEPARATORS))
            case 8:
                lines[k] = one_of(random, ABSURD_NAMES) + separator + one_of(random, ABSURD_CELLS)
            case 9:
                lines[k:] = [""] * int(one_of(random, (1, 2, 3, 5, 9, 30_000)))
            case 10:
                place = int(random.integers(0, len(lines[k]) + 1))
                lines[k] = (
                    lines[k][:place]
                    + one_of(random, ('"', "'", "#", "\0", "\r", "\ufeff", "\ud800"))
                    + lines[k][place:]
                )
            case 11:
                lines[:] = lines[k:] + lines[:k]
            case 12:
                lines.append(lines[-1][: max(1, len(lines[-1]) // 2)])
            case _:
                lines += lines
        if not lines:
            lines.append("")


def _changed(random: np.random.Generator, data: bytes) -> bytes:
    if chance(random, 0.3):
        return data[: int(random.integers(0, len(data) + 1))]
    if chance(random, 0.1):
        return data + data.decode("latin-1").encode("utf-16")
    # With a NUL byte it would be refused as binary most times.
    return mutated(random, data).replace(b"\0", b"" if chance(random, 0.9) else b"\0")


def judge(path: Path) -> Iterator[str]:
    """A file of the corpus, read."""
    yield judged(lambda: read_record(path), path)[0]


if __name__ == "__main__":
    main(__file__, trial, 4000, judge)
