"""Whether the FMU of a system is valid and moves as the kernel does: validated, then run through FMPy."""

from __future__ import annotations

import zipfile
from pathlib import Path

from fmpy.validation import validate_fmu

from ...vibration.bodies.mounted import MountedSystem
from ..checks.check import CheckReport
from ..checks.table_check import compare_table
from .system_reference import reference_run, reference_step
from .system_variables import SystemFmuOptions


def examine_system_fmu(path: Path, system: MountedSystem, options: SystemFmuOptions) -> CheckReport:
    """Validate the FMU of a system and compare a short run with the kernel; problems are in the report."""
    try:
        problems = tuple(str(problem).strip() for problem in validate_fmu(str(path)))
    except (OSError, zipfile.BadZipFile) as problem:
        problems = (f"It cannot be read: {problem}.",)
    if problems:
        return CheckReport(path, problems, "an invalid FMU is not run")
    return compare_table(path, reference_step(options), *reference_run(system, options))
