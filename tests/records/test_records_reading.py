"""Reading of measured records: what test rigs write is read, what is no record is refused in a sentence."""

from __future__ import annotations

import contextlib
import hashlib
import io
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring.errors import RecordError
from strandspring.records import content, source, units
from strandspring.records.reading import read_record
from strandspring.records.record import Record
from strandspring.records.spikes import find_spikes, spikes_of

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
RUBBER = ROOT / "models" / "records" / "rubber_stretch.csv"
CIRCLE = ROOT / "tests" / "data" / "actuator" / "circle_3bar.csv"
PLASTIC = ROOT / "tests" / "data" / "hinge" / "plastic_compress.csv"

Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def _write(content: str | bytes, encoding: str = "utf-8") -> Path:
        path = tmp_path / "record.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
        return path

    return _write


def refusal(path: Path, **options: object) -> str:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert is_sentence(message)
    return message


def is_sentence(message: str) -> bool:
    return message.isprintable() and message.endswith((".", "?"))


# ------------------------------------------------------------------------------------------ real files


def test_the_bundled_record_is_read_without_options() -> None:
    record = read_record(RUBBER)
    raw = np.loadtxt(RUBBER, delimiter=",", skiprows=1)
    # Pandas 2 keeps 17 digits behind the decimal point, Pandas 3 all of them.
    np.testing.assert_allclose(record.displacement, 1e-3 * raw[:, 1], rtol=1e-12)
    np.testing.assert_allclose(record.force, raw[:, 2], rtol=1e-12)
    np.testing.assert_allclose(record.time, raw[:, 3], rtol=1e-12)
    assert record.sha256 == hashlib.sha256(RUBBER.read_bytes()).hexdigest()
    assert record.path == str(RUBBER)
    assert any("mm (assumed" in note for note in record.notes)


def test_a_column_is_reversed() -> None:
    forward, backward = read_record(RUBBER), read_record(RUBBER, reverse="displacement")
    np.testing.assert_array_equal(backward.displacement, -forward.displacement)
    np.testing.assert_array_equal(backward.force, forward.force)


def test_columns_of_a_file_without_header_are_given_by_number() -> None:
    record = read_record(CIRCLE, displacement=5, force="7", time=1)
    raw = np.loadtxt(CIRCLE)
    np.testing.assert_allclose(record.displacement, 1e-3 * raw[:, 4], rtol=1e-14)
    np.testing.assert_allclose(record.force, raw[:, 6], rtol=1e-14)
    assert record.time is not None


def test_many_columns_without_header_are_listed() -> None:
    message = refusal(CIRCLE)
    assert "column 7 (149.425 first, 149.425 to 156.935) (in the first 200 rows)" in message
    assert "`displacement=...` and `force=...`" in message


def test_gaps_are_left_aside_in_the_range_of_a_listed_column(write: Write) -> None:
    message = refusal(write("nan,nan,nan\n" + "1,2,5\n3,4,6\n" * 9))
    assert "column 1 (nan first, 1 to 3), column 2 (nan first, 2 to 4)" in message


def test_the_snapping_record_is_read_like_any_other() -> None:
    assert len(read_record(PLASTIC)) == 2289


# ------------------------------------------------------------------------------------------ round trip

SEPARATORS = [",", ";", "\t", " ", "   ", ", ", " ; "]
ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252", "gbk"]
LENGTHS = {"m": 1.0, "mm": 1e-3, "MM": 1e-3, "cm": 1e-2, "um": 1e-6, "inch": 0.0254, "ft": 0.3048}
FORCES = {
    "N": 1.0,
    "kN": 1e3,
    "KN": 1e3,
    "mN": 1e-3,
    "lbf": 4.4482216152605,
    "kip": 4448.2216152605,
    "kgf": 9.80665,
}
HEADERS = ["none", "brackets", "parentheses", "slash", "underscore", "row", "preamble"]

values = st.floats(-4.0, 4.0).map(lambda value: value if abs(value) > 1e-9 else 0.0)
columns = st.lists(st.tuples(values, values), min_size=2, max_size=30).filter(
    lambda rows: all(np.ptp(column) > 0 for column in np.transpose(rows))
)


