"""What a file is, by its content, and its tables: the formats that are read, and those that a refusal names."""

from __future__ import annotations

import io
import re
import struct
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ...errors import RecordError
from ..channels import channel_tables
from ..content import ZIP, FileContent
from ..source import Source, text_source
from ..tables import FileTables
from ..text_table import TextTable
from .reader_process import read_in_process


@dataclass(frozen=True)
class FormatKind:
    """A kind of file.

    Attributes
    ----------
    name : str      With its article, for messages.
    module : str    Module of this folder that reads it; "" if none does.
    advice : str    What to do if none does.
    """

    name: str
    module: str = ""
    advice: str = "export the record as CSV"


_HDF5 = b"\x89HDF\r\n\x1a\n"
_OLE = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
_WORKBOOK = "workbook"
# Long enough not to be the first column of a text: "PAR1;PAR2" is one.
_MAGIC: tuple[tuple[bytes | tuple[bytes, ...], FormatKind], ...] = (
    (b"MATLAB 5.0 MAT-file", FormatKind("a MATLAB file", "matlab")),
    (b"MATLAB 7.3 MAT-file", FormatKind("a MATLAB v7.3 file", "hdf5")),
    (_HDF5, FormatKind("an HDF5 file", "hdf5")),
    (b"TDSm", FormatKind("a TDMS file", "tdms")),
    (b"TDSh", FormatKind("the index of a TDMS file", advice="give the .tdms file beside it")),
    ((b"MDF     ", b"UnFinMF "), FormatKind("an MDF file", "mdf")),
    (b"PAR1\x15", FormatKind("a Parquet file", "arrow")),
    (b"ARROW1\0", FormatKind("a Feather (Arrow) file", "arrow")),
    (b"\x93NUMPY", FormatKind("a NumPy array", "numpy_arrays")),
    (b"SQLite format 3\0", FormatKind("an SQLite database")),
    (b"%PDF", FormatKind("a PDF document", advice="export the numbers as CSV")),
    (b"\x89PNG\r\n\x1a\n", FormatKind("a PNG picture", advice="give the numbers, not their plot")),
    (b"\xff\xd8\xff", FormatKind("a JPEG picture", advice="give the numbers, not their plot")),
    (b"GIF8", FormatKind("a GIF picture", advice="give the numbers, not their plot")),
    ((b"II*\0", b"MM\0*"), FormatKind("a TIFF picture", advice="give the numbers, not their plot")),
    (b"{\\rtf", FormatKind("a rich text document (RTF)")),
    (b"7z\xbc\xaf\x27\x1c", FormatKind("a 7-Zip archive", advice="unpack it first")),
    (b"Rar!", FormatKind("a RAR archive", advice="unpack it first")),
    (b"\x28\xb5\x2f\xfd", FormatKind("a Zstandard file", advice="unpack it first")),
    (b"\x04\x22\x4d\x18", FormatKind("an LZ4 file", advice="unpack it first")),
    (
        (b"CDF\x01", b"CDF\x02"),
        FormatKind("a NetCDF 3 file", advice="convert it to NetCDF 4 (HDF5), or export the record as CSV"),
    ),
    (b"\x0e\x03\x13\x01", FormatKind("an HDF4 file", advice="convert it to HDF5, or export the record as CSV")),
    ((b"RDX2\n", b"RDX3\n"), FormatKind("an R data file")),
    (b"$FL2", FormatKind("an SPSS file")),
    (b"\x7fELF", FormatKind("a program", advice="give a record")),
)
_OF_ZIP: tuple[tuple[str, FormatKind], ...] = (
    ("xl/", FormatKind("an Excel workbook", _WORKBOOK)),
    ("word/", FormatKind("a Word document")),
    ("ppt/", FormatKind("a PowerPoint presentation")),
)
_SPREADSHEET = b"application/vnd.oasis.opendocument.spreadsheet"
_UFF = re.compile(rb"\s*-1\s*\r?\n\s*\d{1,4}[b \r\n]")
_PICKLE = re.compile(rb"\x80[\x02-\x05]")
_HEAD = 4096


