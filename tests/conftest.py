"""Fixtures of several test files."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from fmu_tools import SPRING
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.model.modelfile import ModelFile

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