def _text(
    rows: list[tuple[float, float]],
    separator: str,
    decimal: str,
    header: str,
    x_unit: str,
    f_unit: str,
    end: str,
) -> str:
    styles = {
        "none": [],
        "brackets": [[f"Disp [{x_unit}]", f"Force [{f_unit}]"]],
        "parentheses": [[f"位移({x_unit})", f"力({f_unit})"]],
        "slash": [[f"Weg/{x_unit}", f"Kraft/{f_unit}"]],
        "underscore": [[f"displacement_{x_unit}", f"force_{f_unit}"]],
        "row": [["Displacement", "Load"], [x_unit, f_unit]],
        "preamble": [
            ["Operator: Joe"],
            ["Rate", "1000", "Hz", "x"],
            [],
            ["Position", "Load"],
            [f"({x_unit})", f"[{f_unit}]"],
        ],
    }
    lines = [separator.join(cells) for cells in styles[header]]
    lines += [separator.join(repr(value).replace(".", decimal) for value in row) for row in rows]
    return end.join(lines) + end


@settings(max_examples=300)
@given(
    rows=columns,
    separator=st.sampled_from(SEPARATORS),
    comma=st.booleans(),
    encoding=st.sampled_from(ENCODINGS),
    header=st.sampled_from(HEADERS),
    x_unit=st.sampled_from(sorted(LENGTHS)),
    f_unit=st.sampled_from(sorted(FORCES)),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
)
def test_every_way_of_writing_gives_the_same_numbers(
    rows: list[tuple[float, float]],
    separator: str,
    comma: bool,
    encoding: str,
    header: str,
    x_unit: str,
    f_unit: str,
    end: str,
) -> None:
    decimal = "," if comma and "," not in separator else "."
    text = _text(rows, separator, decimal, header, x_unit, f_unit, end)
    if encoding == "cp1252":
        text = text.replace("位移", "Auslenkung").replace("力", "Prüfkraft")
    options = {"displacement_unit": x_unit, "force_unit": f_unit} if header == "none" else {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.csv"
        path.write_bytes(text.encode(encoding))
        if header == "none" and encoding in ("utf-16-le", "utf-16-be"):
            assert path.read_bytes()[:2] not in (b"\xff\xfe", b"\xfe\xff")
        record = read_record(path, **options)
    np.testing.assert_allclose(record.displacement, [LENGTHS[x_unit] * x for x, _ in rows], rtol=1e-12)
    np.testing.assert_allclose(record.force, [FORCES[f_unit] * f for _, f in rows], rtol=1e-12)


@settings(max_examples=200)
@given(content=st.one_of(st.binary(max_size=300), st.text("0123456789.,;\t\n\r -+eE\"'#[]()mNxF\0", max_size=200)))
def test_garbage_is_refused_in_a_sentence_or_read(content: bytes | str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        record, message = None, ""
        try:
            record = read_record(path)
        except RecordError as error:
            message = str(error)
    assert record is not None or is_sentence(message)


# ------------------------------------------------------------------------------------------ layouts


@pytest.mark.parametrize(
    ("text", "encoding", "displacement", "force"),
    [
        ("Weg (µm);Prüfkraft (N)\n1,5;2\n3;4\n", "cp1252", 1.5e-6, 2.0),
        ("Größe;Weg;Kraft\n9;1,5;2\n9;3;4\n", "latin-1", 1.5e-3, 2.0),
        ("时间(s),位移(mm),试验力(kN),应力(MPa)\n0,1,2,3\n1,3,4,5\n", "gbk", 1e-3, 2000.0),
        ("Time,Disp,Force\n(s),(in),(lbf)\n-----,----,----\n0,1,2\n1,2,3\n", "utf-8", 0.0254, 8.896443230521),
        ('"Time","Disp","Force"\n"1,0","2,5","3"\n"2","4","5"\n', "utf-8", 2.5e-3, 3.0),
        ("# Time [s] Disp [mm] Force [kN]\n0 1 2\n1 2 3\n", "utf-8", 1e-3, 2000.0),
        ("  Time   Axial Disp   Force\n   0.0   1.0   2.0\n   1.0   2.0   3.0\n", "utf-8", 1e-3, 2.0),
        ("Time,Disp,Force,\n0,1,2,\n1,3,4,\n,,,\n,,,\n,,,\n,,,\n", "utf-8", 1e-3, 2.0),
        ("Operator,Joe,x\nRate,1000,Hz\nSize,10,20\n\nTime,Disp,Force\n0,1,2\n1,2,3\n", "utf-8", 1e-3, 2.0),
        ("date,Disp,Force,state\n2024-01-01 10:00,2,3,on\n2024-01-01 10:01,4,5,off\n", "utf-8", 2e-3, 3.0),
        ("F_m,x_m\n1,2\n2,3\n", "utf-8", 2.0, 1.0),
        ("mm,N\n1,2\n2,4\n", "utf-8", 1e-3, 2.0),
        ("Channel 1 [kN],Channel 2 [mm]\n1,2\n2,4\n", "utf-8", 2e-3, 1000.0),
        ("\n\n1\t2\n\n3\t4\n", "utf-8", 1e-3, 2.0),
    ],
)  # fmt: skip
def test_layouts(write: Write, text: str, encoding: str, displacement: float, force: float) -> None:
    record = read_record(write(text, encoding))
    assert len(record) == 2
    assert record.displacement[0] == pytest.approx(displacement, rel=1e-12)
    assert record.force[0] == pytest.approx(force, rel=1e-12)


@pytest.mark.parametrize("name", ["Axial Disp [mm]", "axial disp [MM]", "Axial_Disp", "AXIALDISP", "3", 3])
def test_a_column_is_found_by_name_or_number(write: Write, name: str | int) -> None:
    path = write("Force,Disp,Axial Disp [mm]\n1,2,3\n2,3,5\n")
    assert read_record(path, displacement=name).displacement[0] == pytest.approx(3e-3)


def test_a_header_of_digits_wins_over_the_number(write: Write) -> None:
    path = write("Time,3,Force\n1,2,3\n3,4,5\n")
    assert read_record(path, displacement="3", force="Force").displacement[0] == pytest.approx(2e-3)
    path = write("Time,3,2\n1,2,3\n3,4,5\n")
    assert read_record(path, displacement="3", force="2").displacement[0] == pytest.approx(2e-3)


def test_an_asked_unit_wins_over_the_file_which_is_reported(write: Write) -> None:
    record = read_record(write("x [mm],F [kN]\n1,2\n2,3\n"), displacement_unit="Inch", force_unit="lbs")
    assert record.displacement[0] == pytest.approx(0.0254)
    assert record.force[0] == pytest.approx(8.896443230521)
    assert any("though the file says 'mm'" in note for note in record.notes)


def test_a_row_of_units_wins_over_the_header(write: Write) -> None:
    record = read_record(write("x [mm],F [N]\ncm,kN\n1,2\n2,3\n"))
    assert (record.displacement[0], record.force[0]) == pytest.approx((0.01, 2000.0))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("Time,Disp,Force\n10:00,2,3\n10:01,4,5\n", "the text '10:00'"),
        ("Time,Disp,Force\n0,2,3\n,4,5\n1,4,5\n", "line 3, must hold a number, found an empty cell"),
        ("Time,Disp,Force\n1,2,3\n0,4,5\n", "does not increase"),
        ("Time [kg],Disp,Force\n0,2,3\n1,4,5\n", "is not a unit of time"),
        ("Time 1,Time 2,Disp,Force\n0,0,2,3\n1,1,4,5\n", "could hold it"),
    ],
)
def test_a_time_that_nobody_asked_for_does_no_harm(write: Write, text: str, why: str) -> None:
    record = read_record(write(text))
    assert record.time is None
    assert any("left out" in note and why in note for note in record.notes)