def tables_of(content: FileContent, skip_bad_lines: bool | None = None) -> FileTables:
    """The tables of a file: one of a delimited text, one per sheet of a workbook, one per group of channels.

    Parameters
    ----------
    content : FileContent
    skip_bad_lines : bool or None   Whether rows of texts and sheets that cannot be read are left out; None where
                                    nobody could ask for it.

    Raises
    ------
    RecordError   If the file is of a kind that cannot be read, its library is missing, or it is damaged.
    """
    kind = _kind_of(content.data)
    where = content.path
    if kind is None:
        source = text_source(content)
        return FileTables(
            where, [TextTable(source, skip_bad_lines=skip_bad_lines)], None, content.sha256, content.findings
        )
    if not kind.module:
        raise RecordError(f"{where}: is {kind.name}; {kind.advice}.")
    sheets, channels = read_in_process(kind.module, kind.name, content)
    if not sheets and not channels:
        raise RecordError(f"{where}: is {kind.name} without columns of numbers; give one with displacement and force.")
    tables = _sheet_tables(sheets, where, skip_bad_lines) if sheets else channel_tables(channels, where)
    return replace(tables, sha256=content.sha256, findings=content.findings)


def _sheet_tables(sheets: Mapping[str, bytes], where: str, skip_bad_lines: bool | None) -> FileTables:
    """The sheets that hold numbers; raises RecordError if none does: what is wrong with the first."""
    tables: list[TextTable] = []
    problems = []
    for name, text in sheets.items():
        try:
            tables.append(TextTable(Source(where, text, "utf-8", (), "row"), name, skip_bad_lines))
        except RecordError as problem:
            problems.append(problem)
    if not tables:
        raise problems[0]
    return FileTables(where, tables)


def _kind_of(data: bytes) -> FormatKind | None:
    """The kind of a file that is not delimited text; None if it may be that."""
    for magic, kind in _MAGIC:
        if data.startswith(magic):
            return kind
    # HDF5 may begin behind a block of the user's.
    if any(data.startswith(_HDF5, offset) for offset in (512, 1024, 2048)):
        return FormatKind("an HDF5 file", "hdf5")
    others: tuple[tuple[Callable[[bytes], bool], FormatKind], ...] = (
        (lambda data: bool(_UFF.match(data[:_HEAD])), FormatKind("a universal file (UFF)", "uff")),
        (_is_matlab_4, FormatKind("a MATLAB v4 file", "matlab")),
        (lambda data: data[257:262] == b"ustar", FormatKind("a tar archive", advice="unpack it first")),
        (
            lambda data: bool(_PICKLE.match(data)) and data.endswith(b"."),
            FormatKind("a Python pickle", advice="which may run any program and is never read; save it as .npz"),
        ),
        (_is_web_page, FormatKind("an HTML page")),
    )
    for fits, kind in others:
        if fits(data):
            return kind
    if data.startswith(_OLE):
        return _of_ole(data)
    return _of_zip(data) if data.startswith(ZIP) else None


def _is_matlab_4(data: bytes) -> bool:
    """Whether the first 20 bytes are the header of a full numeric or text matrix with a name."""
    if len(data) < 22:
        return False
    for order, machine in (("<", 0), (">", 1000)):
        kind, rows, columns, imaginary, length = struct.unpack(f"{order}5i", data[:20])
        kind -= machine
        fits = 0 <= kind < 100 and kind % 10 <= 2 and kind // 10 <= 5
        if fits and rows > 0 and columns > 0 and imaginary in (0, 1) and 2 <= length <= 64:
            name = data[20 : 20 + length]
            return name.endswith(b"\0") and re.fullmatch(rb"[A-Za-z]\w*", name[:-1]) is not None
    return False


def _is_web_page(data: bytes) -> bool:
    return data[:_HEAD].lstrip(b"\xef\xbb\xbf \t\r\n").lower().startswith((b"<!doctype html", b"<html", b"<table"))


def _of_ole(data: bytes) -> FormatKind:
    """Kind of an OLE2 file, by the names in its directory, which are UTF-16."""
    names = {name: name.encode("utf-16-le") in data for name in ("Workbook", "Book", "EncryptedPackage")}
    if names["EncryptedPackage"]:
        return FormatKind("an encrypted Office document", advice="save it without a password")
    if names["Workbook"] or names["Book"]:
        return FormatKind("an Excel workbook of the old kind (.xls)", _WORKBOOK)
    return FormatKind("an Office document of the old kind")


def _of_zip(data: bytes) -> FormatKind | None:
    """Kind of what is a zip archive, and no archive of records."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = archive.namelist()
            mimetype = archive.open("mimetype").read(200) if "mimetype" in names else b""
    # zipfile raises various errors for damaged archives, struct.error among them.
    except Exception:
        return FormatKind("a zip archive that is damaged", advice="export the record again")
    for folder, kind in _OF_ZIP:
        if any(name.startswith(folder) for name in names):
            return kind
    if mimetype.startswith(_SPREADSHEET):
        return FormatKind("an OpenDocument spreadsheet", _WORKBOOK)
    if mimetype:
        return FormatKind("an OpenDocument file that is no spreadsheet")
    return FormatKind("a file of NumPy arrays", "numpy_arrays")
