"""Records in binary formats: what the file holds is what a text would give, and what is no record is named."""

from __future__ import annotations

import bz2
import contextlib
import gc
import gzip
import hashlib
import io
import lzma
import pickle
import sqlite3
import subprocess
import sys
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import asammdf
import h5py
import nptdms
import numpy as np
import odf.opendocument
import odf.table
import odf.text
import openpyxl
import pandas as pd
import pyarrow as pa
import pytest
import pyuff
import xlwt
from pyarrow import feather, parquet
from scipy.io import savemat
from scipy.io.matlab import MatlabObject

from strandspring.errors import RecordError
from strandspring.records import content
from strandspring.records.content import FileContent
from strandspring.records.formats import matlab, numpy_arrays, reader_process
from strandspring.records.reading import read_record
from strandspring.records.record import Record

pytestmark = pytest.mark.long

T = np.linspace(0.0, 2.0, 161)
X = 12.5 * np.sin(2.0 * np.pi * T) + 57.0  # [mm]
R = 0.35 * np.sin(2.0 * np.pi * T) + 0.05 * np.sign(np.cos(2.0 * np.pi * T)) + 0.8  # [kN]
RATE = 80.0  # [Hz], of T

Write = Callable[[Path], None]


def text() -> str:
    rows = (f"{t!r},{x!r},{r!r}" for t, x, r in zip(T.tolist(), X.tolist(), R.tolist(), strict=True))
    return "\n".join(["time [s],displacement [mm],force [kN]", *rows]) + "\n"


def refusal(path: Path, **options: object) -> str:
    with pytest.raises(RecordError) as caught:
        read_record(path, **options)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert message.endswith(".")
    assert message.isprintable()
    return message


def rows() -> list[list[float]]:
    return np.column_stack([T, X, R]).tolist()


def mat(path: Path) -> None:
    savemat(path, {"time_s": T, "displacement_mm": X, "force_kN": R, "comment": "made by a test"}, do_compression=True)


def mat_4(path: Path) -> None:
    savemat(path, {"time_s": T, "displacement_mm": X, "force_kN": R}, format="4")


def mat_struct(path: Path) -> None:
    savemat(path, {"rig": {"time_s": T, "displacement_mm": X, "force_kN": R, "operator": "A"}, "note": "x"})


def mat_timeseries(path: Path) -> None:
    series = {"displacement": {"time": T, "data": X, "units": "mm"}, "force": {"time": T, "data": R, "units": "kN"}}
    savemat(path, series)


def mat_simulink(path: Path) -> None:
    fields = np.empty(2, dtype=[("values", object), ("label", object)])
    fields[0], fields[1] = (X[:, None], "displacement [mm]"), (R[:, None], "force [kN]")
    savemat(path, {"log": {"time": T[:, None], "signals": fields}})


def mat_73(path: Path) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("time_s", T), ("displacement_mm", X), ("force_kN", R)):
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        note = file.create_dataset("note", data=np.frombuffer(b"text", np.uint8).astype(np.uint16)[None, :])
        note.attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#").create_dataset("a", data=np.arange(9.0))
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def hdf5(path: Path) -> None:
    with h5py.File(path, "w") as file:
        rig = file.create_group("run 1/rig")
        for name, values, unit in (("time", T, "s"), ("displacement", X, "mm"), ("force", R, "kN")):
            rig.create_dataset(name, data=values, compression="gzip").attrs["units"] = unit
        rig.create_dataset("serial", data=7)
        rig["elsewhere"] = h5py.ExternalLink("other.h5", "/x")
        rig["again"] = h5py.SoftLink("/run 1/rig/force")


def hdf5_compound(path: Path) -> None:
    table = np.empty(T.size, dtype=[("time [s]", float), ("displacement [mm]", float), ("force [kN]", float)])
    for name, values in zip(table.dtype.names or (), (T, X, R), strict=True):
        table[name] = values
    with h5py.File(path, "w") as file:
        file["table"] = table


def xlsx(path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["Test of a spring"])
    sheet.append([])
    sheet.append(["time", "displacement", "force"])
    sheet.append(["s", "mm", "kN"])
    for row in rows():
        sheet.append(row)
    for _ in range(3):
        sheet.append([None, "", None])
    book.create_sheet("settings").append(["operator", "A", 1.0])
    book.save(path)


