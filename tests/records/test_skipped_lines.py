"""Lines that cannot be read: refused by name, or left out and counted where that is asked for."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np
import openpyxl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring import identify, read_campaign, read_record
from strandspring.errors import RecordError
from strandspring.loops.selection import Wanted
from strandspring.records.record import Record
from terminal import Terminal

ROWS = 200
# Exact in binary, so that what is read can be compared bit for bit.
X = np.round(16.0 * np.sin(np.linspace(0.0, 6.0 * np.pi, ROWS)) * 64.0) / 64.0
F = np.round(900.0 * np.sin(np.linspace(0.1, 6.0 * np.pi + 0.1, ROWS)) * 64.0) / 64.0
HEADER = 1


def lines(separator: str = ",", decimal: str = ".", header: str = "x [mm],F [N]") -> list[str]:
    rows = (f"{x!r}{separator}{f!r}".replace(".", decimal) for x, f in zip(X.tolist(), F.tolist(), strict=True))
    return [header.replace(",", separator), *rows]


def damaged(path: Path, damage: dict[int, str], text: list[str] | None = None) -> Path:
    """A record in which lines, counted from 1, are replaced."""
    text = lines() if text is None else list(text)
    for line, content in damage.items():
        text[line - 1] = content
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    return path


def kept(damage: dict[int, str]) -> np.ndarray:
    return np.array([row for row in range(ROWS) if row + HEADER + 1 not in damage])


def skip_notes(notes: tuple[str, ...]) -> list[str]:
    return [note for note in notes if "cannot be read" in note]


@pytest.mark.parametrize(
    ("damage", "found"),
    [
        ({31: "1.5,12a4"}, "Line 31, column 2 'F [N]': must hold a number, found the text '12a4'"),
        ({31: "O.5,2"}, "Line 31, column 1 'x [mm]': must hold a number, found the text 'O.5'"),
        ({31: "1.5"}, "Line 31, column 2 'F [N]': must hold a number, found only 1 of 2 cells"),
        ({31: "1.5,"}, "Line 31, column 2 'F [N]': must hold a number, found an empty cell"),
        ({31: "1.5,2,7"}, "Line 31: must have 2 cells, found 3"),
        ({31: "1.5,nan"}, "Line 31, column 2 'F [N]': must hold a finite number, found 'nan'"),
        ({31: "1.5,1e999"}, "Line 31, column 2 'F [N]': must hold a finite number"),
        ({31: "--- operator pressed hold ---"}, "Line 31, column 1 'x [mm]': must hold a number"),
        ({2: "ERR,2.5", 31: "ERR,3"}, "Line 2, column 1 'x [mm]': must hold a number"),
        ({201: "1.5,ERR"}, "Line 201, column 2 'F [N]': must hold a number"),
        (dict.fromkeys(range(40, 60), "ERR,ERR"), "Line 40, column 1"),  # a tenth of all
    ],
)
def test_bad_lines_are_left_out_and_counted(tmp_path: Path, damage: dict[int, str], found: str) -> None:
    path = damaged(tmp_path / "rig.csv", damage)
    with pytest.raises(RecordError) as refused:
        read_record(path)
    assert str(refused.value).startswith(f"{path}, {found[:1].lower()}{found[1:].split(',')[0].split(':')[0]}")
    assert str(refused.value).endswith("or leave out such lines with `read_record(..., skip_bad_lines=True)`.")
    record = read_record(path, skip_bad_lines=True)
    np.testing.assert_array_equal(record.displacement, 1e-3 * X[kept(damage)])
    np.testing.assert_array_equal(record.force, F[kept(damage)])
    (note,) = skip_notes(record.notes)
    count = f"{len(damage)} line{'s' if len(damage) > 1 else ''} that cannot be read left out"
    assert note.startswith(f"{count}; line {min(damage)} is the first. ({found}")


def read_or_refused(path: Path, skips: bool) -> Record | None:
    try:
        return read_record(path, skip_bad_lines=skips)
    except RecordError:
        return None


@settings(max_examples=200)
@given(
    rows=st.lists(
        st.sampled_from(["1,2", "2.5,-1", "3,4,5", "x,1", "7", '"1,2', "", "1,020.5,3", "nan,1", "12:00:01,4"])
    ),
    good=st.integers(0, 30),
    end=st.text('0123456789.,;\t\n -+e"xN', max_size=12),
)
def test_what_is_read_without_the_option_is_read_alike_with_it(rows: list[str], good: int, end: str) -> None:
    table = "\n".join(["x,F", *(f"{k},{k * k}" for k in range(good)), *rows, *(f"{k},{-k}" for k in range(good)), end])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rig.csv"
        path.write_text(table, encoding="utf-8")
        plain, skipped = (read_or_refused(path, skips) for skips in (False, True))
    if plain is not None:
        assert skipped is not None
        np.testing.assert_array_equal(plain.displacement, skipped.displacement)
        np.testing.assert_array_equal(plain.force, skipped.force)
        assert plain.notes == skipped.notes
    elif skipped is not None:
        (note,) = skip_notes(skipped.notes)
        assert 10 * int(note.split()[0]) <= table.count("\n") + 1


def test_more_than_a_tenth_is_refused(tmp_path: Path) -> None:
    path = damaged(tmp_path / "rig.csv", dict.fromkeys(range(40, 61), "ERR,ERR"))
    with pytest.raises(RecordError, match=r"line 40, .*; more than a tenth of the lines cannot be read; correct the"):
        read_record(path, skip_bad_lines=True)


def test_a_sound_file_is_read_as_without_the_option(tmp_path: Path) -> None:
    path = damaged(tmp_path / "rig.csv", {})
    plain, asked = read_record(path), read_record(path, skip_bad_lines=True)
    np.testing.assert_array_equal(plain.force, asked.force)
    assert plain.notes == asked.notes


@pytest.mark.parametrize("end", ["3.0,", "3.0", "3.0,1e", "3.0,-", "-"])
def test_a_cut_last_line_is_dropped_as_without_the_option(tmp_path: Path, end: str) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("\n".join([*lines()[:30], "ERR,1", *lines()[31:], end]), encoding="utf-8")
    record = read_record(path, skip_bad_lines=True)
    np.testing.assert_array_equal(record.force, F[kept({31: ""})])
    assert skip_notes(record.notes)[0].startswith("1 line that")
    assert "1 incomplete row at the end of the file (from line 202) left out" in record.notes


@pytest.mark.parametrize(
    ("separator", "line", "part"),
    [
        (";", "1.5;1,020.5", "column 2 'F [N]': must hold a number without marks between thousands, found the text"),
        (",", "1.5,1,020.5", "line 31: must have 2 cells, found 3 (is a comma between thousands?)"),
    ],
)
def test_numbers_with_thousands_marks_are_not_left_out(tmp_path: Path, separator: str, line: str, part: str) -> None:
    """They are the largest ones: without them the loop would lose its ends."""
    path = damaged(tmp_path / "rig.csv", {20: f"ERR{separator}1", 31: line}, lines(separator))
    with pytest.raises(RecordError) as refused:
        read_record(path, skip_bad_lines=True)
    assert part in str(refused.value)
    assert "such lines hold the largest numbers and are not left out" in str(refused.value)


def test_thousands_marks_that_look_like_decimals_are_found_beside_bad_lines(tmp_path: Path) -> None:
    text = ["x;F", *(f"{k % 17}.5;{750 + k if k % 2 else '1.250'}" for k in range(100))]
    path = damaged(tmp_path / "rig.csv", {30: "1.5;ERR"}, text)
    with pytest.raises(RecordError, match=r"'1\.250' and '751' look like numbers with a mark between thousands"):
        read_record(path, skip_bad_lines=True)


def test_a_missing_cell_between_blanks_does_not_move_the_others(tmp_path: Path) -> None:
    text = ["x F t", *(f"{x!r} {f!r} {0.5 * k}" for k, (x, f) in enumerate(zip(X.tolist(), F.tolist(), strict=True)))]
    path = damaged(tmp_path / "rig.txt", {31: f"{X[29]} 14.5"}, text)  # without a force
    with pytest.raises(RecordError, match="line 31: must have 3 cells, found 2"):
        read_record(path)
    record = read_record(path, skip_bad_lines=True)
    np.testing.assert_array_equal(record.force, F[kept({31: ""})])
    assert record.time is not None


def test_a_faulty_time_costs_its_line_not_all_times(tmp_path: Path) -> None:
    seconds = [f"10:00:{0.25 * k:06.3f}" for k in range(ROWS)]
    text = ["time,x,F", *(f"{s},{x!r},{f!r}" for s, x, f in zip(seconds, X.tolist(), F.tolist(), strict=True))]
    damage = {3: "noon,1,2", 31: f"{seconds[29]},1,E"}
    path = damaged(tmp_path / "rig.csv", damage, text)
    record = read_record(path, skip_bad_lines=True, time="time")
    np.testing.assert_array_equal(record.force, F[kept(damage)])
    assert record.time is not None
    np.testing.assert_allclose(np.diff(record.time), 0.25 * np.diff(kept(damage)), rtol=1e-9)  # microseconds of a day
    assert skip_notes(record.notes)[0].startswith("2 lines that")
    # Where nearly all are faulty and nobody asked for it, the column is.
    path = damaged(tmp_path / "rig.csv", {line: f"noon,{line % 7},{line}" for line in range(100, 202)}, text)
    record = read_record(path, skip_bad_lines=True)
    assert record.time is None
    assert len(record) == ROWS


def test_an_open_quote_is_a_bad_line(tmp_path: Path) -> None:
    text = ["x,F,note", *(f'{x!r},{f!r},"ok"' for x, f in zip(X.tolist(), F.tolist(), strict=True))]
    record = read_record(damaged(tmp_path / "rig.csv", {31: '1,2,"open'}, text), skip_bad_lines=True)
    np.testing.assert_array_equal(record.force, F[kept({31: ""})])
    assert "Line 31: must close each quotation mark" in skip_notes(record.notes)[0]


def test_lines_in_messages_are_those_of_the_file(tmp_path: Path) -> None:
    """A spike below a line that was left out is named by its own line."""
    path = damaged(tmp_path / "rig.csv", {31: "ERR,1", 121: f"{X[119]},1e6"})
    record = read_record(path, skip_bad_lines=True)
    assert any("the force in line 121 (1e+06 N)" in note for note in record.notes)


def test_rows_of_a_sheet_likewise(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["x [mm]", "F [N]"])
    for row, (x, f) in enumerate(zip(X.tolist(), F.tolist(), strict=True), 2):
        sheet.append([x, "broken" if row == 40 else f])
    book.save(tmp_path / "rig.xlsx")
    record = read_record(tmp_path / "rig.xlsx", skip_bad_lines=True)
    np.testing.assert_array_equal(record.force, F[kept({40: ""})])
    assert skip_notes(record.notes)[0].startswith("1 row that cannot be read left out; row 40 is the first")


def test_the_option_goes_where_the_other_ones_go(tmp_path: Path) -> None:
    damaged(tmp_path / "rig.csv", {31: "ERR,1"})
    description = tmp_path / "campaign.toml"
    description.write_text('skip_bad_lines = true\n[[record]]\nfile = "rig.csv"\n', encoding="utf-8")
    assert len(read_campaign(description)[0]) == ROWS - 1
    with pytest.raises(RecordError, match="line 31"):
        read_campaign(description, Wanted(skip_bad_lines=False))
    for wrong in ("yes", 1):
        with pytest.raises(RecordError, match="`skip_bad_lines` must be True or False"):
            read_record(tmp_path / "rig.csv", skip_bad_lines=wrong)  # type: ignore[arg-type]
        with pytest.raises(RecordError, match="`skip_bad_lines` must be True or False"):
            Wanted(skip_bad_lines=wrong)  # type: ignore[arg-type]


SPRING_LINES = 31, 90


@pytest.fixture
def spring_record(tmp_path: Path) -> Path:
    bundled = Path(__file__).parents[2] / "models" / "records" / "rubber_stretch.csv"
    return damaged(
        tmp_path / "rig.csv", dict.fromkeys(SPRING_LINES, "1,ERR,ERR,ERR"), bundled.read_text("utf-8").splitlines()
    )


def test_commands_leave_bad_lines_out_with_a_caution(
    spring_record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, rig, terminal = str(tmp_path / "spring.json"), str(spring_record), Terminal(capsys)
    quick = ["--reverse", "displacement", "--method", "two-stage"]
    terminal("identify", rig, *quick, "-o", model, status=1)
    assert "line 31, " in terminal.err
    assert "leave out such lines with --skip-bad-lines." in terminal.err
    for command in (
        ["identify", rig, *quick, "-o", model],
        ["predict", model, rig, "--reverse", "displacement"],
        ["info", model, rig, "--reverse", "displacement"],
        ["show", rig, "-o", str(tmp_path / "page.html"), "--reverse", "displacement"],
        ["identify-many", rig, *quick, "-o", str(tmp_path / "models"), "--workers", "1"],
    ):
        terminal(*command, "--skip-bad-lines")
        cautions = " ".join(terminal.err.split()).split("Caution: ")[1:]
        (caution,) = [text for text in cautions if "cannot be read" in text]
        sentence = caution[: caution.index("is the first.") + len("is the first.")]
        assert sentence.endswith("2 lines that cannot be read left out; line 31 is the first.")
        assert len(sentence.split()) <= 25
    provenance = json.loads(Path(model).read_text("utf-8"))["provenance"]
    assert any("cannot be read" in note for note in provenance["records"][0]["notes"])


def test_summaries_say_it_too(spring_record: Path) -> None:
    record = read_record(spring_record, reverse="displacement", skip_bad_lines=True)
    (line,) = [text for text in identify(record, method="two-stage").summary().splitlines() if "cannot be read" in text]
    assert line.startswith(f"Caution: {spring_record}: 2 lines that cannot be read left out; line 31 is the first.")
