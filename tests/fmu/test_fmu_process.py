"""Several FMUs in one process, native and Python-backed: forks, threads, states whose makers are gone, reloading."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from fmu_tools import OTHER, SPRING
from kernel_tools import HERE, build_folder, compiled
from native_tools import HEADERS, Library, library, python_library

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the host looks into /proc")
Fmus = tuple[Callable[[], Library], ...]
NATIVE: Fmus = (lambda: library(SPRING), lambda: library(OTHER))
PYTHON: Fmus = (lambda: python_library(SPRING), lambda: python_library(OTHER))
# What heaps may need to settle, after a tenth of the lives.
SETTLING = 256  # pages


@cache
def host() -> Path:
    source = HERE / "many_fmus.c"
    return compiled(build_folder() / "many_fmus", "-O1", f"-I{HEADERS}", source, "-ldl", "-lpthread")


def arguments(of: Library) -> list[str]:
    return [str(of.path), of.guid, (of.folder / "resources").as_uri()]


def run(task: str, count: int, fmus: Fmus) -> str:
    command = [str(host()), task, str(count), *(text for fmu in fmus for text in arguments(fmu()))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("task", ["together", "fork", "threads", "states"])
@pytest.mark.parametrize("fmus", [NATIVE, PYTHON, NATIVE + PYTHON], ids=["native", "python", "both"])
def test_fmus_of_one_process_do_not_meet(task: str, fmus: Fmus) -> None:
    run(task, 3, fmus)


@pytest.mark.slow
@pytest.mark.parametrize("fmus", [NATIVE, PYTHON], ids=["native", "python"])
def test_libraries_are_loaded_a_thousand_times(fmus: Fmus) -> None:
    run("reload", 1000, fmus)


@pytest.mark.slow
@pytest.mark.parametrize(("fmus", "count"), [(NATIVE[:1], 10_000), (PYTHON[:1], 10_000)], ids=["native", "python"])
def test_lives_leave_no_memory_behind(fmus: Fmus, count: int) -> None:
    pages = [int(line) for line in run("lives", count, fmus).split()]
    assert len(pages) == 10
    assert pages[-1] - pages[0] < SETTLING, pages
