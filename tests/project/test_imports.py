"""What is loaded when the package is imported, and what may import what (see [tool.importlinter] in pyproject.toml)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import strandspring

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("module", ["strandspring", "strandspring.core.variables"])
def test_the_top_and_the_core_load_next_to_nothing(module: str) -> None:
    code = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert not loaded & {"numpy", "scipy", "pandas", "pint", "pydantic", "click", "matplotlib", "fmpy", "pythonfmu"}


def test_public_names_are_found_where_the_table_says() -> None:
    assert strandspring.__all__ == dir(strandspring)
    for name in strandspring.__all__:
        assert getattr(strandspring, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = strandspring.nothing
