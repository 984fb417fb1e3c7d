"""The journal of a study: every finished run, kept beside the results until they are written."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from .._version import __version__
from ..jobs.rowlog import RowLog
from ..jobs.runners import JobError
from .definition import RunRow, Study

_FORMAT = "strandspring-study"
_FORMAT_VERSION = 4
_LONGEST_VALUE = 60  # characters of a value in a sentence


def journal_path(results: Path) -> Path:
    """Path of the journal of a study whose results are written to a path."""
    return results.parent / f"{results.name}.part.jsonl"


class Journal(RowLog[RunRow]):
    """Finished runs of one study on disk.

    Parameters
    ----------
    results : Path   Where the results are to be written; the journal lies beside it.
    study : Study

    Raises
    ------
    JobError         See `RowLog`.
    """

    def __init__(self, results: Path, study: Study) -> None:
        self._runs = len(study)
        super().__init__(journal_path(results), RunRow, self._runs, _manifest(study), indexed=True)

    def place(self, row: RunRow) -> int:
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
        differences += ["another model"] if found.get("model_sha256") != expected["model_sha256"] else []
        raise JobError(
            f"{self.name} is the journal of another study ({', '.join(differences)}); finish that one with its own "
            "options, or remove the file to start again."
        )


def _brief(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}..."


def _manifest(study: Study) -> dict[str, Any]:
    """What identifies a study: everything that determines the numbers, and nothing else."""
    options = {
        field.name: getattr(study, field.name)
        for field in fields(study)
        if field.name not in ("spring", "spread", "excitation")
    }
    model = {"spring": study.spring.as_dict(), "spread": None if study.spread is None else asdict(study.spread)}
    return {
        "format": _FORMAT,
        "format_version": _FORMAT_VERSION,
        "version": __version__,
        "model_sha256": hashlib.sha256(json.dumps(model).encode("utf-8")).hexdigest(),
        "options": {"excitation": study.excitation.value, **options},
    }
