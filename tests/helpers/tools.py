"""Tools that some tests need and that the extra `test` does not bring, and what is left to the slow tests.

A test whose tool is missing is skipped with the reason. Where STRANDSPRING_ALL_TOOLS is set, as in CI, it fails.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Collection, Iterable
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import pytest


def tool(module: str) -> Any:
    """A module of the extra `dev`; where it is called while a test file is loaded, all of its tests are skipped."""
    try:
        return import_module(module)
    except ModuleNotFoundError as problem:
        if problem.name != module.partition(".")[0]:
            raise
    return _missing(f'{module} is not installed: pip install "strandspring[dev]"')


def slow_but(values: Iterable[Any], kept: Collection[Any]) -> list[Any]:
    """Values of a parameter of tests, of which all but those kept are left to `-m slow`."""
    return [value if value in kept else pytest.param(value, marks=pytest.mark.slow) for value in values]


def ziglang(command: str) -> tuple[str, ...]:
    """The command that runs a compiler of ziglang."""
    tool("ziglang")
    return sys.executable, "-m", "ziglang", command


def program(*names: str, package: str) -> str:
    """The path of a program, by the first of its names that is found, of a package of Debian."""
    found = next(filter(None, map(shutil.which, names)), None)
    return found or _missing(f"{names[0]} is not on the path: apt-get install {package}")


def shared_data(name: str) -> Path:
    """A file or folder of the measured data beside the checkout, which the project does not hold."""
    path = Path(__file__).resolve().parents[3] / "shared" / "data" / name
    if not path.exists():
        pytest.skip(f"{name} is not in ../shared/data beside this checkout")
    return path


def _missing(reason: str) -> NoReturn:
    if "STRANDSPRING_ALL_TOOLS" in os.environ:
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason, allow_module_level=True)
