"""The identification of one spring of a batch: what a worker does, and the row that it gives."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar, NamedTuple

from ..._version import __version__
from ...core.parameters import SpringParameters
from ...errors import Reader, RecordError, StrandspringError
from ...findings import Finding, IdentificationError, Outcome, gathered
from ...ground.files import opened, readable
from ...ground.strict_json import finite
from ...identification.identified import IdentifiedModel
from ...identification.identify import identify_records
from ...identification.options import Method
from ...loops.reading import Reading
from ...model.joint import HYSTERETIC_UNITS
from ...model.names import check_name
from ...model.stated_figures import energy_ratio
from ...records.content import MAX_BYTES
from .sources import SpringFile

IDENTIFIED, REFUSED, UNREADABLE, FAILED = STATUSES = ("identified", "refused", "unreadable", "failed")
_CHUNK = 1024 * 1024
_UNKNOWN = (None, None, None)  # standard error and ends of the interval


@dataclass(frozen=True)
class SpringRow:
    """What is known of one file.

    Attributes
    ----------
    file : str                      See `SpringFile`.
    size, sha256 : int, str or None Of the file; None where it cannot be read.
    settings : str                  Digest of the options and the version.
    model : str                     Name of the model.
    status : str                    One of `STATUSES`.
    reason : str                    Why it is not identified, a sentence; else empty.
    model_sha256 : str or None      Of the model file.
    samples : int or None
    times : bool or None            Whether there was a column of times.
    rmse, rnl : float or None       Of the saved spring alone [N], [-].
    energy_ratio : float or None    Energy of its loops over that of the measured ones.
    fitted_rnl : float or None      RNL with what the rig added to the record.
    verdict : str or None           Whether the spring is usable.
    held_out_error : float or None  Error on held-out strokes, share of the force's standard deviation.
    missed : float or None          See `LackOfFit.missed`.
    parameters : dict               As in the model file; empty unless identified.
    uncertainty : dict              Standard error, and low and high 95 % ends, of each of `HYSTERETIC_UNITS`; standard
                                    errors of kE and kA. None where unknown.
    found : tuple of dict           Findings of reading and identification: name and numbers of each.
    """

    file: str
    size: int | None
    sha256: str | None
    settings: str
    model: str
    status: str
    reason: str = ""
    model_sha256: str | None = None
    samples: int | None = None
    times: bool | None = None
    rmse: float | None = None
    rnl: float | None = None
    energy_ratio: float | None = None
    fitted_rnl: float | None = None
    verdict: str | None = None
    held_out_error: float | None = None
    missed: float | None = None
    parameters: dict[str, float | tuple[float, ...]] = field(default_factory=dict)
    uncertainty: dict[str, tuple[float | None, ...]] = field(default_factory=dict)
    found: tuple[dict[str, Any], ...] = ()

    def number(self, name: str) -> float | None:
        """A parameter that is one number; None unless identified."""
        value = self.parameters.get(name)
        return value if isinstance(value, float) else None

    @property
    def spring(self) -> SpringParameters:
        """The identified spring."""
        return SpringParameters(**{"kE": (), **self.parameters})  # type: ignore[arg-type]

    @property
    def is_possible(self) -> bool:
        """Whether this program can have written the row, as far as the types of its values do not tell."""
        try:
            check_name(self.model)
            if self.status == IDENTIFIED:
                _ = self.spring
            findings = self.findings
        except (KeyError, TypeError, ValueError):
            return False
        return (
            self.status in STATUSES
            and all(finding.is_complete for finding in findings)
            and all(len(self.uncertainty.get(name, _UNKNOWN)) == len(_UNKNOWN) for name in HYSTERETIC_UNITS)
        )

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was found, with the file as its place."""
        place = readable(self.file)
        return tuple(Finding(Outcome[entry["name"].upper()], dict(entry["numbers"]), place) for entry in self.found)

    def numbers(self, name: str) -> tuple[float, ...]:
        """A parameter that is a list; empty where this spring has none."""
        value = self.parameters.get(name)
        return value if isinstance(value, tuple) else ()


@dataclass(frozen=True)
class _TheFile(os.PathLike[str]):
    """A path that messages do not repeat."""

    path: str
    called: ClassVar[str] = "The file"

    def __fspath__(self) -> str:
        return self.path


