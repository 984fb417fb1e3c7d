"""Records in binary formats: what the file holds is what a text would give, and what is no record is named."""

from __future__ import annotations

import hashlib
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from strandspring import RecordError, read_record
from strandspring.records import content
from strandspring.records.content import FileContent
from strandspring.records.formats import matlab, numpy_arrays, reader_process

pytestmark = pytest.mark.long

OF_PYTHON = {"mat", "mat_4", "mat_struct", "mat_timeseries", "mat_simulink", "npz", "gz", "bzip2", "xz", "zipped"}
OF_LIBRARIES = {
    "mat_73", "hdf5", "hdf5_compound", "xlsx", "xls", "ods", "tdms", "mdf_3", "mdf_4", "uff", "uff_binary",
    "parquet_file", "feather_file",
}  # fmt: skip
OFFICE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"


def refusal(path: Path, **options: Any) -> str:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    return sentence(caught.value, path)


def sentence(error: RecordError, path: Path) -> str:
    message = str(error)
    assert message.startswith(str(path))
    assert message.endswith((".", "?"))
    assert message.isprintable()
    assert "object at 0x" not in message
    return message


@pytest.mark.parametrize("name", sorted(OF_PYTHON | OF_LIBRARIES))
def test_each_format_gives_the_record_of_the_text_and_if_damaged_a_sentence(
    name: str, samples: Path, tmp_path: Path
) -> None:
    expected, record, data = read_record(samples / "plain.csv"), read_record(samples / name), samples / name
    # A data set of ASCII has 12 digits, and openpyxl writes 16; times of waveforms are made of a step.
    rtol = {"uff": 1e-11, "xlsx": 1e-15}.get(name, 0.0)
    np.testing.assert_allclose(record.displacement, expected.displacement, rtol=rtol)
    np.testing.assert_allclose(record.force, expected.force, rtol=rtol)
    np.testing.assert_allclose(record.time, expected.time, rtol=1e-12, atol=1e-12)
    assert any("the unit of displacement is mm (found in the file)" in note for note in record.notes)
    assert (record.path, record.sha256) == (str(data), hashlib.sha256(data.read_bytes()).hexdigest())
    whole, draw = data.read_bytes(), np.random.default_rng(7)
    spoiled = bytearray(whole)
    for place in draw.integers(0, len(whole), 8):
        spoiled[place] = draw.integers(256)
    for damaged in (whole[: max(12, len(whole) // 50)], whole[: len(whole) // 2], spoiled):
        (tmp_path / name).write_bytes(damaged)
        try:
            # TDMS, MDF and UFF can be read up to the end of the file.
            assert len(read_record(tmp_path / name)) <= len(expected)
        except RecordError as problem:
            sentence(problem, tmp_path / name)


@pytest.mark.parametrize(
    ("file", "options", "part"),
    [
        ("sqlite", {}, "is an SQLite database; export the record as CSV."),
        ("docx", {}, "is a Word document; export the record as CSV."),
        ("objects.npy", {}, "holds Python objects (a pickle)"),
        ("cells.mat", {}, "is a MATLAB file without columns of numbers"),
        ("object.mat", {}, "is a MATLAB file with objects (of a class such as timeseries or table)"),
        ("complex.mat", {}, "no column is named like a force"),
        ("linked.h5", {}, "no column is named like a force"),  # in another file, which is not followed
        ("zeros.mf4", {}, "is an MDF file that is damaged or cut off"),
        ("beyond.mf4", {}, "is an MDF file that is damaged or cut off"),  # a channel beyond its row
        ("declared.npy", {}, "is a NumPy array that is damaged or cut off"),
        ("declared.h5", {}, "must have at most 50000000 values, found 100000000000"),
        ("wide.xlsx", {}, "found 1048576 rows of 16384 columns"),
        ("rows.ods", {}, "must repeat at most 100000 filled rows, found"),
        ("columns.ods", {}, "must repeat at most 100000 filled cells, found"),
        ("runs.xlsx", {}, "'Run 1', 'Run 2' each hold a displacement and a force"),
        ("runs.xlsx", {}, "`displacement='Run 1/Weg [mm]'` `force='Run 1/Kraft [N]'`"),
        ("runs.xlsx", {"displacement": "Run 1/1", "force": "Run 2/2"}, "must be in one sheet"),
        ("text.xlsx", {}, "row 40, column 2 'Kraft': must hold a number, found the text 'broken'; correct or delete"),
        ("empty.xlsx", {}, "row 40, column 2 'Kraft': must hold a number, found an empty cell; correct or delete"),
        ("coarse.tdms", {}, "is too coarse to be interpolated"),
        ("untimed.tdms", {"displacement": 4, "force": 2}, "the channels chosen have no times; name another column."),
        ("lengths.npz", {}, "column 1 'displacement_mm' (161 values), column 2 'force_N' (156 values)"),
        ("infinite.npz", {}, "row 41, column 2 'force_N': must hold a finite number, found 'inf'; correct"),
        ("rows.mat", {}, "name the columns with `displacement=...` and `force=...`"),
        ("lot.zip", {}, "is a zip archive of 2 files ('a 13.csv', 'deep/b.csv'); name one of them as in lot.zip/a 13"),
        ("lot.zip/c.csv", {}, "'c.csv' is not in the zip archive, which holds 'a 13.csv', 'deep/b.csv'"),
        ("plain.csv/x.csv", {}, "is a file, but not a zip archive"),
        ("hidden.zip", {}, "name one of them as in hidden.zip/a\ufffdvsc.exe."),  # nothing turns what follows
        ("four", {}, "is compressed more than 2 times"),
        (pickle.dumps([1.0, 2.0]), {}, "is a Python pickle"),
        (b"%PDF-1.7\n1 0 obj", {}, "is a PDF document"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), {}, "is a PNG picture; give the numbers, not their plot."),
        (b"TDSh" + bytes(50), {}, "is the index of a TDMS file; give the .tdms file beside it."),
        (b"7z\xbc\xaf\x27\x1c" + bytes(50), {}, "is a 7-Zip archive; unpack it first."),
        (b"<!DOCTYPE html><table></table>", {}, "is an HTML page"),
        (OFFICE + bytes(600), {}, "document of the old kind"),
        (OFFICE + "EncryptedPackage".encode("utf-16-le"), {}, "save it without a password"),
        (b"\x00\x01\x02" * 100, {}, "found a NUL byte"),
    ],
)
def test_refusals_by_content(
    file: str | bytes, options: dict[str, Any], part: str, samples: Path, tmp_path: Path
) -> None:
    path = samples / file if isinstance(file, str) else tmp_path / "a.dat"
    if isinstance(file, bytes):
        path.write_bytes(file)
    assert part in refusal(path, **options)


@pytest.mark.parametrize(
    ("file", "options", "samples_read", "note"),
    [
        ("runs.xlsx", {"displacement": "Run 2/Weg"}, 161, "'Run 2' is read, as given"),
        ("text.xlsx", {"skip_bad_lines": True}, 57, "1 row that cannot be read left out; row 40 is the first"),
        ("inch.xlsx", {}, 3, "the unit of displacement is"),
        ("rates.tdms", {}, 2000, "is interpolated linearly onto the times of the finest channel, 0 to 1.999 s"),
        ("untimed.tdms", {}, 161, "time is left out: the channels chosen have none"),
        ("padded.npz", {}, 161, "9 empty rows at the end are left out"),
        ("short.npz", {}, 159, "2 incomplete rows at the end (from row 160) left out"),
        ("rows.mat", {"displacement": 2, "force": "3", "force_unit": "kN"}, 161, "the unit of force is kN"),
        ("two.npy", {"force_unit": "kN"}, 161, "the unit of force is kN (as given)"),
        ("lot.zip/a 13.csv", {}, 161, "'a 13.csv' unpacked from the zip archive"),
        ("lot.zip/deep/b.csv", {}, 161, "'deep/b.csv' unpacked from the zip archive"),
        ("frame.parquet", {}, 161, "the unit of displacement is mm"),
        ("own.h5", {}, 161, "interpolated linearly"),
    ],
)
def test_parts_of_files(file: str, options: dict[str, Any], samples_read: int, note: str, samples: Path) -> None:
    record, plain = read_record(samples / file, **options), read_record(samples / "plain.csv")
    assert any(note in each for each in record.notes), record.notes
    assert file == "own.h5" or len(record) == samples_read
    if file == "rates.tdms":  # a chord misses (2 pi/80)^2/8 of the amplitude of 12.5 mm
        expected = 0.057 + 0.0125 * np.sin(2.0 * np.pi * np.arange(2000) * 1e-3), np.cos(np.arange(2000) * 1e-3)
        np.testing.assert_allclose(record.displacement, expected[0], atol=1e-5)
        np.testing.assert_array_equal(record.force, expected[1])
    elif file == "runs.xlsx":
        np.testing.assert_allclose(record.force, 2e3 * record.displacement, rtol=1e-14)
    elif file == "inch.xlsx":
        np.testing.assert_allclose(record.displacement, 0.0254 * np.array([1, 2, 4]), rtol=1e-15)
    elif file == "own.h5":  # the force began half a second later
        assert record.time is not None
        assert 0.506 <= record.time[0] < record.time[-1] <= 2.0
        late = np.interp(record.time, plain.time + 0.506, 1e3 * plain.displacement)
        np.testing.assert_allclose(record.force, late, rtol=1e-12)
    elif samples_read > 57:
        np.testing.assert_allclose(record.displacement, plain.displacement[:samples_read], rtol=1e-15)
        scale = 1e-3 if file.endswith("npz") else 1.0  # given as N
        np.testing.assert_allclose(record.force, scale * plain.force[:samples_read], rtol=1e-15)


def test_a_missing_library_is_named(samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reader_process._stop_all()  # a process that has imported them already
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("h5py", "python_calamine", "xlrd", "nptdms", "asammdf", "pyuff", "pyarrow"):
        monkeypatch.delitem(sys.modules, name, raising=False)
        (tmp_path / f"{name}.py").write_text(f"raise ModuleNotFoundError(name={name!r})")
    assert all(len(read_record(samples / name)) == 161 for name in OF_PYTHON)
    for name in OF_LIBRARIES:
        assert refusal(samples / name).endswith('install it with pip install "strandspring[formats]".')
    reader_process._stop_all()


def test_what_unpacks_to_too_much_is_refused(samples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    workbook = tmp_path / "workbook"
    workbook.write_bytes((samples / "xlsx").read_bytes())
    with (
        zipfile.ZipFile(workbook, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("xl/sharedStrings.bin", "w") as member,
    ):
        for _ in range(content.MAX_UNPACKED_BYTES >> 20):
            member.write(bytes(1 << 20))
    assert "must unpack to at most 536870912 bytes, and holds more" in refusal(workbook)
    for module in (content, matlab):
        monkeypatch.setattr(module, "MAX_UNPACKED_BYTES", 2000)
    for name in ("gz", "bzip2", "xz", "zipped"):
        assert "must unpack to at most 2000 bytes, and holds more" in refusal(samples / name)
    for name, reader in (("mat", matlab), ("npz", numpy_arrays)):  # in another process, without the patch
        with pytest.raises(RecordError, match="must unpack to at most 2000 bytes, and holds more"):
            reader.read_tables(FileContent("a.dat", (samples / name).read_bytes(), ""))


@pytest.mark.parametrize("mark", ["PAR1", "RDX", "BZh", "ARROW1", "MDF", "PK", "BM"])
def test_a_name_like_the_mark_of_a_format_is_a_name(tmp_path: Path, mark: str) -> None:
    (tmp_path / "a.csv").write_text(f"{mark};Weg;Kraft\n" + "".join(f"{k};{k};{2 * k}\n" for k in range(9)))
    assert len(read_record(tmp_path / "a.csv")) == 9


def test_text_is_read_without_the_libraries_of_other_formats(samples: Path) -> None:
    program = (
        f"import sys; from strandspring import read_record; read_record({str(samples / 'plain.csv')!r});"
        "print([n for n in ('h5py', 'pyarrow', 'asammdf', 'nptdms', 'scipy', 'pydantic') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
