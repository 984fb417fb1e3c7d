"""Which files hold the springs of a batch, and what their models are called."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from ...errors import RecordError, StrandspringError
from ...findings import Finding, Outcome
from ...ground.files import readable
from ...model.names import LONGEST_NAME, identifier

# What is taken from a folder; any other file is identified if it is named itself.
RECORD_SUFFIXES = frozenset(
    f".{suffix}"
    for suffix in (
        "csv", "tsv", "txt", "dat", "asc", "prn", "tab", "gz", "bz2", "xz", "zip", "mat", "xlsx", "xlsm", "xls", "ods",
        "tdms", "mdf", "mf4", "uff", "unv", "h5", "hdf5", "hdf", "parquet", "feather", "npy", "npz",
    )
)  # fmt: skip
TABLE, COLUMNAR_TABLE, JOURNAL = "springs.csv", "springs.parquet", "springs.journal.sqlite"


class SpringFile(NamedTuple):
    """One spring of a batch.

    Attributes
    ----------
    file : str   Path as given, in text that can be written; identifies the spring.
    path : str   Absolute path.
    name : str   Of the model and its file.
    """

    file: str
    path: str
    name: str


def find_springs(
    sources: Iterable[str | os.PathLike[str]], folder: Path
) -> tuple[tuple[SpringFile, ...], tuple[Finding, ...]]:
    """Files of a batch: those given, and those of given folders whose names end like a record's.

    Folders within folders are not searched. A folder whose own name ends like a record's is taken for a damaged file.

    Parameters
    ----------
    sources : iterable of paths
    folder : Path                Of the results, which are not taken for records.

    Returns
    -------
    tuple of SpringFile          In the order given, the files of a folder by name.
    tuple of Finding             Files of folders that are no records by their names, and files given twice.

    Raises
    ------
    RecordError                  If there is no file, or no folder of a name without an ending.
    StrandspringError            If a result would overwrite a record.
    """
    outputs = {os.path.realpath(folder / name) for name in (TABLE, COLUMNAR_TABLE, JOURNAL)}
    files: dict[str, str] = {}
    others: list[str] = []
    twice: list[str] = []
    for source in sources:
        given = os.fspath(source)
        for file in _files_of(given, others, outputs):
            path = _absolute(file)
            if path in files:
                twice.append(file)
            files.setdefault(path, file)
    if not files:
        raise RecordError(
            "There is no record to identify; give files, or folders that hold files named like records "
            "(.csv, .txt, .xlsx, ...)."
        )
    names = _model_names(list(files.values()))
    springs = tuple(SpringFile(_text(files[path]), path, name) for path, name in zip(files, names, strict=True))
    _refuse_overwriting(springs, folder, outputs)
    listed = ((Outcome.NOT_LIKE_RECORDS, others), (Outcome.GIVEN_TWICE, twice))
    left_out = (Finding(kind, {"count": len(of), "first": readable(of[0])}) for kind, of in listed if of)
    return springs, tuple(left_out)


def _files_of(given: str, others: list[str], outputs: set[str]) -> Sequence[str]:
    """The files that a path stands for; files of a folder that are no records are added to `others`."""
    if _is_named_like_a_record(Path(given)) or not Path(given).is_dir():
        if not Path(given).suffix and not os.path.lexists(given):
            raise RecordError(f"{readable(given)}: no such file or folder; check the path.")
        return [given]
    try:
        entries = sorted(Path(given).iterdir())
    except OSError as problem:
        raise RecordError(f"{readable(given)} cannot be read: {problem.strerror}; check the path and rights.") from None
    files = []
    results = {Path(output).parent for output in outputs}  # where the models are
    for entry in entries:
        path = _absolute(entry)
        if entry.name.startswith(".") or path in outputs:
            continue
        if _is_named_like_a_record(entry):
            files.append(str(entry))
        elif not entry.is_dir() and not (entry.suffix == ".json" and Path(path).parent in results):
            others.append(str(entry))
    return files


def _is_named_like_a_record(path: Path) -> bool:
    return path.suffix.lower() in RECORD_SUFFIXES


def _absolute(path: str | Path) -> str:
    try:
        return os.path.realpath(path)
    except ValueError:  # not a possible path, which is reported when it is read
        return str(path)


def _text(path: str) -> str:
    """A path in text that UTF-8 can hold; other bytes are spelled out."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


def _model_names(paths: Sequence[str]) -> list[str]:
    """A name for each file, unique also where case does not count: from its own name, then with its folder's, then with
    a digest of the path.

    A name depends on the others only where they clash, and not on their order.
    """
    spelled = [identifier(Path(path).stem) for path in paths]
    for extend in (_with_folder, _with_digest):
        count = Counter(name.lower() for name in spelled)
        spelled = [
            name if count[name.lower()] == 1 else extend(name, path) for name, path in zip(spelled, paths, strict=True)
        ]
    return spelled


def _with_folder(name: str, path: str) -> str:
    return identifier(f"{Path(path).parent.name}_{name}")


def _with_digest(name: str, path: str) -> str:
    digest = hashlib.sha256(os.fsencode(path)).hexdigest()[:12]
    return f"{name[: LONGEST_NAME - 13]}_{digest}"


def _refuse_overwriting(springs: Sequence[SpringFile], folder: Path, outputs: set[str]) -> None:
    records = {spring.path: spring.file for spring in springs}
    for output in (*outputs, *(_absolute(folder / f"{spring.name}.json") for spring in springs)):
        if (record := records.get(output)) is not None:
            raise StrandspringError(f"The record {readable(record)} would be overwritten; write to another folder.")
