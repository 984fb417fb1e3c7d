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
from functools import partial
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
class Check:
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


def verify_fmu(path: Path) -> list[Check]:
    """Compare every file with its hash, the model description with FMI's rules, the spring with its certificate, and
    runs with the reference result.

    An FMU whose files are not as they were built is not run. Only binaries of an FMU with sources may have been added
    or compiled anew: the run, then in a process of its own, shows what the one for this computer is worth. A
    Python-backed FMU runs in such a process, too: its own code may end it.
    """
    try:
        contents = _contents(path)
        checks = list(_changed(contents))
    except _DamagedError as problem:
        return [Check("files", str(problem))]
    if not any(check.is_problem for check in checks):
        which = f"The other {len(contents) - len(checks)}" if checks else f"{len(contents)}"
        checks.append(Check("files", f"{which} files are unchanged since the build.", is_problem=False))
    runs_here = len(checks) == 1 and _has_sources(contents)
    checks += [*_against_rules(path, contents), *_against_certificate(contents)]
    if any(check.is_problem for check in checks):
        return [*checks, Check("run", "It was not run.", is_problem=False)]
    return [*checks, *(_against_reference(path, contents) if runs_here else _apart(path))]


def _apart(path: Path) -> list[Check]:
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
                Check("run", "Its binary for this computer ends the process that runs it; build or compile it again.")
            ]


def _work_in(folder: Path) -> None:
    tempfile.tempdir = str(folder)


def _alone(path: Path) -> list[Check]:
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


def _changed(contents: dict[str, bytes]) -> Iterator[Check]:
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
            yield Check("files", f"{name!a} is missing.")
        elif hashlib.sha256(contents[name]).hexdigest() != hashes.get(name):
            binary = _BINARY.fullmatch(name)
            if has_sources and binary and binary["library"] in libraries:
                text = f"{name!a} is not of this build: it has been compiled elsewhere, or is damaged"
                is_run = binary["folder"] == folder and name.endswith(sharedLibraryExtension)
                judged = (
                    "the run below decides" if is_run else "it is not run on this computer, so verify it on its own"
                )
                yield Check("files", f"{text}; {judged}.", is_problem=False)
            elif name not in hashes:
                yield Check("files", f"{name!a} has been added: it is not in {HASHES}.")
            else:
                yield Check("files", f"{name!a} has been changed, or its hash in {HASHES}.")


def _has_sources(names: Iterable[str]) -> bool:
    """Whether an FMU is native: those with Python have none."""
    return any(name.startswith("sources/") for name in names)


def _against_rules(path: Path, contents: dict[str, bytes]) -> list[Check]:
    if not _is_plain(contents.get(_DESCRIPTION, b"")):
        # Entities may name files of this computer, and grow without bound.
        return [Check("rules", f"{_DESCRIPTION} must be UTF-8 text without a document type; build the FMU again.")]
    try:
        problems = validate_fmu(str(path))
    except Exception as problem:  # FMPy raises plain exceptions
        problems = [str(problem)]
    if problems:
        return [Check("rules", " ".join(str(problem).split())) for problem in problems]
    return [Check("rules", "The model description follows FMI's rules.", is_problem=False)]


def _against_certificate(contents: dict[str, bytes]) -> list[Check]:
    if MODEL_IN_FMU not in contents:
        return []
    try:
        text = certified(model_of_text(contents[MODEL_IN_FMU].decode("utf-8", "replace"), MODEL_IN_FMU))
    except ModelError as problem:
        return [Check("spring", str(problem))]
    return [Check("spring", f"{text[0].upper()}{text[1:]}.", is_problem=False)]


def _is_plain(content: bytes) -> bool:
    """Whether an XML file is in UTF-8 and declares no entities."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return False
    declared = _ENCODING.match(text)
    return "\0" not in text and "<!DOCTYPE" not in text and (declared is None or declared[1].lower() == "utf-8")


def _against_reference(path: Path, contents: dict[str, bytes]) -> list[Check]:
    no_table = [Check("run", f"{REFERENCE} or {STIMULI} is not a table of finite numbers; build the FMU again.")]
    try:
        inputs, outputs = (_whole(contents[name]) for name in (STIMULI, REFERENCE))
        is_table = np.isfinite([*inputs.values(), *outputs.values()]).all()
        step = float(np.diff(inputs.pop("time"))[0])
        del outputs["time"]
        if MODEL_IN_FMU in contents:
            columns = [outputs["force"], *(outputs[name] for name in OUTPUTS[1:] if name in outputs)]
            run = partial(compare_run, path, inputs["displacement"], np.transpose(columns))
        else:
            run = partial(compare_table, path, step, inputs, outputs)
    except (LookupError, TypeError, ValueError, csv.Error):
        return no_table
    return _of_run(run()) if is_table and step > 0.0 else no_table


def _of_run(report: CheckReport) -> list[Check]:
    if report.problems:
        return [Check("run", text) for text in report.problems]
    if report.not_run:
        return [Check("run", report.not_run, is_problem=False)]
    within = f"within {report.force_difference:.1e} N" if report.force_difference else "exactly"
    text = f"The reference run is reproduced {within} ({report.steps} steps, {' and '.join(report.interfaces)})."
    return [Check("run", text, is_problem=False)]


def _whole(table: bytes) -> dict[str, FloatArray]:
    """All columns of a table by name."""
    header, *rows = csv.reader(io.StringIO(table.decode("ascii")))
    columns = np.array(rows, dtype=np.float64).reshape(-1, len(header)).T
    return dict(zip(header, columns, strict=True))
