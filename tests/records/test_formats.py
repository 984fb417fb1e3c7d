"""Records in binary formats: what the file holds is what a text would give, and what is no record is named."""

from __future__ import annotations

import bz2
import gc
import gzip
import lzma
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import asammdf
import h5py
import nptdms
import numpy as np
import openpyxl
import pandas as pd
import pyarrow as pa
import pytest
import pyuff
import xlwt
from pyarrow import feather, parquet
from scipy.io import savemat

from strandspring.errors import RecordError
from strandspring.records.reading import read_record
from strandspring.records.record import Record

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
    frame = pd.DataFrame(rows(), columns=["time [s]", "displacement [mm]", "force [kN]"])
    frame.to_excel(path, engine="odf", index=False)


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


@pytest.fixture(params=FORMATS)
def made(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    # No suffix: the content decides.
    path = tmp_path / request.param
    FORMATS[request.param](path)
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
