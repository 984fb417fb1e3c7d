"""The journal of a batch: the row of every file that was identified into a folder, or refused.

It is kept when all are finished: the same command again identifies only what is new or has changed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...ground.files import readable, reason_of
from ..jobs.rowlog import RowLog
from ..jobs.runners import JobError
from .sources import JOURNAL, SpringFile
from .spring_row import IDENTIFIED, SpringRow, digest

_MANIFEST = {"format": "strandspring-batch", "format_version": 4}


class SpringLog(RowLog[SpringRow]):
    """Rows of the files of a batch, and of other files that were identified into the same folder.

    Parameters
    ----------
    folder : Path                      Of the results.
    springs : sequence of SpringFile

    Raises
    ------
    JobError                           See `RowLog`.
    """

    def __init__(self, folder: Path, springs: Sequence[SpringFile]) -> None:
        self._folder = folder
        keys = [_key(spring.file) for spring in springs]
        self._places = {key: place for place, key in enumerate(keys)}
        super().__init__(folder / JOURNAL, SpringRow, keys, _MANIFEST)

    def key(self, row: SpringRow) -> int:
        """See `RowLog`."""
        return _key(row.file)

    def place(self, key: int) -> int | None:
        """See `RowLog`."""
        return self._places.get(key)

    def check(self, manifest: object, expected: dict[str, Any]) -> None:
        """Refuse any other file."""
        if manifest != expected:
            raise JobError(
                f"{self.name} is not the journal of a batch that this version of strandspring reads; move it away, or "
                "write to another folder."
            )

    def model_path(self, row: SpringRow) -> Path:
        """Path of a spring's model file."""
        return self._folder / f"{row.model}.json"

    @staticmethod
    def _remove_model(path: Path) -> None:
        try:
            path.unlink(missing_ok=True)
        except OSError as problem:
            raise JobError(
                f"{readable(path)} belongs to a record that has changed, but cannot be removed: {reason_of(problem)}; "
                "remove it."
            ) from None

    def forget_changed(self, springs: Sequence[SpringFile], settings: str) -> int:
        """Forget rows that cannot be, of files that have changed, of other settings, or whose model file is missing or
        changed; the model files that belong to them are removed. Returns the number of those of other settings.
        """
        of_other_settings = 0
        for place, spring in enumerate(springs):
            if place not in self:
                continue
            row = self[place]
            if not row.is_possible:
                self.forget(place)
                continue
            is_there = row.status != IDENTIFIED or digest(str(self.model_path(row)))[1] == row.model_sha256
            is_known = row.sha256 is not None and digest(spring.path) == (row.size, row.sha256)
            if is_there and is_known and (row.settings, row.model) == (settings, spring.name):
                continue
            of_other_settings += row.settings != settings
            self.forget(place)
            if row.status == IDENTIFIED and is_there:
                self._remove_model(self.model_path(row))
        return of_other_settings


def _key(file: str) -> int:
    """The key of a file, which is no number, in 64 bits."""
    return int.from_bytes(hashlib.sha256(file.encode(errors="replace")).digest()[:8], "big", signed=True)
