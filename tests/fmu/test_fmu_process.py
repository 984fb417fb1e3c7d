"""Several native FMUs in one process: forks, threads, states whose makers are gone, reloading."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from fmu_tools import OTHER, SPRING
from kernel_tools import HERE, build_folder, compiled
from native_tools import HEADERS, Library, library
from strandspring import SpringParameters

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the host looks into /proc")
# What heaps may need to settle, after a tenth of the lives.
SETTLING = 256  # pages


@cache
def host() -> Path:
    source = HERE / "many_fmus.c"
    return compiled(build_folder() / "many_fmus", "-O1", f"-I{HEADERS}", source, "-ldl", "-lpthread")


def arguments(of: Library) -> list[str]:
    return [str(of.path), of.guid, (of.folder / "resources").as_uri()]


def run(task: str, count: int, *springs: SpringParameters) -> str:
    command = [str(host()), task, str(count), *(text for spring in springs for text in arguments(library(spring)))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("task", ["together", "fork", "threads", "states"])
def test_fmus_of_one_process_do_not_meet(task: str) -> None:
    run(task, 3, SPRING, OTHER)


@pytest.mark.slow
def test_libraries_are_loaded_a_thousand_times() -> None:
    run("reload", 1000, SPRING, OTHER)


@pytest.mark.slow
def test_lives_leave_no_memory_behind() -> None:
    pages = [int(line) for line in run("lives", 10_000, SPRING).split()]
    assert len(pages) == 10
    assert pages[-1] - pages[0] < SETTLING, pages
