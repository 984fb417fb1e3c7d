"""Texts that test rigs write: what is read, what is left out where that is asked for, and what is no record."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomllib
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring import Record, RecordError, read_record
from strandspring.records import content, source, text_table, units
from strandspring.records.spikes import find_spikes, spikes_of

ROOT = Path(__file__).resolve().parents[2]
CASES = tomllib.loads(Path(__file__).with_name("dialects.toml").read_text("utf-8"))


def read(text: str | bytes, **options: Any) -> Record:
    """The record of a file with this content."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "record.csv")
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_record(path, **options)


def refusal(text: str | bytes, **options: Any) -> str:
    """The one sentence in which a content is refused; it begins with the path where the file is at fault."""
    with pytest.raises(RecordError) as caught:
        read(text, **options)
    message = str(caught.value)
    assert message.isprintable()
    assert message.endswith((".", "?"))
    return message


@pytest.mark.parametrize(("text", "encoding", "displacement", "force"), CASES["layouts"])
def test_layouts(text: str, encoding: str, displacement: float, force: float) -> None:
    record = read(text.encode(encoding))
    assert len(record) == 2
    assert (record.displacement[0], record.force[0]) == pytest.approx((displacement, force), rel=1e-12)


@pytest.mark.parametrize("case", CASES["noted"])
def test_notes_say_how_a_text_was_read(case: dict[str, Any]) -> None:
    assert list(read(case["text"], **case.get("options", {})).notes) == case["notes"]


@pytest.mark.parametrize(("header", "cells", "seconds"), CASES["times"])
def test_times_of_day_and_dates_are_read_as_seconds(header: str, cells: list[str], seconds: list[float]) -> None:
    rows = "\n".join(f"{cell};{k};{3 * k}" for k, cell in enumerate(cells))
    record = read(f"{header};Disp [mm];Force [N]\n{rows}\n")
    assert record.time == pytest.approx(seconds, rel=1e-15, abs=2e-11)  # rounding of a day
    assert any("read as seconds" in note for note in record.notes)


@pytest.mark.parametrize(("text", "why"), CASES["times_left_out"])
def test_a_time_that_nobody_asked_for_does_no_harm(text: str, why: str) -> None:
    record = read(text)
    assert record.time is None
    assert any("left out" in note and why in note for note in record.notes)


@pytest.mark.parametrize("end", CASES["cut_ends"])
@pytest.mark.parametrize("skip", [False, True])
def test_a_cut_end_is_dropped_and_said(end: str, skip: bool) -> None:
    record = read("Disp,Force\n1,2\n2,4\n" + end, skip_bad_lines=skip)
    assert len(record) == 2
    assert any("rows at the end are left out." in note and "from line 4" in note for note in record.notes)


@pytest.mark.parametrize(("text", "options", "part"), CASES["refused"])
def test_refusals(text: str, options: dict[str, Any], part: str) -> None:
    assert part in refusal(text, **options)


@pytest.mark.parametrize("name", CASES["third_column"])
def test_a_column_is_found_by_name_or_number(name: str | int) -> None:
    text = "Force,Disp,Axial Disp [mm]\n1,2,3\n2,3,5\n"
    assert read(text, displacement=name).displacement[0] == pytest.approx(3e-3)
    # A header of digits wins over the number.
    assert read("Time,3,2\n1,2,3\n3,4,5\n", displacement="3", force="2").displacement[0] == pytest.approx(2e-3)


def test_an_asked_unit_wins_over_a_row_of_units_and_that_over_the_header() -> None:
    text = "x [mm],F [kN]\ncm,N\n1,2\n2,3\n"
    assert (read(text).displacement[0], read(text).force[0]) == pytest.approx((0.01, 2.0))
    record = read(text, displacement_unit="Inch", force_unit="lbs", reverse="force", force_offset=1.0, force_scale=2.0)
    assert (record.displacement[0], record.force[0]) == pytest.approx((0.0254, -2.0 * 4.4482216152605))
    assert any("though the file says 'cm'" in note for note in record.notes)


@pytest.mark.parametrize(("quantity", "text", "factor"), CASES["units"])
def test_units(quantity: units.Quantity, text: str, factor: float) -> None:
    assert units.unit_factor(text, quantity) == pytest.approx(factor, rel=1e-13)


