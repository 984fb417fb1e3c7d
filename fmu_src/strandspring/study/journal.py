"""The journal of a study: every finished run, kept beside the results until they are written.

A file of JSON lines, `RESULTS.csv.part.jsonl`: a manifest that says which study it is, then one row for each run in the
order in which they finished. A last line that was cut off when the program was killed is dropped.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, astuple, fields
from pathlib import Path
from typing import Any

from .._version import __version__
from ..isolation.system import IsolationError
from .definition import RunRow, Study

_FORMAT = "strandspring-study"
_FORMAT_VERSION = 2


def journal_path(results: Path) -> Path:
    """Where the journal of a study lies whose results are to be written to a path."""
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
    rows : dict      Finished runs by their number.

    Raises
    ------
    IsolationError   If the file cannot be read or written, or is the journal of another study.
    """

    def __init__(self, results: Path, study: Study) -> None:
        self.path = journal_path(results)
        self.rows: dict[int, RunRow] = {}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("a+b")
        except OSError as problem:
            raise IsolationError(f"{self.path} cannot be written: {problem.strerror}.") from None
        try:
            self._read(study)
        except BaseException:
            self._file.close()
            raise

    def _read(self, study: Study) -> None:
        manifest = _manifest(study)
        self._file.seek(0)
        content = self._file.read()
        whole = content.rfind(b"\n") + 1
        lines = content[:whole].splitlines()
        if lines:
            self._check(_parsed(lines[0]), manifest)
        elif not _line(manifest).startswith(content):
            self._check(None, manifest)
        self._file.truncate(whole)
        if not lines:
            self._append([manifest])
            return
        for number, line in enumerate(lines[1:], start=2):
            row = _row(_parsed(line), len(study))
            if row is None:
                raise IsolationError(
                    f"{self.path}, line {number}: not a finished run of this study; remove the file to begin anew."
                )
            self.rows[row.run] = row

    def _check(self, found: Any, manifest: dict[str, Any]) -> None:
        """Refuse the journal of another study, with what differs."""
        if not isinstance(found, dict) or found.get("format") != _FORMAT:
            raise IsolationError(f"{self.path} is not the journal of a study; move it away, or write elsewhere.")
        if found == manifest:
            return
        of_options = found.get("options"), manifest["options"]
        there, here = (options if isinstance(options, dict) else {} for options in of_options)
        different = [
            f"{name} {json.dumps(there.get(name))} instead of {json.dumps(value)}"
            for name, value in here.items()
            if there.get(name) != value
        ]
        different += [
            f"{name} {json.dumps(found.get(name))} instead of {json.dumps(manifest[name])}"
            for name in ("format_version", "version")
            if found.get(name) != manifest[name]
        ]
        different += ["another model"] if found.get("model_sha256") != manifest["model_sha256"] else []
        raise IsolationError(
            f"{self.path} is the journal of another study ({', '.join(different)}); finish that one with its own "
            "options, or remove the file to begin anew."
        )

    def add(self, rows: Iterable[RunRow]) -> None:
        """Keep finished runs."""
        rows = list(rows)
        self._append([list(astuple(row)) for row in rows])
        self.rows.update((row.run, row) for row in rows)

    def _append(self, entries: list[Any]) -> None:
        try:
            self._file.write(b"".join(map(_line, entries)))
            self._file.flush()
        except OSError as problem:
            raise IsolationError(f"{self.path} cannot be written: {problem.strerror}.") from None

    def close(self, finished: bool) -> None:
        """Leave the journal for the next time; remove it if the study is finished or no run is."""
        self._file.close()
        if finished or not self.rows:
            self.path.unlink(missing_ok=True)


def _manifest(study: Study) -> dict[str, Any]:
    """Which study this is: what decides the numbers, and nothing else."""
    options = {
        field.name: getattr(study, field.name)
        for field in fields(study)
        if field.name not in ("spring", "spread", "excitation")
    }
    model = {"spring": asdict(study.spring), "spread": None if study.spread is None else asdict(study.spread)}
    manifest = {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "version": __version__,
        "model_sha256": hashlib.sha256(json.dumps(model).encode("utf-8")).hexdigest(),
        "options": {"excitation": study.excitation.value, **options},
    }
    return dict(json.loads(json.dumps(manifest)))  # as it will be read back: tuples are lists


def _line(entry: Any) -> bytes:
    return f"{json.dumps(entry, ensure_ascii=False, allow_nan=False)}\n".encode()


def _parsed(line: bytes) -> Any:
    """A line of JSON; None if it is none."""
    try:
        return json.loads(line)
    except ValueError:
        return None


def _row(entry: Any, runs: int) -> RunRow | None:
    """The row a line tells; None if it is none of this study."""
    if not isinstance(entry, list) or len(entry) != len(fields(RunRow)):
        return None
    row = RunRow(*entry)
    return row if isinstance(row.run, int) and 0 <= row.run < runs else None
