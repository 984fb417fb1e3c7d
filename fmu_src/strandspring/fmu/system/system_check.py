"""Whether the FMU of a system is valid and moves as the kernel does: validated, then run through FMPy."""

from __future__ import annotations

from pathlib import Path

from ...vibration.bodies.mounted import MountedSystem
from ..checks.check import CheckReport, validated
from ..checks.table_check import compare_table
from .system_reference import reference_run, reference_step
from .system_variables import SystemFmuOptions


def examine_system_fmu(path: Path, system: MountedSystem, options: SystemFmuOptions) -> CheckReport:
    """Validate the FMU of a system and compare a short run with the kernel; problems are in the report."""
    report = validated(path)
    return report if report.problems else compare_table(path, reference_step(options), *reference_run(system, options))