@pytest.mark.parametrize("text", CASES["no_lengths"])
def test_what_is_no_length_is_refused(text: str) -> None:
    with pytest.raises(RecordError, match=r"of the displacement.*[.?]$"):
        units.unit_factor(text, "displacement")


# -- whatever is written


LENGTHS = {"m": 1.0, "mm": 1e-3, "MM": 1e-3, "cm": 1e-2, "um": 1e-6, "inch": 0.0254, "ft": 0.3048}
FORCES = {"N": 1.0, "kN": 1e3, "KN": 1e3, "mN": 1e-3, "lbf": 4.4482216152605, "kip": 4448.2216152605, "kgf": 9.80665}
HEADERS = {
    "none": [],
    "brackets": ["Disp [{x}]|Force [{f}]"],
    "parentheses": ["位移({x})|力({f})"],
    "slash": ["Weg/{x}|Kraft/{f}"],
    "underscore": ["displacement_{x}|force_{f}"],
    "row": ["Displacement|Load", "{x}|{f}"],
    "preamble": ["Operator: Joe", "Rate|1000|Hz|x", "", "Position|Load", "({x})|[{f}]"],
}
VALUES = st.floats(-4.0, 4.0).map(lambda value: value if abs(value) > 1e-9 else 0.0)
ROWS = st.lists(st.tuples(VALUES, VALUES), min_size=2, max_size=30).filter(
    lambda rows: all(np.ptp(column) > 0 for column in np.transpose(rows))
)


@settings(max_examples=100)
@given(ROWS, st.data())
def test_every_way_of_writing_gives_the_same_numbers(rows: list[tuple[float, float]], data: st.DataObject) -> None:
    separator = data.draw(st.sampled_from([",", ";", "\t", " ", "   ", ", ", " ; "]))
    decimal = "," if "," not in separator and data.draw(st.booleans()) else "."
    encoding = data.draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252", "gbk"]))
    header, x, f = (data.draw(st.sampled_from(sorted(table))) for table in (HEADERS, LENGTHS, FORCES))
    lines = [line.format(x=x, f=f).replace("|", separator) for line in HEADERS[header]]
    lines += [separator.join(repr(value).replace(".", decimal) for value in row) for row in rows]
    text = "".join(line + data.draw(st.just("\n") if k else st.sampled_from("\n\r")) for k, line in enumerate(lines))
    if encoding == "cp1252":
        text = text.replace("位移", "Auslenkung").replace("力", "Prüfkraft")
    ending = data.draw(st.sampled_from(["\n", "\r\n", "\r"]))
    options = {"displacement_unit": x, "force_unit": f} if header == "none" else {}
    record = read(text.replace("\r", "\n").replace("\n", ending).encode(encoding), **options)
    np.testing.assert_allclose(record.displacement, [LENGTHS[x] * row[0] for row in rows], rtol=1e-12)
    np.testing.assert_allclose(record.force, [FORCES[f] * row[1] for row in rows], rtol=1e-12)


@settings(max_examples=50)
@given(ROWS, st.booleans())
def test_a_saved_record_is_read_bit_for_bit(rows: list[tuple[float, float]], timed: bool) -> None:
    columns = np.transpose(rows)
    record = Record(*columns, np.arange(len(rows)) / 3.0 if timed else None)
    with tempfile.TemporaryDirectory() as folder:
        for unit, rtol in (("m", 0.0), ("mm", 2.3e-16)):
            record.save(Path(folder, "a.csv"), unit)  # type: ignore[arg-type]
            again = read_record(Path(folder, "a.csv"))
            np.testing.assert_allclose(again.displacement, record.displacement, rtol=rtol)
            np.testing.assert_array_equal(again.force, record.force)
            assert (again.time is not None) is timed
        with pytest.raises(ValueError, match="`displacement_unit` must be 'm' or 'mm'"):
            record.save(Path(folder, "a.csv"), "cm")  # type: ignore[arg-type]


# -- lines that cannot be read


PHASE = np.linspace(0.0, 6.0 * np.pi, 200)
# Exact in binary, so that what is read can be compared bit for bit.
X, F = (np.round(size * np.sin(PHASE + lead) * 64.0) / 64.0 for size, lead in ((16.0, 0.0), (900.0, 0.1)))