def xls(path: Path) -> None:
    book = xlwt.Workbook()
    sheet = book.add_sheet("rig")
    for i, row in enumerate([["time [s]", "displacement [mm]", "force [kN]"], *rows()]):
        for k, cell in enumerate(row):
            sheet.write(i, k, cell)
    book.save(str(path))


def ods(path: Path) -> None:
    document = odf.opendocument.OpenDocumentSpreadsheet()
    table = odf.table.Table(name="rig")
    for row in [["time [s]", "displacement [mm]", "force [kN]"], *rows()]:
        made = odf.table.TableRow()
        for value in row:
            kind = {"valuetype": "string"} if isinstance(value, str) else {"valuetype": "float", "value": repr(value)}
            cell = odf.table.TableCell(**kind)
            cell.addElement(odf.text.P(text=str(value)))
            made.addElement(cell)
        table.addElement(made)
    document.spreadsheet.addElement(table)
    document.save(str(path))


def tdms(path: Path) -> None:
    wave = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("rig", "displacement", X, {"unit_string": "mm", **wave}),
                nptdms.ChannelObject("rig", "force", R, {"unit_string": "kN", **wave}),
                nptdms.ChannelObject("remarks", "text", ["a", "b"]),
            ]
        )


def mdf(path: Path, version: str = "4.10") -> None:
    signals = [
        asammdf.Signal(X, T, name="displacement", unit="mm"),
        asammdf.Signal(R, T, name="force", unit="kN"),
    ]
    with asammdf.MDF(version=version) as file:
        file.append(signals, comment="rig")
        file.save(path, overwrite=True)


def mdf_3(path: Path) -> None:
    made = path.with_suffix(".mdf")
    mdf(made, "3.30")
    made.rename(path)


def mdf_4(path: Path) -> None:
    made = path.with_suffix(".mf4")
    mdf(made)
    made.rename(path)


def uff(path: Path, *, binary: bool = False) -> None:
    made = path.with_suffix(".uff")
    none = dict.fromkeys(("id2", "id3", "id4", "id5", "rsp_ent_name", "ref_ent_name"), "NONE")
    for axis in ("abscissa", "ordinate", "orddenom", "z_axis"):
        none |= dict.fromkeys((f"{axis}_axis_lab", f"{axis}_axis_units_lab", "z_axis_axis_lab"), "NONE")
    zeros = dict.fromkeys(("func_id", "ver_num", "load_case_id", "z_axis_value"), 0)
    for axis in ("abscissa", "ordinate", "orddenom", "z_axis"):
        zeros |= {f"{axis}_{name}_unit_exp": 0 for name in ("len", "force", "temp")} | {f"{axis}_spec_data_type": 0}
    nodes = dict.fromkeys(("rsp_node", "rsp_dir", "ref_node", "ref_dir"), 1)
    for name, values, unit, kind in (("displacement", X, "mm", 8), ("force", R, "kN", 9)):
        own = {"id1": name, "data": values, "x": T, "ordinate_spec_data_type": kind, "ordinate_axis_units_lab": unit}
        base = {"type": 58, "func_type": 1, "ord_data_type": 4, "abscissa_spacing": 1, "abscissa_spec_data_type": 17}
        file = pyuff.UFF(str(made))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves files open when it writes
            file.write_sets({**none, **zeros, **nodes, **base, **own, "binary": int(binary)}, "add")
            gc.collect()
    made.rename(path)


def uff_binary(path: Path) -> None:
    uff(path, binary=True)


def arrow_table() -> pa.Table:
    units = (("time", T, "s"), ("displacement", X, "mm"), ("force", R, "kN"))
    schema = pa.schema([pa.field(name, pa.float64(), metadata={"unit": unit}) for name, _, unit in units])
    return pa.table([values for _, values, _ in units], schema=schema)


def parquet_file(path: Path) -> None:
    parquet.write_table(arrow_table(), path)


def feather_file(path: Path) -> None:
    feather.write_feather(arrow_table(), str(path))


def npz(path: Path) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, time_s=T, displacement_mm=X, force_kN=R, seed=np.array(3))


