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
from hypothesis import HealthCheck, settings

# The same examples at each run; --hypothesis-profile=others draws others. No clock decides.
settings.register_profile("others", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("same", settings.get_profile("others"), derandomize=True)
settings.load_profile("same")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell without job control starts background work so, and the programs that tests interrupt would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup's, likewise


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
    """Mark as quick what is neither slow nor long."""
    for item in items:
        if not any(map(item.get_closest_marker, ("slow", "long"))):
            item.add_marker("quick")