def damaged(lines: dict[int, str], separator: str = ",") -> str:
    """A record in which lines, counted from 1, are replaced."""
    text = [f"x [mm]{separator}F [N]", *(f"{x!r}{separator}{f!r}" for x, f in np.column_stack([X, F]).tolist())]
    for number, line in lines.items():
        text[number - 1] = line
    return "\n".join(text) + "\n"


FIRST, *OTHERS = CASES["bad_lines"]


@pytest.mark.parametrize(
    ("line", "found", "numbers"),
    # At most a tenth of all.
    [*((*FIRST, numbers) for numbers in ((2, 31), (31, 201), (*range(31, 51),))), *((*row, (31,)) for row in OTHERS)],
)
def test_bad_lines_are_left_out_and_counted(line: str, found: str, numbers: tuple[int, ...]) -> None:
    text = damaged(dict.fromkeys(numbers, line))
    if numbers[0] != 2:  # what lies above a table may be a title
        assert refusal(text).endswith("or leave out such lines with `skip_bad_lines=True`.")
        assert f"line {numbers[0]}{found}" in refusal(text)
    record = read(text, skip_bad_lines=True)
    kept = np.delete(np.arange(200), np.array(numbers) - 2)
    np.testing.assert_array_equal(record.force, F[kept])
    np.testing.assert_array_equal(record.displacement, 1e-3 * X[kept])
    (note,) = (note for note in record.notes if "cannot be read" in note)
    assert f"Some lines cannot be read and are left out. ({len(numbers)}, the first in line {numbers[0]}" in note


def test_what_is_not_left_out() -> None:
    refused = refusal(damaged(dict.fromkeys(range(40, 61), "ERR,ERR")), skip_bad_lines=True)
    assert "more than a tenth of the lines cannot be read" in refused
    # Without numbers with marks between thousands, which are the largest, the loop would lose its ends.
    for separator, line in ((";", "1.5;1,020.5"), (",", "1.5,1,020.5")):
        refused = refusal(damaged({20: f"ERR{separator}1", 31: line}, separator), skip_bad_lines=True)
        assert "such lines hold the largest numbers and are not left out" in refused
    # A missing cell between blanks does not move the others.
    rows = [f"{x!r} {f!r} {k}" for k, (x, f) in enumerate(np.column_stack([X, F]).tolist())]
    record = read("\n".join(["x F t", *rows[:29], "1.0 14.5", *rows[30:]]) + "\n", skip_bad_lines=True)
    np.testing.assert_array_equal(record.force, np.delete(F, 29))


def test_a_faulty_time_costs_its_line_or_where_nobody_asked_for_it_the_column() -> None:
    rows = [f"00:00:{k % 60:02d},{k % 7},{k % 7}" for k in range(60)] * 4
    text = "\n".join(["Time,Disp,Force", *rows[:230], "noon,1,2", *rows[231:]]) + "\n"
    assert "line 232, column 1 'Time': must hold a time like the rows above" in refusal(text, time="Time")
    assert read(text).time is None
    skipped = read(text, time="Time", skip_bad_lines=True)
    assert (len(skipped), skipped.time is not None) == (239, True)