@pytest.mark.parametrize(
    ("header", "times", "seconds"),
    [
        ("Time", ["10:00:08.5", "10:00:09", "10:00:10.25"], [36008.5, 36009.0, 36010.25]),
        ("Time [s]", ["23:59:59", "00:00:00.5", "00:00:01"], [86399.0, 86400.5, 86401.0]),  # past midnight
        ("Timestamp", ["2024-02-28 23:59:59", "2024-02-29T00:00:00.5Z", "2024-03-01 00:00:00"], [0.0, 1.5, 86401.0]),
        ("Date", ["2024-02-28 23:59:59.9999", "2024-02-29 00:00:00.0001", "2024-02-29 00:00:00.0002"], [0, 2e-4, 3e-4]),
        ("Time [ms]", ["00:01.5", "00:02.0", "01:02.5"], [1.5, 2.0, 62.5]),
        ("Time", ["12:59:59 AM", "1:00:00 am", "1:00:01 p.m."], [3599.0, 3600.0, 46801.0]),
        ("Elapsed", ["0:00:01", "1 day, 0:00:01", "2 days, 0:00:00.5"], [1.0, 86401.0, 172800.5]),
    ],
)
def test_times_of_day_and_dates_are_read_as_seconds(
    write: Write, header: str, times: list[str], seconds: list[float]
) -> None:
    rows = "\n".join(f"{time};{k};{3 * k}" for k, time in enumerate(times))
    record = read_record(write(f"{header};Disp [mm];Force [N]\n{rows}\n"))
    assert record.time is not None
    assert record.time.tolist() == pytest.approx(seconds, rel=1e-15, abs=2e-11)  # rounding of a day
    assert any("read as seconds" in note for note in record.notes)