def gz(path: Path) -> None:
    path.write_bytes(gzip.compress(text().encode()))


def bzip2(path: Path) -> None:
    path.write_bytes(bz2.compress(text().encode()))


def xz(path: Path) -> None:
    path.write_bytes(lzma.compress(text().encode()))


def zipped(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("__MACOSX/._record.csv", b"\0")
        archive.writestr("lot/record.csv", text())


FORMATS: dict[str, Write] = {
    each.__name__: each
    for each in (
        mat, mat_4, mat_struct, mat_timeseries, mat_simulink, mat_73, hdf5, hdf5_compound, xlsx, xls, ods, tdms, mdf_3,
        mdf_4, uff, uff_binary, parquet_file, feather_file, npz, gz, bzip2, xz, zipped,
    )
}  # fmt: skip


@cache
def content_of(name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        FORMATS[name](path)
        return path.read_bytes()


@pytest.fixture(params=FORMATS)
def made(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    # No suffix: the content decides.
    path = tmp_path / request.param
    path.write_bytes(content_of(request.param))
    return path


def as_text(tmp_path: Path) -> Record:
    (tmp_path / "record.csv").write_text(text())
    return read_record(tmp_path / "record.csv")


def test_each_format_gives_the_record_of_the_text(made: Path, tmp_path: Path) -> None:
    expected, record = as_text(tmp_path), read_record(made)
    # A data set of ASCII has 12 digits, and openpyxl writes 16.
    rtol = {"uff": 1e-11, "xlsx": 1e-15}.get(made.name, 0.0)
    np.testing.assert_allclose(record.displacement, expected.displacement, rtol=rtol)
    np.testing.assert_allclose(record.force, expected.force, rtol=rtol)
    # The times of waveforms and of UFF are made of a step, the reference of ISO units.
    assert record.time is not None
    assert expected.time is not None
    np.testing.assert_allclose(record.time, expected.time, rtol=1e-12, atol=1e-12)
    assert any("the unit of displacement is mm (found in the file)" in note for note in record.notes)


def test_the_file_stays_as_it_is_named_and_digested(made: Path) -> None:
    record = read_record(made)
    assert record.path == str(made)
    assert record.sha256 == hashlib.sha256(made.read_bytes()).hexdigest()


# ------------------------------------------------------------------------------ damaged files, other kinds


def test_what_is_cut_off_is_read_or_refused_in_a_sentence(made: Path) -> None:
    data = made.read_bytes()
    for share in (0.02, 0.5, 0.98):
        made.write_bytes(data[: max(12, int(share * len(data)))])
        try:
            # TDMS, MDF and UFF can be read up to the end of the file.
            assert len(read_record(made)) <= T.size
        except RecordError as problem:
            message = str(problem)
            assert message.startswith(str(made))
            assert message.endswith((".", "?"))
            assert message.isprintable()


def test_damaged_bytes_are_read_or_refused_in_a_sentence(made: Path) -> None:
    data = np.frombuffer(made.read_bytes(), np.uint8)
    generator = np.random.default_rng(7)
    for _ in range(3):
        damaged = data.copy()
        damaged[generator.integers(0, data.size, 8)] = generator.integers(0, 256, 8)
        made.write_bytes(damaged.tobytes())
        try:
            read_record(made)
        except RecordError as problem:
            message = str(problem)
            assert message.startswith(str(made))
            assert message.isprintable()


def test_other_kinds_are_named(tmp_path: Path) -> None:
    def sqlite(path: Path) -> None:
        with contextlib.closing(sqlite3.connect(path)) as base:
            base.execute("create table t (x)")
            base.commit()

    def docx(path: Path) -> None:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("[Content_Types].xml", "<Types/>")
            archive.writestr("word/document.xml", "<w/>")

    def objects(path: Path) -> None:
        with path.open("wb") as file:
            np.save(file, np.array([{}, None], dtype=object), allow_pickle=True)

    kinds: list[tuple[Write | bytes, str]] = [
        (sqlite, "is an SQLite database; export the record as CSV."),
        (docx, "is a Word document; export the record as CSV."),
        (objects, "holds Python objects (a pickle)"),
        (pickle.dumps([1.0, 2.0]), "is a Python pickle"),
        (b"%PDF-1.7\n1 0 obj", "is a PDF document"),
        (b"\x89PNG\r\n\x1a\n" + bytes(50), "is a PNG picture; give the numbers, not their plot."),
        (b"TDSh" + bytes(50), "is the index of a TDMS file; give the .tdms file beside it."),
        (b"7z\xbc\xaf\x27\x1c" + bytes(50), "is a 7-Zip archive; unpack it first."),
        (b"<!DOCTYPE html><table></table>", "is an HTML page"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "is an Office document of the old kind"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + "EncryptedPackage".encode("utf-16-le"), "save it without a password"),
        (b"\x00\x01\x02" * 100, "found a NUL byte"),
    ]
    for number, (make, expected) in enumerate(kinds):
        path = tmp_path / f"{number}.dat"
        if isinstance(make, bytes):
            path.write_bytes(make)
        else:
            make(path)
        assert expected in refusal(path)


@pytest.mark.parametrize("name", ["PAR1", "RDX", "BZh", "ARROW1", "MDF", "PK", "BM"])
def test_a_name_like_the_mark_of_a_format_is_a_name(tmp_path: Path, name: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"{name};Weg;Kraft\n" + "".join(f"{k};{k};{2 * k}\n" for k in range(9)))
    assert len(read_record(path)) == 9


def test_matlab_objects_are_not_read(tmp_path: Path) -> None:
    savemat(tmp_path / "cells.mat", {"c": np.array(["a", "bc"], dtype=object), "title": "no numbers"})
    assert "is a MATLAB file without columns of numbers" in refusal(tmp_path / "cells.mat")
    fields = np.empty((1, 1), dtype=[("Time", object), ("Data", object)])
    fields[0, 0] = (T, X)
    savemat(tmp_path / "object.mat", {"series": MatlabObject(fields, "timeseries")})
    assert "is a MATLAB file with objects (of a class such as timeseries or table)" in refusal(tmp_path / "object.mat")


def test_a_missing_library_is_named(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    libraries = ("h5py", "python_calamine", "xlrd", "nptdms", "asammdf", "pyuff", "pyarrow")
    reader_process._stop_all()  # a process that has imported them already
    (tmp_path / "missing").mkdir()
    for name in libraries:
        monkeypatch.delitem(sys.modules, name, raising=False)
        (tmp_path / "missing" / f"{name}.py").write_text(f"raise ModuleNotFoundError(name={name!r})")
    monkeypatch.syspath_prepend(tmp_path / "missing")
    needed = {"mat_73", "hdf5", "hdf5_compound", "xlsx", "xls", "ods", "tdms", "mdf_3", "mdf_4", "uff", "uff_binary",
              "parquet_file", "feather_file"}  # fmt: skip
    if made.name in needed:
        assert refusal(made).endswith('install it with pip install "strandspring[formats]".')
    else:
        assert len(read_record(made)) == T.size
    reader_process._stop_all()


# ------------------------------------------------------------------------------ sheets, groups, rates


def test_of_several_sheets_one_is_named(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    for number, factor in ((1, 1.0), (2, 2.0)):
        sheet = book.create_sheet(f"Run {number}")
        for row in [["Weg [mm]", "Kraft [N]"], *([x, factor * x] for x in X.tolist())]:
            sheet.append(row)
    path = tmp_path / "runs.xlsx"
    book.save(path)
    message = refusal(path)
    assert "'Run 1', 'Run 2' each hold a displacement and a force" in message
    assert "`displacement='Run 1/Weg [mm]'` `force='Run 1/Kraft [N]'`" in message
    record = read_record(path, displacement="Run 2/Weg")
    np.testing.assert_allclose(record.force, 2e3 * record.displacement, rtol=1e-14)
    assert "'Run 2' is read, as given" in record.notes
    np.testing.assert_array_equal(read_record(path, force="Run 2/2").force, record.force)
    assert "must be in one sheet" in refusal(path, displacement="Run 1/1", force="Run 2/2")


def test_damaged_cells_of_a_sheet_are_named_by_their_row(tmp_path: Path) -> None:
    path = tmp_path / "damaged.xlsx"
    for cell, expected in (("broken", "found the text 'broken'"), (None, "found an empty cell")):
        book = openpyxl.Workbook()
        sheet = book.active
        assert sheet is not None
        sheet.append(["Weg", "Kraft"])
        for number in range(2, 60):
            sheet.append([float(number), cell if number == 40 else 1.5 * number])
        book.save(path)
        message = refusal(path)
        assert "row 40, column 2 'Kraft'" in message
        assert expected in message
        assert "; correct or delete the row, or leave out such rows with `" in message


def test_inches_and_remarks_in_a_sheet(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    for row in [['Weg ["]', "Kraft [N]", "remark"], [1, 2.0, 'size 5"'], [2, 3, "two\nlines\tof it"], [4, 5.0, "ok"]]:
        sheet.append(row)
    book.save(tmp_path / "inch.xlsx")
    np.testing.assert_allclose(
        read_record(tmp_path / "inch.xlsx").displacement, 0.0254 * np.array([1, 2, 4]), rtol=1e-15
    )


def test_a_sheet_of_few_cells_far_apart_is_refused(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet["A1"], sheet["XFD1048576"] = 1.0, 2.0
    book.save(tmp_path / "wide.xlsx")
    assert "found 1048576 rows of 16384 columns" in refusal(tmp_path / "wide.xlsx")


def two_groups(path: Path, force: np.ndarray, rate: float) -> None:
    wave = {"wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("slow", "Weg", X, {"unit_string": "mm", "wf_increment": 1.0 / RATE, **wave}),
                nptdms.ChannelObject("fast", "Kraft", force, {"unit_string": "N", "wf_increment": 1.0 / rate, **wave}),
            ]
        )


def test_groups_of_two_rates_are_brought_to_the_finer_one(tmp_path: Path) -> None:
    time = np.arange(0.0, 2.0, 1e-3)
    two_groups(tmp_path / "rates.tdms", np.cos(time), 1000.0)
    record = read_record(tmp_path / "rates.tdms")
    assert any("is interpolated linearly onto the times of the finest channel, 0 to 1.999 s" in n for n in record.notes)
    np.testing.assert_allclose(record.time, time, atol=1e-12)
    np.testing.assert_array_equal(record.force, np.cos(time))
    # (2 pi/80)^2/8 of the amplitude is what a chord of the sine misses.
    np.testing.assert_allclose(1e3 * record.displacement, 12.5 * np.sin(2 * np.pi * time) + 57.0, atol=12.5 * 8e-4)


def test_a_channel_that_is_too_coarse_is_not_interpolated(tmp_path: Path) -> None:
    time = np.arange(0.0, 2.0, 1e-3)
    two_groups(tmp_path / "coarse.tdms", np.cos(time), 1000.0)
    with nptdms.TdmsWriter(tmp_path / "coarse.tdms") as writer:
        step = {"wf_increment": 0.1, "wf_start_offset": 0.0}
        coarse = 12.5 * np.sin(2 * np.pi * np.arange(0.0, 2.0, 0.1))
        writer.write_segment(
            [
                nptdms.ChannelObject("slow", "Weg", coarse, {"unit_string": "mm", **step}),
                nptdms.ChannelObject("fast", "Kraft", np.cos(time), {"unit_string": "N", "wf_increment": 1e-3}),
            ]
        )
    message = refusal(tmp_path / "coarse.tdms")
    assert "is too coarse to be interpolated" in message
    assert "export them at one sampling rate" in message


def test_channels_of_two_lengths_without_times_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "lengths.npz", displacement_mm=X, force_N=R[:-5])
    message = refusal(tmp_path / "lengths.npz")
    assert "column 1 'displacement_mm' (161 values), column 2 'force_N' (156 values)" in message


def test_own_times_of_two_groups_are_honoured(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "own.h5", "w") as file:
        for group, name, values, shift in (("a", "displacement_mm", X, 0.0), ("b", "force_N", 2 * X, 0.506)):
            file[f"{group}/{name}"], file[f"{group}/time_s"] = values, T + shift
    record = read_record(tmp_path / "own.h5")
    assert record.time is not None
    assert 0.506 <= record.time[0] < record.time[-1] <= 2.0
    np.testing.assert_allclose(1e3 * record.displacement, np.interp(record.time, T, X), rtol=1e-12)
    np.testing.assert_allclose(record.force, 2 * np.interp(record.time, T + 0.506, X), rtol=1e-12)


def test_not_a_number_in_a_channel(tmp_path: Path) -> None:
    path = tmp_path / "nan.npz"
    padded = np.append(R, [np.nan] * 9)
    np.savez(path, displacement_mm=np.append(X, [np.nan] * 9), force_N=padded, time=np.append(T, np.zeros(9)))
    assert "9 empty rows at the end are left out" in read_record(path).notes
    broken = R.copy()
    broken[-2:] = np.nan
    np.savez(path, displacement_mm=X, force_N=broken)
    record = read_record(path)
    assert len(record) == T.size - 2
    assert any("2 incomplete rows at the end (from row 160) left out" in note for note in record.notes)
    broken[40] = np.inf
    np.savez(path, displacement_mm=X, force_N=broken)
    assert "row 41, column 2 'force_N': must hold a finite number, found 'inf'; correct" in refusal(path)


def test_matrices_have_numbered_columns(tmp_path: Path) -> None:
    np.save(tmp_path / "two.npy", np.column_stack([X, R]))
    np.testing.assert_array_equal(read_record(tmp_path / "two.npy").displacement, 1e-3 * X)
    savemat(tmp_path / "rows.mat", {"data": np.stack([T, X, R]), "gain": 3.0})
    assert "name the columns with `displacement=...` and `force=...`" in refusal(tmp_path / "rows.mat")
    record = read_record(tmp_path / "rows.mat", time=1, displacement=2, force="3", force_unit="kN")
    np.testing.assert_array_equal(record.force, 1e3 * R)


def test_units_of_a_parquet_file_may_be_in_its_names(tmp_path: Path) -> None:
    moments = pd.Timestamp("2026-01-01") + pd.to_timedelta(T, unit="s")
    frame = pd.DataFrame({"Zeit": moments, "Weg [mm]": X, "Kraft [kN]": R, "operator": "A"})
    frame.to_parquet(tmp_path / "frame.parquet")
    record = read_record(tmp_path / "frame.parquet")
    np.testing.assert_array_equal(record.force, 1e3 * R)
    np.testing.assert_allclose(record.time, T, atol=1e-6)


# ------------------------------------------------------------------------------ compressed files, archives


def test_a_file_in_an_archive_is_named(tmp_path: Path) -> None:
    path = tmp_path / "lot.zip"
    mat(tmp_path / "b.mat")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a 13.csv", text())
        archive.write(tmp_path / "b.mat", "deep/b.mat")
    assert "is a zip archive of 2 files ('a 13.csv', 'deep/b.mat'); name one of them as in lot.zip/a 13.csv" in refusal(
        path
    )
    for name in ("a 13.csv", "deep/b.mat"):
        record = read_record(path / name)
        assert f"{name!r} unpacked from the zip archive" in record.notes
        assert record.path == str(path / name)
        np.testing.assert_array_equal(record.force, 1e3 * R)
    assert "'c.csv' is not in the zip archive, which holds 'a 13.csv', 'deep/b.mat'" in refusal(path / "c.csv")
    (tmp_path / "plain.csv").write_text(text())
    assert "is a file, but not a zip archive" in refusal(tmp_path / "plain.csv" / "x.csv")
    gz(tmp_path / "twice")
    (tmp_path / "four").write_bytes(gzip.compress(gzip.compress(gzip.compress((tmp_path / "twice").read_bytes()))))
    assert "is compressed more than 2 times" in refusal(tmp_path / "four")


def test_what_unpacks_to_too_much_is_refused(made: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readers = {"mat": matlab, "npz": numpy_arrays}  # in another process, which knows nothing of the patch
    monkeypatch.setattr(content, "MAX_UNPACKED_BYTES", 2000)
    monkeypatch.setattr(matlab, "MAX_UNPACKED_BYTES", 2000)
    if made.name in ("gz", "bzip2", "xz", "zipped"):
        assert "must unpack to at most 2000 bytes, and holds more" in refusal(made)
    elif made.name in readers:
        with pytest.raises(RecordError, match="must unpack to at most 2000 bytes, and holds more"):
            readers[made.name].read_tables(FileContent("a.dat", made.read_bytes(), ""))


@pytest.mark.parametrize("name", ["xlsx", "ods"])
def test_a_workbook_that_unpacks_to_too_much_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(content_of(name))
    blanks = bytes(1024 * 1024)
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("xl/sharedStrings.bin", "w") as member,
    ):
        for _ in range(content.MAX_UNPACKED_BYTES // len(blanks)):
            member.write(blanks)
    assert "must unpack to at most 536870912 bytes, and holds more" in refusal(path)


def test_a_declared_size_costs_nothing(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "bomb.h5", "w") as file:
        for name in ("displacement_mm", "force_N"):
            file.create_dataset(name, shape=(10**11,), chunks=(10**6,), dtype=float)
    assert "must have at most 50000000 values, found 100000000000" in refusal(tmp_path / "bomb.h5")
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 2)})
    (tmp_path / "bomb.npy").write_bytes(header.getvalue() + bytes(64))
    assert "is a NumPy array that is damaged or cut off" in refusal(tmp_path / "bomb.npy")


def test_links_out_of_a_file_are_not_followed(tmp_path: Path) -> None:
    hdf5(tmp_path / "other.h5")
    with h5py.File(tmp_path / "linked.h5", "w") as file:
        file["displacement_mm"] = X
        file["force_N"] = h5py.ExternalLink("other.h5", "/run 1/rig/force")
    assert "no column is named like a force" in refusal(tmp_path / "linked.h5")


def test_text_is_read_without_the_libraries_of_other_formats(tmp_path: Path) -> None:
    (tmp_path / "record.csv").write_text(text())
    program = (
        f"import sys; from strandspring import read_record; read_record({str(tmp_path / 'record.csv')!r});"
        "print([n for n in ('h5py', 'pyarrow', 'asammdf', 'nptdms', 'scipy', 'pydantic') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# ------------------------------------------------------------------------------ what random files have found


def test_the_time_base_is_a_column_only_where_there_are_times(tmp_path: Path) -> None:
    path = tmp_path / "mixed.tdms"
    wave = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        channels = (("displacement", X, {}), ("force", R, {}), ("other", T, wave))
        writer.write_segment([nptdms.ChannelObject("rig", *channel) for channel in channels])
    assert "time is left out: the channels chosen have none" in read_record(path).notes
    message = refusal(path, displacement=4, force=2)
    assert message.endswith("column 4 'time': the channels chosen have no times; name another column.")


def test_names_that_turn_or_hide_what_follows_are_not_shown(tmp_path: Path) -> None:
    path = tmp_path / "turned.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a\u202evsc.exe", text())
        archive.writestr("b\u2028\u200b.csv", text())
    assert refusal(path).endswith("name one of them as in turned.zip/a\ufffdvsc.exe.")


def test_a_refusal_shows_no_objects_of_the_program(tmp_path: Path) -> None:
    path = tmp_path / "a.mf4"
    mdf(path)
    path.write_bytes(path.read_bytes()[:8] + bytes(300))
    message = refusal(path)
    assert "object at 0x" not in message
    assert "is an MDF file that is damaged or cut off" in message


def test_a_sheet_that_repeats_cells_without_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "repeated.ods"
    ods(path)
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for what in (b"rows", b"columns"):
        repeated = b"table:number-" + what + b'-repeated="1000000000"'
        element = b"<table:table-row" if what == b"rows" else b"<table:table-cell"
        with zipfile.ZipFile(path, "w") as archive:
            for name, data in members.items():
                archive.writestr(
                    name, data.replace(element, element + b" " + repeated) if name == "content.xml" else data
                )
        message = refusal(path)
        assert f"must repeat at most 100000 filled {what.decode().replace('columns', 'cells')}, found" in message


def test_complex_numbers_are_no_channel(tmp_path: Path) -> None:
    savemat(tmp_path / "complex.mat", {"displacement_mm": X, "force_N": R + 1j})
    assert "no column is named like a force" in refusal(tmp_path / "complex.mat")