class Finished(NamedTuple):
    """A row with the text of the model file, None unless identified."""

    row: SpringRow
    model: str | None


@dataclass(frozen=True)
class BatchWork:
    """Identification of files, as it travels to the workers.

    Parameters
    ----------
    method : Method
    reading : Reading   How the files are read, and what of them is used.
    save_anyway : bool  See `identify_records`.
    """

    method: Method
    reading: Reading
    save_anyway: bool = False

    @property
    def settings(self) -> str:
        """Digest of everything but the file that determines a row."""
        content = [__version__, self.method.name, asdict(self.method), asdict(self.reading), self.save_anyway]
        return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:16]

    def rows(self, tasks: Sequence[SpringFile]) -> list[Finished]:
        """Identify the springs of files, each on its own."""
        return [self._finished(spring) for spring in tasks]

    def fatal(self, spring: SpringFile) -> Finished:
        """The row of a file that ended its worker process twice."""
        reason = "The process that identified it died, perhaps for lack of memory; please report this with the file."
        return Finished(replace(self._blank(spring), status=FAILED, reason=reason), None)

    def _blank(self, spring: SpringFile) -> SpringRow:
        return SpringRow(spring.file, *digest(spring.path), self.settings, spring.name, UNREADABLE)

    def _finished(self, spring: SpringFile) -> Finished:
        row = self._blank(spring)  # the digest first: of a file that changes meanwhile the next run sees a new one
        try:
            read = self.reading.read(_TheFile(spring.path))
            record = replace(read, path=readable(spring.file))
            found = _data(record.findings)
            row = replace(row, status=REFUSED, samples=len(record), times=record.time is not None, found=found)
            identified = identify_records([record], self.method, self.save_anyway)
            text = identified.model_file(spring.name).to_json()
        except IdentificationError as problem:
            findings = (replace(finding, where="") for finding in problem.findings)
            return Finished(replace(row, reason=" ".join(gathered(findings, Reader.FILE))), None)
        except StrandspringError as problem:
            return Finished(replace(row, reason=problem.words(Reader.FILE)), None)
        except Exception as problem:  # one file must not stop the others
            reason = f"An error of the program ({type(problem).__name__}: {str(problem)[:200]})"
            return Finished(replace(row, status=FAILED, reason=f"{reason}; please report it with the file."), None)
        row = replace(row, **_figures(identified), model_sha256=hashlib.sha256(text.encode()).hexdigest())
        found += _data((*identified.findings, *identified.record_findings))
        return Finished(replace(row, status=IDENTIFIED, found=found), text)


def _data(findings: Iterable[Finding]) -> tuple[dict[str, Any], ...]:
    """Findings as the journal keeps them."""
    return tuple({"name": finding.name, "numbers": dict(finding.numbers)} for finding in findings)


def _figures(identified: IdentifiedModel) -> dict[str, Any]:
    """Fields of a row."""
    known = identified.uncertainty
    interval = known.get("interval_95", {})
    uncertainty: dict[str, tuple[float | None, ...]] = {
        name: tuple(finite(value) for value in (known.get(name), *interval.get(name, (None, None))))
        for name in HYSTERETIC_UNITS
    }
    for name in ("kE", "kA"):
        uncertainty[name] = tuple(finite(value) for value in known.get(name) or ())
    verdict, certainty = identified.verdict, identified.certainty
    whole = None if verdict is None else verdict.whole
    return {
        "rmse": finite(identified.rmse),
        "rnl": finite(identified.rnl),
        "energy_ratio": finite(energy_ratio(identified.figures)),
        "fitted_rnl": finite(identified.fitted_figures["rnl"]),
        "verdict": None if verdict is None else str(verdict),
        "held_out_error": None if whole is None else finite(whole.error),
        "missed": None if certainty is None else finite(certainty.lack.missed),
        "parameters": identified.parameters.as_dict(),
        "uncertainty": uncertainty,
    }


def digest(path: str) -> tuple[int | None, str | None]:
    """Size and SHA-256 (hexadecimal) of a file; None for what is not a regular file that can be read."""
    value = hashlib.sha256()
    size = 0
    try:
        with opened(path, MAX_BYTES, "a record file", RecordError) as file:
            while chunk := file.read(_CHUNK):
                value.update(chunk)
                size += len(chunk)
    except RecordError:
        return None, None
    return size, value.hexdigest()