@pytest.mark.parametrize("odd", CASES["unusual"])
def test_a_large_table_is_read_in_parts_as_by_rows(odd: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same bits, and the same refusals, with numbers in all the ways in which programs write them."""
    draw, forms = np.random.default_rng(5), (repr, "{:.6e}".format, "{:+.3E}".format, "  {:.12f} ".format)
    table = np.column_stack([np.arange(600) * 1e-3, draw.standard_normal((600, 2))]).tolist()
    rows = [",".join(forms[int(draw.integers(4))](value) for value in row) for row in table]
    rows[400] = odd
    text, parts, outcomes = "t [s],x [mm],F [N]\n" + "\n".join(rows)[:-3], text_table.plain_parts, []
    sizes: list[int] = []

    def counted(*arguments: Any) -> Any:
        for values, size in parts(*arguments):
            sizes.append(len(values))
            yield values, size

    monkeypatch.setattr(text_table, "plain_parts", counted)
    monkeypatch.setattr(text_table, "_PART", 1 << 10)
    for least in (1 << 60, 0):
        monkeypatch.setattr(text_table, "_LEAST", least)
        assert not sizes
        try:
            record = read(text)
            outcomes.append((record.displacement.tobytes(), record.force.tobytes(), record.time is None, record.notes))
        except RecordError as error:
            outcomes.append(("", "", False, (str(error).partition("record.csv")[2],)))
    assert outcomes[0] == outcomes[1]
    assert sum(sizes) > 300 or '"' in odd


# -- files, records and single bad values


def test_paths_and_sizes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RecordError, match="not a possible path"):
        read_record("a\0b")
    odd = tmp_path / "m\n\udcfc.csv"  # not UTF-8
    odd.write_text("x,F\n1,2\n2,3\n")
    assert read_record(odd).path == str(tmp_path / "m\ufffd\ufffd.csv")
    monkeypatch.setattr(source, "MAX_ROWS", 2)
    assert "must have at most 2 lines, found 3" in refusal("Disp,Force\n1,2\n2,3\n")
    monkeypatch.setattr(content, "MAX_BYTES", 10)
    assert "has 19 bytes, and a record file may have at most 10" in refusal("Disp,Force\n1,2\n2,3\n")


def test_a_record_is_a_read_only_copy() -> None:
    x = np.arange(6, dtype=np.float32)[::2]
    record = Record(x, [1, 2, 3], [0.0, 1.0, 1.0])
    x[0] = 7.0
    assert record.displacement.tolist() == [0.0, 2.0, 4.0]
    assert record.force.dtype == np.float64
    assert record.rising_time is None
    with pytest.raises(ValueError, match="read-only"):
        record.force[0] = 0.0


def cycles(value: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [mm] and force [N] of three cycles with a loop, and one value that is not the spring's."""
    phase = np.linspace(0.0, 6.0 * np.pi, 600)
    force = 300.0 * np.sin(phase + 0.2)
    if value is not None:
        force[200] = value
    return 20.0 * np.sin(phase), force


def table(displacement: np.ndarray, force: np.ndarray) -> str:
    rows = "\n".join(f"{x!r},{r!r}" for x, r in zip(displacement.tolist(), force.tolist(), strict=True))
    return f"Displacement (mm),Force (N)\n\n{rows}\n"


def test_a_single_bad_value_is_named_by_its_line() -> None:
    for value in (1e3, -1e3, 1e8):
        (note,) = (note for note in read(table(*cycles(value))).notes if "far outside" in note)
        assert f"force {value:.6g} N in line 203" in note
    for value in (1e10, 1e200):
        message = refusal(table(*cycles(value)))
        assert "line 203" in message
        assert "correct or delete the line" in message
        assert "is the unit" not in message
    x, force = cycles()
    assert "is the unit um?" in refusal(table(1e3 * x, force))
    assert "check its unit" in refusal(table(1e-200 * x, force))


@pytest.mark.parametrize("samples", [2, 3, 4, 7, 20, 200])
def test_spikes_are_few_samples_that_stand_alone(samples: int) -> None:
    _, force = cycles()
    force[[100, 300, 301, 302]] = 1000.0, -900.0, -950.0, -1e6
    assert find_spikes(force).tolist() == [100, 300, 301, 302]
    force[303:305] = -1e5  # five in a row are no single samples, and what they reach others may reach
    assert find_spikes(force).size == 0
    # Noise, coarse sensors, a preload and a short stroke are none.
    for seed in range(10):
        draw, phase = np.random.default_rng(seed), np.arange(12 * samples) / samples
        wave = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * (phase + draw.uniform())))
        noisy = 300.0 * draw.uniform(0.2, 1.0, 12)[phase.astype(int)] * wave
        noisy *= 1.0 + 0.03 * draw.standard_normal(phase.size)
        assert find_spikes(noisy).size == find_spikes(50.0 * np.round(noisy / 50.0)).size == 0
    x, force = cycles()
    assert find_spikes(np.r_[0.0, force[1:] + 5000.0]).size == 0
    x[200], force[200] = 100.0, 1500.0
    assert not any(found.size for found in spikes_of(x, force))
