"""Fixtures of several test files."""

from __future__ import annotations

import os
import signal
from pathlib import Path

# Before NumPy is imported: tests run on all cores, each with one thread.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# The many processes that tests start compile no module twice.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest
from hypothesis import settings

from fmu_tools import SPRING
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.model.modelfile import ModelFile

# Files whose tests take more than some 4 s together; all others are quick.
LONG = frozenset(
    """
    test_beside_records test_branched_fmu test_branched_isolation test_branched_paths
    test_certainty test_cli test_comparison test_constrained_fit test_content test_docstrings test_endings
    test_export_modelica test_fmi3_binaries test_fmi3_files test_fmu_errors test_fmu_python
    test_fmu_related_files test_fmu_tuning test_formats test_free_decay test_fuzz test_golden
    test_hard_numbers test_identification test_limits
    test_manners test_many test_masters test_measured_mounts test_modelfile
    test_native_build test_native_exchange test_native_kernel
    test_native_kernel_build test_native_rounding test_native_sources test_native_stack
    test_native_states_form test_ni test_packaging test_page test_pages test_paper test_path test_planning
    test_reader_process test_realtime_fmu test_realtime_header test_realtime_targets test_records_reading
    test_refusals_of_records test_resolution_fmu test_rig_effects test_saturation test_simulating
    test_simulation_page test_study test_study_runners
    test_system_study
    test_motion test_shock_spectra test_small_motion test_steady_vibration test_system_conformance
    test_system_fmu test_verdicts
    """.split()  # noqa: SIM905 - as a list it is fifty lines
)

# The same examples at each run; --hypothesis-profile=default draws others.
settings.register_profile("same", derandomize=True)
settings.load_profile("same")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell without job control starts background work so, and the programs that tests interrupt would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup's, likewise


@pytest.fixture(scope="session")
def native_fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The native FMU of SPRING with a binary for every platform: built once, for it takes seconds."""
    return build_native_fmu(
        ModelFile("spring", SPRING), tmp_path_factory.mktemp("native"), chosen_platforms("all"), zero=0.0
    )


def pytest_collectreport(report: pytest.CollectReport) -> None:
    """Name a file that was skipped as a whole, see `_note_skipped`."""
    _note_skipped(report.nodeid, report.skipped)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Name a test that was skipped, see `_note_skipped`."""
    _note_skipped(report.nodeid, report.skipped)


def _note_skipped(name: str, is_skipped: bool) -> None:
    """Add what was skipped to the file that STRANDSPRING_SKIPPED names, a line each, as pytest takes them by @FILE."""
    if is_skipped and (path := os.environ.get("STRANDSPRING_SKIPPED")):
        with Path(path).open("a") as file:
            file.write(f"{name}\n")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as quick what is neither slow nor in a long file."""
    for item in items:
        if item.get_closest_marker("slow") is None and item.path.stem not in LONG:
            item.add_marker("quick")
