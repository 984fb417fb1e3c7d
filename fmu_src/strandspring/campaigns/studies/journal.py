"""The journal of a study: every finished run, kept beside the results until they are written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..._version import __version__
from ...errors import JobError
from ..jobs.rowlog import RowLog, encoded_row
from .runs import Runs

_FORMAT = "strandspring-study"
_FORMAT_VERSION = 5
_LONGEST_VALUE = 60  # characters of a value in a sentence
_DIGEST = "_sha256"


def journal_path(results: Path) -> Path:
    """Path of the journal of a study whose results are written to a path."""
    return results.parent / f"{results.name}.part.sqlite"


@dataclass(frozen=True)
class EncodedRuns:
    """Runs whose rows the workers encode, since this process has to keep up with all of them.

    Parameters
    ----------
    study : Runs
    """

    study: Runs[Any]

    def rows(self, runs: Sequence[int]) -> list[tuple[int, bytes]]:
        """Number and row of each run, as `Journal.add_encoded` takes them."""
        return [(row.run, encoded_row(row)) for row in self.study.rows(runs)]


class Journal(RowLog[Any]):
    """Finished runs of one study on disk, beside the results.

    Parameters
    ----------
    results : Path     Where the results are to be written.
    study : Runs

    Raises
    ------
    JobError           See `RowLog`.
    """

    def __init__(self, results: Path, study: Runs[Any]) -> None:
        self._runs = len(study)
        super().__init__(journal_path(results), study.row_type, range(self._runs), manifest_of(study))

    def key(self, row: Any) -> int:
        """See `RowLog`."""
        run: int = row.run
        return run

    def place(self, key: int) -> int:
        """See `RowLog`."""
        if not 0 <= key < self._runs:
            raise LookupError
        return key

    def check(self, manifest: object, expected: dict[str, Any]) -> None:
        """Refuse the journal of another study, with the differences."""
        if not isinstance(manifest, dict) or manifest.get("format") != _FORMAT:
            raise JobError(f"{self.name} is not the journal of a study; move it away, or write elsewhere.")
        if manifest == expected:
            return
        options = manifest.get("options")
        flat = {**manifest, **(options if isinstance(options, dict) else {})}
        settings = {**expected["options"], **{name: expected[name] for name in ("format_version", "version")}}
        differences = [
            f"{name} {_brief(flat.get(name))} instead of {_brief(value)}"
            for name, value in settings.items()
            if flat.get(name) != value
        ]
        differences += [
            f"another {name.removesuffix(_DIGEST)}"
            for name, digest in expected.items()
            if name.endswith(_DIGEST) and manifest.get(name) != digest
        ]
        raise JobError(
            f"{self.name} is the journal of another study ({', '.join(differences)}); finish that one with its own "
            "options, or remove the file to start again."
        )


def _brief(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def manifest_of(study: Runs[Any]) -> dict[str, Any]:
    """What identifies a study: everything that determines the numbers, and nothing else."""
    content, options = study.identity
    return {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "version": __version__,
        f"{study.subject}{_DIGEST}": hashlib.sha256(json.dumps(content).encode("utf-8")).hexdigest(),
        "options": options,
    }