def test_times_with_and_without_dates_are_not_mixed(write: Write) -> None:
    times = ["2024-05-17 10:00:08", "10:00:09", "10:00:10", "10:00:11"]
    record = read_record(write("\n".join(["Time,Disp,Force", *(f"{time},{k},{k}" for k, time in enumerate(times))])))
    assert record.time is None


def test_a_time_of_day_that_is_none_is_named(write: Write) -> None:
    rows = [f"00:00:{k % 60:02d},{k % 7},{k % 7}" for k in range(60)] * 4
    path = write("\n".join(["Time,Disp,Force", *rows[:230], "noon,1,2", *rows[231:]]) + "\n")
    with pytest.raises(RecordError, match="line 232, column 1 'Time': must hold a time like the rows above"):
        read_record(path, time="Time")
    record = read_record(path)
    assert record.time is None
    assert any("left out" in note and "line 232" in note for note in record.notes)


def test_marks_between_thousands_are_no_decimal_marks(write: Write) -> None:
    with pytest.raises(RecordError, match=r"column 2 'Force': '1\.250' and '750' look like numbers with"):
        read_record(write("Disp;Force\n1.5;750\n2.5;1.250\n3.5;-2.000\n"))
    assert read_record(write("Disp;Force\n1.5;0.750\n2.5;1.250\n3.5;2\n")).force[1] == 1.25


def test_a_unit_of_time_that_was_given_is_not_passed_over(write: Write) -> None:
    with pytest.raises(RecordError, match=r"unit 'msecs\.' of the time is not known"):
        read_record(write("Time,Disp,Force\n0,1,2\n1,2,4\n"), time_unit="msecs.")


@pytest.mark.parametrize("end", ["3,", "3", "3,-", "3,1e", "3,nan\n", "End of test\n", "3,\n4,\n5\n", "3," + "\0" * 99])
def test_incomplete_rows_at_the_end_are_dropped_and_reported(write: Write, end: str) -> None:
    record = read_record(write("Disp,Force\n1,2\n2,4\n" + end))
    assert len(record) == 2
    assert any("at the end of the file (from line 4) left out" in note for note in record.notes)


