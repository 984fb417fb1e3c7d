"""The journal of a study: every finished run, kept beside the results until they are written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

from ..._version import __version__
from ..jobs.rowlog import RowLog
from ..jobs.runners import JobError

_FORMAT = "strandspring-study"
_FORMAT_VERSION = 4
_LONGEST_VALUE = 60  # characters of a value in a sentence
_DIGEST = "_sha256"


class NumberedRow(Protocol):
    """A row that knows its run."""

    @property
    def run(self) -> int:
        """From 0 in the study."""
        ...


Row = TypeVar("Row", bound=NumberedRow)


def journal_path(results: Path) -> Path:
    """Path of the journal of a study whose results are written to a path."""
    return results.parent / f"{results.name}.part.jsonl"


class Journal(RowLog[Row]):
    """Finished runs of one study on disk.

    Parameters
    ----------
    results : Path     Where the results are to be written; the journal lies beside it.
    row_type : type    See `RowLog`.
    runs : int         Number of runs of the study.
    manifest : dict    See `manifest_of`.

    Raises
    ------
    JobError           See `RowLog`.
    """

    def __init__(self, results: Path, row_type: type[Row], runs: int, manifest: dict[str, Any]) -> None:
        self._runs = runs
        super().__init__(journal_path(results), row_type, runs, manifest, indexed=True)

    def place(self, row: Row) -> int:
        """See `RowLog`."""
        if not 0 <= row.run < self._runs:
            raise LookupError
        return row.run

    def check(self, found: object, expected: dict[str, Any]) -> None:
        """Refuse the journal of another study, with the differences."""
        if not isinstance(found, dict) or found.get("format") != _FORMAT:
            raise JobError(f"{self.name} is not the journal of a study; move it away, or write elsewhere.")
        if found == expected:
            return
        options = found.get("options")
        flat = {**found, **(options if isinstance(options, dict) else {})}
        wanted = {**expected["options"], **{name: expected[name] for name in ("format_version", "version")}}
        differences = [
            f"{name} {_brief(flat.get(name))} instead of {_brief(value)}"
            for name, value in wanted.items()
            if flat.get(name) != value
        ]
        differences += [
            f"another {name.removesuffix(_DIGEST)}"
            for name, digest in expected.items()
            if name.endswith(_DIGEST) and found.get(name) != digest
        ]
        raise JobError(
            f"{self.name} is the journal of another study ({', '.join(differences)}); finish that one with its own "
            "options, or remove the file to start again."
        )


def _brief(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def manifest_of(subject: str, sha256: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """What identifies a study: everything that determines the numbers, and nothing else.

    Parameters
    ----------
    subject : str       What is studied, such as "model".
    sha256 : str        Of its content.
    options : mapping   As JSON can hold them.
    """
    return {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "version": __version__,
        f"{subject}{_DIGEST}": sha256,
        "options": options,
    }
