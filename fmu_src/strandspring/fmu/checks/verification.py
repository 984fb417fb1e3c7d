"""Whether an FMU is as it was built, and answers on this computer as its reference says."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path, PurePosixPath

import numpy as np
from fmpy import sharedLibraryExtension
from fmpy.validation import validate_fmu

from ...errors import ModelError, StrandspringError
from ...ground.files import read_bytes
from ...ground.isolated import isolated_processes
from ...ground.scratch import TemporaryFolder
from ...ground.unpacking import unpacked
from ...kernel.arrays import FloatArray
from ...model.certificate import certified
from ...model.modelfile import MAXIMUM_FMU_BYTES, MODEL_IN_FMU, model_of_text
from ..native.platforms import host_folder
from ..related_files import HASHES, REFERENCE, STIMULI
from .check import OUTPUTS, CheckReport, compare_run
from .table_check import compare_table

_DESCRIPTION = "modelDescription.xml"
_BINARY = re.compile(r"binaries/(?P<folder>[\w-]+)/(?P<library>\w+)\.(?:so|dll|dylib)", re.ASCII)
_ENCODING = re.compile(r"""\A\s*<\?xml[^>]*?encoding\s*=\s*["']([^"']*)""")


@dataclass(frozen=True)
class Finding:
    """One result of a verification.

    Attributes
    ----------
    about : str         What was looked at: files, rules, spring or run.
    text : str          One sentence.
    is_problem : bool   Whether it speaks against the FMU.
    """

    about: str
    text: str
    is_problem: bool = True


def verify_fmu(path: Path) -> list[Finding]:
    """Compare every file with its hash, the model description with FMI's rules, the spring with its certificate, and
    runs with the reference result.

    An FMU whose files are not as they were built is not run. Only binaries of an FMU with sources may have been added
    or compiled anew: the run, then in a process of its own, shows what the one for this computer is worth. A
    Python-backed FMU runs in such a process, too: its own code may end it.
    """
    try:
        contents = _contents(path)
        findings = list(_changed(contents))
    except _DamagedError as problem:
        return [Finding("files", str(problem))]
    if not any(finding.is_problem for finding in findings):
        which = f"All other {len(contents) - len(findings)}" if findings else f"All {len(contents)}"
        findings.append(Finding("files", f"{which} files are as they were built.", is_problem=False))
    runs_here = len(findings) == 1 and _has_sources(contents)
    findings += [*_against_rules(path, contents), *_against_certificate(contents)]
    if any(finding.is_problem for finding in findings):
        return [*findings, Finding("run", "It was not run.", is_problem=False)]
    return [*findings, *(_against_reference(path, contents) if runs_here else _apart(path))]


def _apart(path: Path) -> list[Finding]:
    """Run it in a process of its own, which a damaged binary may end, and whose temporary files are removed then."""
    process = get_context("spawn")
    with (
        TemporaryFolder() as folder,
        isolated_processes(),
        ProcessPoolExecutor(1, process, _work_in, (folder,)) as pool,
    ):
        try:
            return pool.submit(_alone, path).result()
        except BrokenProcessPool:
            return [
                Finding("run", "Its binary for this computer ends the process that runs it; build or compile it again.")
            ]


def _work_in(folder: Path) -> None:
    tempfile.tempdir = str(folder)


def _alone(path: Path) -> list[Finding]:
    return _against_reference(path, _contents(path))


class _DamagedError(StrandspringError):
    """A file that cannot be looked into; its text is a sentence."""


def _contents(path: Path) -> dict[str, bytes]:
    """Every file of the FMU by its name."""
    packed = read_bytes(path, MAXIMUM_FMU_BYTES, "an FMU", _DamagedError)
    if not packed.startswith(b"PK"):
        raise _DamagedError("It is not an FMU, which is a zip archive; give the file that `strandspring build` wrote.")
    try:
        return unpacked(packed, MAXIMUM_FMU_BYTES)
    except ValueError as problem:
        raise _DamagedError(f"It cannot be unpacked: {problem}; copy it again, or build it again.") from None


def _changed(contents: dict[str, bytes]) -> Iterator[Finding]:
    """Files that are not as the list of hashes says; binaries that sources may have given are no problem."""
    if HASHES not in contents:
        raise _DamagedError(f"It has no list of hashes ({HASHES}): strandspring did not build it, or not this version.")
    try:
        hashes = json.loads(contents[HASHES])
    except (ValueError, RecursionError):
        hashes = None
    if not isinstance(hashes, dict):
        raise _DamagedError(f"{HASHES} has been changed: it is no list of hashes.")
    has_sources = _has_sources(hashes)
    libraries = {PurePosixPath(name).stem for name in hashes if name.startswith("binaries/")}
    folder = host_folder(3 if b'fmiVersion="3' in contents.get(_DESCRIPTION, b"") else 2)
    for name in sorted({*hashes, *contents} - {HASHES}):
        if name not in contents:
            yield Finding("files", f"{name!a} is missing.")
        elif hashlib.sha256(contents[name]).hexdigest() != hashes.get(name):
            binary = _BINARY.fullmatch(name)
            if has_sources and binary and binary["library"] in libraries:
                text = f"{name!a} is not of this build: it has been compiled elsewhere, or is damaged"
                is_run = binary["folder"] == folder and name.endswith(sharedLibraryExtension)
                judged = (
                    "the run below decides" if is_run else "it is not run on this computer, so verify it on its own"
                )
                yield Finding("files", f"{text}; {judged}.", is_problem=False)
            elif name not in hashes:
                yield Finding("files", f"{name!a} has been added: it is not in {HASHES}.")
            else:
                yield Finding("files", f"{name!a} has been changed, or its hash in {HASHES}.")


def _has_sources(names: Iterable[str]) -> bool:
    """Whether an FMU is native: those with Python have none."""
    return any(name.startswith("sources/") for name in names)


def _against_rules(path: Path, contents: dict[str, bytes]) -> list[Finding]:
    if not _is_plain(contents.get(_DESCRIPTION, b"")):
        # Entities may name files of this computer, and grow without bound.
        return [Finding("rules", f"{_DESCRIPTION} must be UTF-8 text without a document type; build the FMU again.")]
    try:
        problems = validate_fmu(str(path))
    except Exception as problem:  # FMPy raises plain exceptions
        problems = [str(problem)]
    if problems:
        return [Finding("rules", " ".join(str(problem).split())) for problem in problems]
    return [Finding("rules", "The model description follows FMI's rules.", is_problem=False)]


def _against_certificate(contents: dict[str, bytes]) -> list[Finding]:
    if MODEL_IN_FMU not in contents:
        return []
    try:
        text = certified(model_of_text(contents[MODEL_IN_FMU].decode("utf-8", "replace"), MODEL_IN_FMU))
    except ModelError as problem:
        return [Finding("spring", str(problem))]
    return [Finding("spring", f"{text[0].upper()}{text[1:]}.", is_problem=False)]


def _is_plain(content: bytes) -> bool:
    """Whether an XML file is in UTF-8 and declares no entities."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return False
    declared = _ENCODING.match(text)
    return "\0" not in text and "<!DOCTYPE" not in text and (declared is None or declared[1].lower() == "utf-8")


def _against_reference(path: Path, contents: dict[str, bytes]) -> list[Finding]:
    if MODEL_IN_FMU not in contents:
        return _against_table(path, contents)
    try:
        displacement, reference = _whole(contents[STIMULI])["displacement"], _whole(contents[REFERENCE])
        columns = [reference["force"], *(reference[name] for name in OUTPUTS[1:] if name in reference)]
        expected = np.transpose(columns)
    except (KeyError, TypeError, ValueError, csv.Error):
        displacement, expected = np.empty(0), np.empty((0, 1))
    if not (1 < displacement.size == len(expected) and np.isfinite(displacement).all() and np.isfinite(expected).all()):
        return [Finding("run", f"{REFERENCE} or {STIMULI} is not a table of finite numbers; build the FMU again.")]
    return _findings(compare_run(path, displacement, expected))


def _against_table(path: Path, contents: dict[str, bytes]) -> list[Finding]:
    """The same for the FMU of a system."""
    try:
        inputs, outputs = (_whole(contents[name]) for name in (STIMULI, REFERENCE))
        time = outputs.pop("time")
        steps = np.diff(inputs.pop("time"))
    except (KeyError, TypeError, ValueError, csv.Error):
        inputs, outputs, time, steps = {}, {}, np.empty(0), np.empty(0)
    columns = [*inputs.values(), *outputs.values(), time]
    is_table = bool(outputs) and len({column.size for column in columns}) == 1
    if not (is_table and np.isfinite(columns).all() and steps.size and steps[0] > 0.0):
        text = f"{REFERENCE} or {STIMULI} is not a table of finite numbers; build the FMU again."
        return [Finding("run", text)]
    return _findings(compare_table(path, float(steps[0]), inputs, outputs))


def _findings(report: CheckReport) -> list[Finding]:
    if report.problems:
        return [Finding("run", text) for text in report.problems]
    if report.not_run:
        return [Finding("run", report.not_run, is_problem=False)]
    text = (
        f"The reference comes out of {' and '.join(report.interfaces)} in {report.steps} steps, the force within "
        f"{report.force_difference:.1e} N."
    )
    return [Finding("run", text, is_problem=False)]


def _whole(table: bytes) -> dict[str, FloatArray]:
    """All columns of a table by name."""
    header, *rows = csv.reader(io.StringIO(table.decode("ascii")))
    columns = np.array(rows, dtype=np.float64).reshape(-1, len(header)).T
    return dict(zip(header, columns, strict=True))
