"""The tests of the kernel with the kernel under the sanitizers of addresses and of undefined behaviour."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import instrumented
from tools import program


@pytest.mark.slow
def test_sanitizers_find_nothing() -> None:
    program("gcc", package="gcc libc6-dev")
    command = [sys.executable, instrumented.__file__, "-q", "tests/kernel"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1800, check=False)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]


@pytest.mark.slow
def test_the_library_of_the_plugin_is_used(tmp_path: Path) -> None:
    environment = {**os.environ, instrumented.VARIABLE: str(tmp_path / "none.so")}
    command = [sys.executable, "-m", "pytest", "-n", "0", "-p", "instrumented", "-q", "tests/kernel/test_points.py"]
    done = subprocess.run(
        command, cwd=instrumented.ROOT, env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 1
    assert "none.so: cannot open shared object file" in done.stdout