@pytest.mark.parametrize(
    "text",
    [
        "a " * 30_000 + ",b\n1,2\n2,3\n",
        "x" + " " * 60_000 + "y\n1 2\n2 3\n",
        "x,F\n1,2\n2," + "9" * 60_000 + "x",
        "(" * 30_000 + ",F\n1,2\n2,3\n",
        "é" * 30_000,
        '"' * 60_000 + "\n1,2\n2,3\n",
    ],
)
def test_odd_texts_take_no_time(write: Write, text: str) -> None:
    start = time.perf_counter()
    with contextlib.suppress(RecordError):
        read_record(write(text, "cp1252"))
    assert time.perf_counter() - start < 5.0  # [s]; quadratic patterns take minutes


def test_line_numbers_hold_far_down_a_long_file(write: Write) -> None:
    rows = [f"{i * 0.001:.3f},{i}" for i in range(300_000)]
    rows[250_000] = "1.0,OVR"
    path = write("Notes\r\n\r\nDisp,Force\r\n" + "\r\n".join(rows) + "\r\n")
    assert "line 250004, column 2 'Force': must hold a number, found the text 'OVR'" in refusal(path)


# ------------------------------------------------------------------------------------------ refusals


@pytest.mark.parametrize(
    ("text", "options", "part"),
    [
        ("", {}, "the file is empty"),
        ("\n \n", {}, "the file is empty"),
        ("Disp,Force\n", {}, "found none in the first 1 lines, which begin with 'Disp,Force'"),
        ("Force\n1\n2\n", {}, "at least two columns of numbers"),
        ("Disp,Force\n1,2\n", {}, "at least 2 rows"),
        ("Disp,Force\n1,2\n1,3\n", {}, "column 1 'Disp': the displacement must change, found 0.001 in all 2"),
        ("Disp,Force\n1,2\n2,2\n", {}, "column 2 'Force': the force must change"),
        ("Disp,Force\n1,2\n2,ERR\n3,4", {}, "3, column 2 'Force': must hold a number, found the text 'ERR'"),
        ("Disp,Force\n1,2\n2,\n3,4\n", {}, "3, column 2 'Force': must hold a number, found an empty cell"),
        ("Disp,Force\n1,2\n2\n3,4\n", {}, "3, column 2 'Force': must hold a number, found only 1 of 2 cells"),
        ("Disp,Force\n1,2\n2,NaN\n3,4\n", {}, "3, column 2 'Force': must hold a finite number, found 'NaN'"),
        ("Disp,Force\n1,2\n2,inf\n", {}, "must hold a finite number, found 'inf'"),
        ("Disp,Force\n1,2\n2,1e999\n3,4\n", {}, "3, column 2 'Force': must hold a finite number"),
        ("Disp,Force\n,2\n2,3\n3,4\n", {}, "2, column 1 'Disp': must hold a number, found an empty cell"),
        ("Disp,Force\nERR,2\n1,2\n2,3\n", {}, "line 2, column 1: must hold a number like the rows below"),
        ("ERR,2.5\n1,2\n2,3\n", {}, "line 1, column 1: must hold a number"),
        ("Disp,Force\n1,2\n2,3,4\n3,4\n", {}, "line 3: must have 2 cells, found 3"),
        ("Disp;Force\n1.5;2\n2,5;3\n3.5;4", {}, "must hold a number, found the text '2,5'"),
        ('Disp,Force,Note\n1,2,"a"\n2,3,"b\n3,4,c\n4,5,"d"\n', {}, "line 3: must close each quotation mark"),
        ("Disp,Force\n1,2\n2,4\n,\n3,\n4,\n5,\n", {}, "line 4, column 1"),
        ("Disp,Force\n1,2\n2,4\n3,x\n", {}, "line 4, column 2 'Force'"),
        ("a,b\n1,2\n2,4\n", {}, "named like a displacement among column 1 'a' (1 first, 1 to 2)"),
        ("Force,Force 2,Disp\n1,2,3\n2,3,4\n", {"force": "x"}, "force column 'x' is not in the file"),
        ("Force 1,Force 2,Disp\n1,2,3\n2,3,4\n", {}, "could be the force"),
        ("Force,Force,Disp\n1,2,3\n2,3,4\n", {"force": "force"}, "must name one column"),
        ("Disp,Force\n1,2\n2,3\n", {"force": 3}, "force column must be 1 to 2, got 3"),
        ("Disp,Force\n1,2\n2,3\n", {"force": 0}, "force column must be 1 to 2, got 0"),
        ("Disp,Force\n1,2\n2,3\n", {"force": "²"}, "is not in the file"),
        ("Disp,Force\n1,2\n2,3\n", {"force": 2, "displacement": "force"}, "must not be both"),
        ("Disp,F,Temp\n1,2,3\n2,3,4\n", {"time": 1}, "named like a displacement among column 2 'F'"),
        ("Disp,Force\n1,2\n2,3\n", {"force_unit": "mm"}, "unit 'mm' of the force is a unit of length"),
        ("Disp,Force\n1,2\n2,3\n", {"force_unit": "mn"}, "could mean mN (millinewton) or MN (meganewton)"),
        ("Disp [foo],Force\n1,2\n2,3\n", {}, "unit 'foo' of the displacement is not known"),
        ("Disp [kN],Force [mm]\n1,2\n2,3\n", {}, "the columns look swapped"),
        ("disp_kN,force_mm\n1,2\n2,3\n", {"displacement_unit": "mm"}, "the columns look swapped"),
        ("Disp [m],Force\n1,2\n20,3\n", {}, "found 19 m with the unit m; is the unit mm?"),
        ("Disp,Force [kN]\n1,2\n2,3e8\n", {}, "found 3e+11 N with the unit kN; is the unit N?"),
        ("Disp,Force\n1,2\n2,\0\n2,3\n", {}, "line 3: must be text, found a NUL byte"),
        ("\x89PNG\r\n\x1a\n" + "\0\1\2" * 50, {}, "found a NUL byte"),
        ("Disp,Force\n1,2\n2," + "x" * 99 + "\n3,4\n", {}, repr("x" * 39 + "…")),
    ],
)  # fmt: skip
def test_refusals(write: Write, text: str, options: dict[str, object], part: str) -> None:
    assert part in refusal(write(text), **options)


