"""Files of the binary formats made of columns, in the various ways in which programs lay them out."""

from __future__ import annotations

import bz2
import contextlib
import gc
import gzip
import io
import lzma
import random
import warnings
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import asammdf
import h5py
import nptdms
import numpy as np
import openpyxl
import pyarrow as pa
import pyuff
import xlwt
from pyarrow import feather, parquet
from scipy.io import savemat
from scipy.sparse import csc_array

from targets.made import ABSURD_INTEGERS, chance
from targets.made_records import Piece

Write = Callable[[random.Random, Path, Sequence[Piece]], None]

_DTYPES = ("f8", "f8", "f4", ">f8", "i4", "i2", "u1", "f2")


def _typed(dice: random.Random, values: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return values.astype(dice.choice(_DTYPES)) if chance(dice, 0.2) else values


def _identifiers(pieces: Sequence[Piece]) -> list[str]:
    """Names of variables with units, all different."""
    made: list[str] = []
    for piece in pieces:
        name = "".join(c for c in f"{piece.name}_{piece.unit}" if c.isascii() and (c.isalnum() or c == "_"))[:30]
        name = name if name[:1].isalpha() else f"v{name}"
        made.append(f"{name[:25]}_{len(made)}" if name in made else name)
    return made


def _printable(text: str, most: int = 60) -> str:
    """A name that writers of files take."""
    return "".join(c for c in text if c.isprintable() and not "\ud800" <= c <= "\udfff")[:most]


def mat(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    columns = {name: _typed(dice, p.values)[:, None] for name, p in zip(_identifiers(pieces), pieces, strict=True)}
    match dice.randrange(7):
        case 0:
            holds: dict[str, object] = {"rig": columns}
        case 1:
            time = next((p.values for p in pieces if p.quantity == "time"), pieces[0].values)
            holds = {p.quantity: {"time": time, "data": p.values, "units": p.unit} for p in pieces}
        case 2:
            holds = {"data": np.stack([p.values for p in pieces])}
        case 3:
            fields = np.empty(len(pieces), dtype=[("values", object), ("label", object)])
            for k, piece in enumerate(pieces):
                fields[k] = (piece.values[:, None], _printable(piece.name))
            holds = {"log": {"time": pieces[0].values[:, None], "signals": fields}}
        case 4:
            cells = np.empty(2, dtype=object)
            cells[:] = ["a", np.eye(3)]
            holds = {
                **columns,
                "cells": cells,
                "sparse": csc_array(np.eye(9)),
                "z": np.ones(4) * 1j,
                "b": np.array([True]),
            }
        case _:
            holds = {**columns, "comment": "made by a fuzzer"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        savemat(path, holds, do_compression=chance(dice, 0.5))


def mat_4(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    columns = {name: p.values[:, None] for name, p in zip(_identifiers(pieces), pieces, strict=True)}
    if chance(dice, 0.3):
        columns |= {"sparse": csc_array(np.eye(9)), "text": "abc"}
    savemat(path, columns, format="4")


def mat_73(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("rig") if chance(dice, 0.3) else file
        for name, piece in zip(_identifiers(pieces), pieces, strict=True):
            group.create_dataset(name, data=piece.values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        note = file.create_dataset("note", data=np.frombuffer(b"text", np.uint8).astype(np.uint16)[None, :])
        note.attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#").create_dataset("a", data=np.arange(9.0))
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def hdf5(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    names = _identifiers(pieces)
    with h5py.File(path, "w", libver=dice.choice((("earliest", "v108"), ("latest", "latest"), None))) as file:
        if chance(dice, 0.2):
            table = np.empty(pieces[0].values.size, dtype=[(name, float) for name in names])
            for name, piece in zip(names, pieces, strict=True):
                table[name] = piece.values
            file["table"] = table
            return
        rig = file.create_group(dice.choice(("rig", "run 1/rig", "/".join("abcdefgh"))))
        for name, piece in zip(names, pieces, strict=True):
            kind = dice.choice(
                (
                    {},
                    {},
                    {"compression": "gzip"},
                    {"chunks": (2,)},
                    {"shuffle": True, "fletcher32": True, "chunks": (1,)},
                    {"compression": "lzf"},
                    {"scaleoffset": 3},
                )
            )
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                values = piece.values.astype("i4") if "scaleoffset" in kind else _typed(dice, piece.values)
                rig.create_dataset(name, data=values, **kind).attrs["units"] = _printable(piece.unit)
        if chance(dice, 0.4):
            rig.create_dataset("serial", data=7)
            rig.create_dataset("text", data=["a", "b"], dtype=h5py.string_dtype())
            rig.create_dataset("ragged", (3,), dtype=h5py.vlen_dtype(np.float64))
            rig.create_dataset("kind", data=[0, 1], dtype=h5py.enum_dtype({"A": 0, "B": 1}))
            rig["z"] = np.array([1 + 1j, 2.0])
            rig["elsewhere"] = h5py.ExternalLink("other.h5", "/x")
            rig["loop"] = h5py.SoftLink(rig.name)
            rig["self"] = rig
            rig.create_dataset("huge", shape=(10**11,), chunks=(10**6,), dtype=float)
            rig.create_dataset("pair", shape=(10**8, 2), chunks=(10**4, 2), dtype=float)


def npz(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    columns = {name: _typed(dice, p.values) for name, p in zip(_identifiers(pieces), pieces, strict=True)}
    if chance(dice, 0.2):
        columns |= {
            "seed": np.array(3),
            "texts": np.array(["a", "b"]),
            "times": np.array(["2024-01-01", "NaT"], "M8[s]"),
        }
    with path.open("wb") as file:
        (np.savez_compressed if chance(dice, 0.5) else np.savez)(file, **columns)


def npy(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    table = np.column_stack([p.values for p in pieces])
    if chance(dice, 0.4):
        table = np.rec.fromarrays(list(table.T), names=_identifiers(pieces))
    elif chance(dice, 0.3):
        table = np.asfortranarray(table)
    with path.open("wb") as file:
        np.save(file, table)


def xls(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    book = xlwt.Workbook()
    sheet = book.add_sheet("rig")
    for k, piece in enumerate(pieces):
        sheet.write(0, k, _printable(f"{piece.name} [{piece.unit}]", 200))
        for i, value in enumerate(piece.values.tolist()[:400], 1):
            if np.isfinite(value):
                sheet.write(i, k, value)
    if chance(dice, 0.3):
        book.add_sheet("settings").write(3, 3, xlwt.Formula("1/0"))
    book.save(str(path))


def tdms(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    wave = {"wf_increment": 0.0125, "wf_start_offset": 0.0} if chance(dice, 0.6) else {}
    channels = [
        nptdms.ChannelObject(
            dice.choice(("rig", "rig", "two")),
            _printable(p.name) or f"c{k}",
            _typed(dice, p.values).astype("=f8"),
            {"unit_string": _printable(p.unit), **wave},
        )
        for k, p in enumerate(pieces)
    ]
    if chance(dice, 0.3):
        channels.append(nptdms.ChannelObject("remarks", "text", ["a", "b"]))
        channels.append(nptdms.ChannelObject("remarks", "moments", np.array(["2024-01-01", "2024-01-02"], "M8[us]")))
    with nptdms.TdmsWriter(path) as writer:
        for _ in range(dice.choice((1, 1, 2))):
            writer.write_segment(list({channel.path: channel for channel in channels}.values()))


def _mdf(dice: random.Random, path: Path, pieces: Sequence[Piece], version: str, suffix: str) -> None:
    time = 0.0125 * np.arange(pieces[0].values.size)
    signals = [
        asammdf.Signal(
            _typed(dice, p.values).astype("=f8"), time, name=_printable(p.name) or f"c{k}", unit=_printable(p.unit)
        )
        for k, p in enumerate(pieces)
        if p.quantity != "time"
    ]
    made = path.with_suffix(suffix)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with asammdf.MDF(version=version) as file:
            if chance(dice, 0.3):
                for signal in signals:
                    file.append([signal])
            else:
                file.append(signals, comment="rig")
            compression = dice.randrange(0, 3) if version >= "4.10" else 0
            file.save(made, overwrite=True, compression=compression)
    made.rename(path)


def mdf_3(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    _mdf(dice, path, pieces, dice.choice(("3.30", "3.10", "2.14")), ".mdf")


def mdf_4(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    _mdf(dice, path, pieces, dice.choice(("4.10", "4.00", "4.11")), ".mf4")


def uff(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    made = path.with_suffix(".uff")
    none = dict.fromkeys(("id2", "id3", "id4", "id5", "rsp_ent_name", "ref_ent_name"), "NONE")
    for axis in ("abscissa", "ordinate", "orddenom", "z_axis"):
        none |= dict.fromkeys((f"{axis}_axis_lab", f"{axis}_axis_units_lab", "z_axis_axis_lab"), "NONE")
    zeros = dict.fromkeys(("func_id", "ver_num", "load_case_id", "z_axis_value"), 0)
    for axis in ("abscissa", "ordinate", "orddenom", "z_axis"):
        zeros |= {f"{axis}_{name}_unit_exp": 0 for name in ("len", "force", "temp")} | {f"{axis}_spec_data_type": 0}
    nodes = dict.fromkeys(("rsp_node", "rsp_dir", "ref_node", "ref_dir"), 1)
    even = int(chance(dice, 0.6))
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        for piece in pieces:
            kind = {"displacement": 8, "force": 9}.get(piece.quantity, 0)
            time = 0.0125 * np.arange(piece.values.size)
            own = {
                "id1": _printable(piece.name)[:40] or "NONE",
                "data": piece.values,
                "x": time,
                "ordinate_spec_data_type": kind,
                "ordinate_axis_units_lab": _printable(piece.unit)[:18] or "NONE",
            }
            base = {
                "type": 58,
                "func_type": 1,
                "ord_data_type": dice.choice((2, 4, 4)),
                "abscissa_spacing": even,
                "abscissa_spec_data_type": 17,
            }
            file = pyuff.UFF(str(made))
            file.write_sets({**none, **zeros, **nodes, **base, **own, "binary": int(chance(dice, 0.5))}, "add")
        gc.collect()
    made.rename(path)


def _arrow(dice: random.Random, pieces: Sequence[Piece]) -> pa.Table:
    names = [_printable(p.name) for p in pieces]
    fields = [
        pa.field(name, pa.float64(), metadata={"unit": _printable(p.unit)})
        for name, p in zip(names, pieces, strict=True)
    ]
    table = pa.table([p.values for p in pieces], schema=pa.schema(fields))
    if chance(dice, 0.3):
        size = table.num_rows
        table = table.append_column("text", pa.array(["a"] * size)).append_column("list", pa.array([[1.0]] * size))
        table = table.append_column("kind", pa.array(["a"] * size).dictionary_encode()).append_column(
            "holes", pa.array([None, *[1.0] * (size - 1)])
        )
    return table


def parquet_file(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    compression = dice.choice(("none", "snappy", "gzip", "zstd", "brotli", "lz4"))
    extra = dice.choice(
        (
            {},
            {"use_dictionary": False},
            {"data_page_version": "2.0"},
            {"row_group_size": 7},
            {"write_statistics": False},
        )
    )
    parquet.write_table(_arrow(dice, pieces), path, compression=compression, **extra)


def feather_file(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    feather.write_feather(_arrow(dice, pieces), str(path), compression=dice.choice(("uncompressed", "lz4", "zstd")))


def xlsx(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    for row in [["Test of a spring"], []] if chance(dice, 0.3) else []:
        sheet.append(row)
    sheet.append([_printable(piece.name, 300) for piece in pieces])
    sheet.append([_printable(piece.unit, 300) for piece in pieces])
    for row in np.column_stack([p.values for p in pieces]).tolist():
        sheet.append([value if np.isfinite(value) else "#NUM!" for value in row])
    if chance(dice, 0.3):
        book.create_sheet("settings").append(["operator", "A", 1.0])
    book.save(path)


def ods(dice: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    """An OpenDocument sheet, written as text, since odfpy takes a second for it."""

    def cell(value: str | float) -> str:
        repeated = f' table:number-columns-repeated="{dice.choice(ABSURD_INTEGERS)}"' if chance(dice, 0.0005) else ""
        if isinstance(value, str):
            text = f"<text:p>{escape(value)}</text:p>"
            return f'<table:table-cell{repeated} office:value-type="string">{text}</table:table-cell>'
        value_type = f'office:value-type="float" office:value="{value!r}"'
        return f"<table:table-cell{repeated} {value_type}><text:p>{value}</text:p></table:table-cell>"

    lines: list[list[str | float]] = [[_printable(f"{p.name} [{p.unit}]", 200) for p in pieces]]
    lines += np.column_stack([p.values for p in pieces]).tolist()
    rows = []
    for line in lines:
        repeated = f' table:number-rows-repeated="{dice.choice(ABSURD_INTEGERS)}"' if chance(dice, 0.0005) else ""
        rows.append(f"<table:table-row{repeated}>{''.join(map(cell, line))}</table:table-row>")
    namespaces = " ".join(
        f'xmlns:{name}="urn:oasis:names:tc:opendocument:xmlns:{name}:1.0"'
        for name in ("office", "table", "text", "style")
    )
    content = (
        f'<?xml version="1.0" encoding="UTF-8"?><office:document-content {namespaces} office:version="1.2">'
        "<office:body>"
        f"<office:spreadsheet><table:table table:name={quoteattr('rig')}>{''.join(rows)}"
        '<table:table-row table:number-rows-repeated="1048000">'
        '<table:table-cell table:number-columns-repeated="16384"/></table:table-row>'
        "</table:table></office:spreadsheet></office:body></office:document-content>"
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet", zipfile.ZIP_STORED)
        archive.writestr("content.xml", content)
        archive.writestr(
            "META-INF/manifest.xml",
            '<?xml version="1.0"?><m:manifest xmlns:m="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0">'
            '<m:file-entry m:full-path="/" m:media-type="application/vnd.oasis.opendocument.spreadsheet"/>'
            '<m:file-entry m:full-path="content.xml" m:media-type="text/xml"/></m:manifest>',
        )


def csv(_: random.Random, path: Path, pieces: Sequence[Piece]) -> None:
    """A plain text, to be packed."""
    header = ",".join(_printable(f"{p.name} [{p.unit}]").replace(",", " ").replace('"', "''") for p in pieces)
    rows = (",".join(map(repr, row)) for row in np.column_stack([p.values for p in pieces]).tolist())
    path.write_text("\n".join([header, *rows, ""]))


def zipped(dice: random.Random, data: bytes) -> bytes:
    """A zip archive with a file and perhaps others."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", dice.choice((0, 8, 8, 12, 14))) as archive:
        archive.writestr(dice.choice(("lot/record.csv", "a", "../../etc/x", "C:\\x", "é\u202e.csv", "x" * 300)), data)
        if chance(dice, 0.3):
            archive.writestr("__MACOSX/._record.csv", b"\0")
        if chance(dice, 0.1):
            archive.writestr("b.csv", data)
    return stream.getvalue()


LAYERS: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    lambda _, data: gzip.compress(data, 1),
    lambda _, data: bz2.compress(data),
    lambda _, data: lzma.compress(data, preset=0),
    zipped,
)
FORMATS: dict[str, Write] = {
    each.__name__: each
    for each in (
        mat, mat_4, mat_73, hdf5, npz, npy, xls, xlsx, ods, tdms, mdf_3, mdf_4, uff, parquet_file, feather_file, csv,
    )
}  # fmt: skip
