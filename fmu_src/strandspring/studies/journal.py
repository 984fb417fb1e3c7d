"""The journal of a study: every finished run, kept beside the results until they are written.

A file of JSON lines, `RESULTS.csv.part.jsonl`: a manifest that identifies the study, then one line for each run in the
order in which they finished, [checksum, [values of the row]]. A damaged end, as a killed program or machine leaves it,
is dropped. Rows stay on disk; in memory there are 8 bytes for each run.
"""

from __future__ import annotations

import hashlib
import json
import zlib
from array import array
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import asdict, astuple, fields
from functools import cache
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import TypeAdapter, ValidationError

from .._version import __version__
from ..isolation.system import IsolationError
from .definition import RunRow, Study

_FORMAT = "strandspring-study"
_FORMAT_VERSION = 3
_CHECKSUM = slice(2, 10)
_VALUES = slice(13, -1)
_NOT_FINISHED = -1


def journal_path(results: Path) -> Path:
    """Path of the journal of a study whose results are written to a path."""
    return results.parent / f"{results.name}.part.jsonl"


class Journal:
    """Finished runs of one study on disk.

    Parameters
    ----------
    results : Path   Where the results are to be written; the journal lies beside it.
    study : Study

    Attributes
    ----------
    path : Path
    finished : int   Number of finished runs.

    Raises
    ------
    IsolationError   If the file cannot be read or written, is damaged, or is the journal of another study.
    """

    def __init__(self, results: Path, study: Study) -> None:
        self.path = journal_path(results)
        self.finished = 0
        self._offsets = array("q", [_NOT_FINISHED]) * len(study)
        self._end = 0
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("a+b")
        except OSError as problem:
            raise IsolationError(f"{self.path} cannot be written: {problem.strerror}.") from None
        try:
            self._read(_manifest(study))
        except BaseException:
            self._file.close()
            raise

    def _read(self, manifest: dict[str, Any]) -> None:
        self._file.seek(0)
        first = self._file.readline()
        if first.endswith(b"\n") or not _line(manifest).startswith(first):
            self._check(first, manifest)
            self._end = len(first)
        else:  # new, or killed while writing the manifest
            self._file.truncate(0)
            self._write(_line(manifest))
            return
        damaged: int | None = None
        for number, line in enumerate(self._file, start=2):
            row = _row(line, len(self._offsets))
            if row is None:
                damaged = damaged or number
            elif damaged is not None:
                raise IsolationError(
                    f"{self.path}, line {damaged}: not a finished run of this study; remove the file to start again."
                )
            else:
                self._mark(row.run, self._end)
                self._end += len(line)
        self._file.truncate(self._end)

    def _check(self, line: bytes, manifest: dict[str, Any]) -> None:
        """Refuse the journal of another study, with the differences."""
        try:
            found = json.loads(line)
        except ValueError:
            found = None
        if not isinstance(found, dict) or found.get("format") != _FORMAT:
            raise IsolationError(f"{self.path} is not the journal of a study; move it away, or write elsewhere.")
        if found == manifest:
            return
        options = found.get("options")
        found = {**found, **(options if isinstance(options, dict) else {})}
        expected = {**manifest["options"], **{name: manifest[name] for name in ("format_version", "version")}}
        differences = [
            f"{name} {json.dumps(found.get(name))} instead of {json.dumps(value)}"
            for name, value in expected.items()
            if found.get(name) != value
        ]
        differences += ["another model"] if found.get("model_sha256") != manifest["model_sha256"] else []
        raise IsolationError(
            f"{self.path} is the journal of another study ({', '.join(differences)}); finish that one with its own "
            "options, or remove the file to start again."
        )

    def __contains__(self, run: int) -> bool:
        """Whether a run is finished."""
        return self._offsets[run] != _NOT_FINISHED

    def __getitem__(self, run: int) -> RunRow:
        """The row of a finished run."""
        self._file.seek(self._offsets[run])
        row = _row(self._file.readline(), len(self._offsets)) if run in self else None
        if row is None or row.run != run:
            raise IsolationError(f"{self.path} was changed while the study ran; run it again.")
        return row

    def add(self, rows: Iterable[RunRow]) -> None:
        """Keep finished runs."""
        rows = list(rows)
        lines = [_row_line(row) for row in rows]
        begin = self._end
        self._write(b"".join(lines))
        for row, line in zip(rows, lines, strict=True):
            self._mark(row.run, begin)
            begin += len(line)

    def _mark(self, run: int, offset: int) -> None:
        self.finished += run not in self
        self._offsets[run] = offset

    def _write(self, content: bytes) -> None:
        try:
            self._file.write(content)
            self._file.flush()
        except OSError as problem:
            raise IsolationError(f"{self.path} cannot be written: {problem.strerror}.") from None
        self._end += len(content)

    def close(self, is_complete: bool) -> None:
        """Close the file; remove it if the study is complete or no run is finished."""
        with suppress(OSError):  # of what could not be written, which has been reported
            self._file.close()
        if is_complete or not self.finished:
            self.path.unlink(missing_ok=True)


def _manifest(study: Study) -> dict[str, Any]:
    """What identifies a study: everything that determines the numbers, and nothing else."""
    options = {
        field.name: getattr(study, field.name)
        for field in fields(study)
        if field.name not in ("spring", "spread", "excitation")
    }
    model = {"spring": study.spring.as_dict(), "spread": None if study.spread is None else asdict(study.spread)}
    manifest = {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "version": __version__,
        "model_sha256": hashlib.sha256(json.dumps(model).encode("utf-8")).hexdigest(),
        "options": {"excitation": study.excitation.value, **options},
    }
    return dict(json.loads(json.dumps(manifest)))  # as it is read back: tuples are lists


def _line(content: Any) -> bytes:
    return f"{json.dumps(content, ensure_ascii=False, allow_nan=False)}\n".encode()


def _row_line(row: RunRow) -> bytes:
    values = _line(astuple(row))[:-1]
    return b'["%08x", %s]\n' % (zlib.crc32(values), values)


def _row(line: bytes, runs: int) -> RunRow | None:
    """The row of a complete line; None if it is damaged or not of this study."""
    values = line.rstrip(b"\n")[_VALUES]
    if not line.endswith(b"]\n") or line[_CHECKSUM] != b"%08x" % zlib.crc32(values):
        return None
    try:
        row = RunRow(*_row_values().validate_json(values, strict=True))
    except ValidationError:
        return None
    return row if 0 <= row.run < runs else None


@cache
def _row_values() -> TypeAdapter[tuple[Any, ...]]:
    """The types of a row's values."""
    return TypeAdapter(tuple[tuple(get_type_hints(RunRow).values())])  # type: ignore[misc, arg-type]