def test_paths_that_are_no_file(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "missing.csv")
    assert "is a folder" in refusal(tmp_path)
    assert "cannot be read" in refusal(tmp_path / ("x" * 300))
    with pytest.raises(RecordError, match="not a possible path"):
        read_record("a\0b")


def test_sizes_are_limited(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write("Disp,Force\n1,2\n2,3\n")
    monkeypatch.setattr(source, "MAX_ROWS", 2)
    assert "must have at most 2 lines, found 3" in refusal(path)
    monkeypatch.setattr(content, "MAX_BYTES", 10)
    assert "has 19 bytes, and a record file may have at most 10" in refusal(path)


def test_an_unknown_reversal_is_refused() -> None:
    with pytest.raises(RecordError, match="`reverse` must be"):
        read_record(RUBBER, reverse="time")  # type: ignore[arg-type]


# ------------------------------------------------------------------------------------------ units and records


@pytest.mark.parametrize(
    ("quantity", "text", "expected"),
    [
        ("displacement", "µm", 1e-6),
        ("displacement", "μm", 1e-6),
        ("displacement", " [Inches] ", 0.0254),
        ("displacement", "mil", 2.54e-5),
        ("displacement", "毫米", 1e-3),
        ("force", "MN", 1e6),
        ("force", "mN", 1e-3),
        ("force", "kip", 4448.2216152605),
        ("force", "kp", 9.80665),
        ("force", "daN", 10.0),
        ("time", "Sec", 1.0),
        ("time", "ms", 1e-3),
        ("time", "min", 60.0),
    ],
)
def test_units(quantity: units.Quantity, text: str, expected: float) -> None:
    assert units.unit_factor(text, quantity) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("text", ["", "Mm", "kg", "N/mm", "m**9**9", "nan", "mm" * 1000, "1", "(9**9)"])
def test_no_lengths(text: str) -> None:
    with pytest.raises(RecordError, match="of the displacement"):
        units.unit_factor(text, "displacement")


@given(text=st.text(max_size=30))
def test_any_text_is_a_unit_or_refused(text: str) -> None:
    for quantity in ("displacement", "force", "time"):
        value, message = 0.0, ""
        try:
            value = units.unit_factor(text, quantity)
        except RecordError as error:
            message = str(error)
        assert value > 0.0 or is_sentence(message)


def test_a_record_is_a_read_only_copy() -> None:
    x = np.arange(6, dtype=np.float32)[::2]
    record = Record(x, [1, 2, 3], time=[0.0, 1.0, 2.0])
    x[0] = 7.0
    assert record.displacement.tolist() == [0.0, 2.0, 4.0]
    assert record.force.dtype == np.float64
    assert record.displacement.flags.c_contiguous
    with pytest.raises(ValueError, match="read-only"):
        record.force[0] = 0.0


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (([1.0, np.nan], [1, 2]), "`displacement` must be finite, got nan at index 1"),
        (([1.0, 2.0], [1, np.inf]), "`force` must be finite, got inf at index 1"),
        (([1.0], [1.0]), "at least 2 samples, got 1"),
        (([1.0, 2.0], [1.0, 2.0, 3.0]), "as many samples as `displacement`, got 3 and 2"),
        (([1.0, 2.0], [1.0, 2.0], [0.0]), "`time` must have at least 2"),
        (([[1.0, 2.0]], [1.0, 2.0]), "one dimension, got the shape (1, 2)"),
        ((["a", "b"], [1.0, 2.0]), "real numbers"),
        (([1j, 2.0], [1.0, 2.0]), "real numbers"),
        (([[1], [1, 2]], [1.0, 2.0]), "one dimension, got sequences of several lengths"),
        (([1, 10**400], [1.0, 2.0]), "real numbers, got Python objects, or integers too large for a double"),
        (([1.0, 2.0], np.ma.array([1.0, 2.0], mask=[True, False])), "`force` must have no masked samples"),
    ],
)
def test_impossible_arrays_are_refused(arguments: tuple[object, ...], part: str) -> None:
    with pytest.raises(RecordError) as caught:
        Record(*arguments)
    assert part in str(caught.value)


