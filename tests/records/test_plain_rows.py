"""Parts of large tables are read as the row reader reads them: the same bits, and the same refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from strandspring.errors import RecordError
from strandspring.records import text_table
from strandspring.records.reading import read_record

ROWS, PART = 600, 1 << 10
DIALECTS = [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ",")]
NEVER = 1 << 60
# In place of a number, somewhere in the middle.
UNUSUAL = ["", "nan", "1e400", "x", "1.2.3", "1e", '"1.5"', "0x10", "1 2", "5 mm", "\x1a", "1_000", "1,5;3", "+-1", "١"]


def text(separator: str, decimal: str, ending: str = "\n") -> list[str]:
    """Lines of a record: numbers in all the ways in which programs write them, most of them with 17 digits."""
    generator = np.random.default_rng(5)
    time = np.arange(ROWS) * 1e-3
    x, force = np.sin(30.0 * time), 40.0 * np.sin(30.0 * time + 0.2)
    forms = (repr, "{:.6e}".format, "{:+.3E}".format, "  {:.12f} ".format)
    rows = []
    for values in zip(time.tolist(), x.tolist(), force.tolist(), strict=True):
        cells = [forms[int(generator.integers(len(forms)))](value) for value in values]
        rows.append(separator.join(cell.replace(".", decimal) for cell in cells) + ending)
    return [separator.join(("t [s]", "x [mm]", "F [N]")) + ending, *rows]


def outcome(path: Path, least: int, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, int]:
    """The arrays or the refusal of a file, and how many rows were read in parts."""
    sizes = []
    parts = text_table.plain_parts

    def counted(*arguments: Any) -> Any:
        for values, size in parts(*arguments):
            sizes.append(len(values))
            yield values, size

    monkeypatch.setattr(text_table, "_LEAST", least)
    monkeypatch.setattr(text_table, "_PART", PART)
    monkeypatch.setattr(text_table, "plain_parts", counted)
    try:
        record = read_record(path)
    except RecordError as refusal:
        return str(refusal), sum(sizes)
    finally:
        monkeypatch.undo()
    arrays = [record.displacement, record.force, *([] if record.time is None else [record.time])]
    return ([array.tobytes() for array in arrays], record.notes), sum(sizes)


@pytest.mark.parametrize("ending", ["\n", "\r\n"], ids=["unix", "dos"])
@pytest.mark.parametrize(("separator", "decimal"), DIALECTS)
def test_numbers_are_the_same_bits(
    separator: str, decimal: str, ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes("".join(text(separator, decimal, ending)).encode())
    (in_parts, rows), (expected, none) = (outcome(path, least, monkeypatch) for least in (0, NEVER))
    assert in_parts == expected
    assert (rows, none) == (ROWS, 0)


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("cell", UNUSUAL)
def test_what_is_unusual_is_named_by_its_line(
    cell: str, place: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = text(",", ".")
    cells = lines[400].rstrip("\n").split(",")
    cells[place] = cell
    lines[400] = ",".join(cells) + "\n"
    path = tmp_path / "a.csv"
    path.write_bytes("".join(lines).encode())
    (in_parts, rows), (expected, _) = (outcome(path, least, monkeypatch) for least in (0, NEVER))
    assert in_parts == expected
    assert rows > 300 or '"' in cell  # twice, where a time that cannot be read is left out


def test_rows_of_other_lengths_and_empty_ones_are_left_to_the_row_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.csv"
    for odd in ("\n", " \n", "1,2\n", "1,2,3,4\n", ",,\n", "0.399,0.5,1.0\n\n"):
        lines = text(",", ".")
        lines[400] = odd
        path.write_bytes("".join(lines).encode())
        (in_parts, rows), (expected, _) = (outcome(path, least, monkeypatch) for least in (0, NEVER))
        assert in_parts == expected, odd
        assert 300 < rows < 400, odd
    # One too many, one too few: as many separators as there should be.
    lines = text(",", ".")
    lines[400], lines[401] = "0.399,1,2,3\n", "0.4,1\n"
    path.write_bytes("".join(lines).encode())
    (in_parts, _), (expected, _) = (outcome(path, least, monkeypatch) for least in (0, NEVER))
    assert in_parts == expected
    assert "line 401" in in_parts


def test_a_file_that_is_cut_in_a_number_keeps_its_whole_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes("".join(text(",", "."))[:-9].encode())
    (in_parts, rows), (expected, _) = (outcome(path, least, monkeypatch) for least in (0, NEVER))
    assert in_parts == expected
    assert rows > 500