def test_numbers_of_a_big_file_agree_with_numpy(write: Write) -> None:
    table = np.random.default_rng(1).normal(size=(20_000, 4))
    buffer = io.StringIO()
    np.savetxt(buffer, table, delimiter="\t", header="t\tx\tF\tspare")
    record = read_record(write(buffer.getvalue()), displacement="X", force="f")
    np.testing.assert_allclose(record.displacement, 1e-3 * table[:, 1], rtol=1e-12)


# ------------------------------------------------------------------------------------------ single bad values


def cycles(samples: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [mm] and force [N] of three cycles with a loop."""
    phase = np.linspace(0.0, 6.0 * np.pi, samples)
    return 20.0 * np.sin(phase), 300.0 * np.sin(phase + 0.2)


def table(displacement: np.ndarray, force: np.ndarray) -> str:
    rows = "\n".join(f"{x!r},{r!r}" for x, r in zip(displacement.tolist(), force.tolist(), strict=True))
    return f"Displacement (mm),Force (N)\n\n{rows}\n"


def spike_notes(record: Record) -> list[str]:
    return [note for note in record.notes if "far outside" in note]


@pytest.mark.parametrize("value", [1e3, -1e3, 1e8])
def test_a_single_bad_force_is_reported_with_its_line(write: Write, value: float) -> None:
    displacement, force = cycles()
    force[200] = value
    (note,) = spike_notes(read_record(write(table(displacement, force))))
    # The header, a blank line and 200 samples lie above.
    assert f"force in line 203 ({value:.6g} N)" in note
    assert "correct or delete" in note


@pytest.mark.parametrize("value", [1e10, 1e200])
def test_an_impossible_force_is_refused_with_its_line(write: Write, value: float) -> None:
    displacement, force = cycles()
    force[200] = value
    message = refusal(write(table(displacement, force)))
    assert "line 203" in message
    assert "correct or delete the line" in message
    assert "is the unit" not in message


def test_an_impossible_displacement_is_no_matter_of_the_unit(write: Write) -> None:
    displacement, force = cycles()
    assert "is the unit um?" in refusal(write(table(1e3 * displacement, force)))
    assert "is the unit" not in refusal(write(table(1e190 * displacement, force)))
    displacement[200] = 4e198
    message = refusal(write(table(displacement, force)))
    assert "line 203" in message
    assert "is the unit" not in message


@pytest.mark.parametrize("scale", [1e-200, 1e-100])
def test_absurdly_small_numbers_are_refused(write: Write, scale: float) -> None:
    displacement, force = cycles()
    assert "check its unit" in refusal(write(table(scale * displacement, scale * force)))


def test_samples_that_stand_alone_are_found() -> None:
    _, force = cycles()
    assert find_spikes(force).size == 0
    force[[100, 300, 301, 302]] = 1000.0, -900.0, -950.0, -1e6
    assert find_spikes(force).tolist() == [100, 300, 301, 302]
    force[303:305] = -1e5
    # Five in a row are no single samples, and what they reach others may reach.
    assert find_spikes(force).size == 0


@pytest.mark.parametrize("samples", [2, 3, 4, 7, 20, 200])
@pytest.mark.parametrize("seed", range(20))
def test_few_samples_noise_and_coarse_sensors_are_no_spikes(samples: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    phase = np.arange(12 * samples) / samples
    amplitude = rng.uniform(0.2, 1.0, 12)[phase.astype(int)]
    wave = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * (phase + rng.uniform()))) if seed % 2 else np.sin(6.3 * phase)
    force = 300.0 * amplitude * wave * (1.0 + 0.03 * rng.standard_normal(phase.size))
    assert find_spikes(force).size == 0
    assert find_spikes(50.0 * np.round(force / 50.0)).size == 0


def test_a_preload_and_a_short_stroke_are_no_spikes() -> None:
    displacement, force = cycles()
    preloaded = force + 5000.0
    preloaded[0] = 0.0
    assert find_spikes(preloaded).size == 0
    displacement[200], force[200] = 100.0, 1500.0
    assert not any(found.size for found in spikes_of(displacement, force))


def test_real_records_have_no_spikes() -> None:
    for path, options in ((RUBBER, {}), (PLASTIC, {}), (CIRCLE, {"displacement": 5, "force": 7})):
        assert not spike_notes(read_record(path, **options))


def test_a_name_that_is_not_utf_8_is_made_printable(tmp_path: Path) -> None:
    path = tmp_path / "m\udcfc\n.csv"
    try:
        path.write_text(table(*cycles()), encoding="utf-8")
    except OSError:
        path = tmp_path / "m\n.csv"  # this file system takes UTF-8 only
        path.write_text(table(*cycles()), encoding="utf-8")
    record = read_record(path)
    record.path.encode("utf-8")
    assert record.path.isprintable()
    assert "\ufffd" in record.path
    assert Record([0.0, 1.0], [0.0, 1.0], path="m\udcfc.csv").path == "m\ufffd.csv"


def test_without_a_header_named_columns_may_leave_none(write: Write) -> None:
    path = write("1,2\n2,3\n4,9\n")
    message = refusal(path, time=1, force=2)
    assert "there is no header to find the displacement by" in message


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"displacement": 1.0}, "must be a name or a number from 1 on, got float"),
        ({"displacement_offset": 10**400}, "`displacement_offset` must be a finite number, got '1000"),
        ({"force_scale": "2"}, "`force_scale` must be a finite number > 0, got '2'"),
        ({"displacement_unit": 3}, "unit of the displacement must be text, such as 'mm', got 3"),
    ],
)
def test_options_of_other_types_are_refused(write: Write, options: dict[str, object], part: str) -> None:
    path = write("x,F\n1,2\n2,3\n4,9\n")
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    assert part in str(caught.value)
