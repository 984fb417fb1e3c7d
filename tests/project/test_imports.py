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


@pytest.mark.parametrize("command", [("isolate", "--mass", "0.05"), ("build", "--platform", "host")])
def test_commands_about_one_spring_load_neither_scipy_nor_what_records_and_systems_need(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    code = "import sys; from strandspring.cli.main import main; main(sys.argv[1:]); print(*sys.modules)"
    model = str(ROOT / "models/rubber_hinge.json")
    done = subprocess.run(
        [sys.executable, "-c", code, *command, model], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    loaded = set(done.stdout.splitlines()[-1].split())
    assert "numpy" in loaded
    assert not loaded & {"scipy", "pandas", "matplotlib", "rich", "strandspring.vibration.description.system_file"}
    assert not loaded & {"strandspring.identification.identify_records", "strandspring.campaigns.jobs.cluster"}
    assert not loaded & {"strandspring.records.reading", "strandspring.loops.selection", "numpy.ma"}


def test_public_names_are_found_where_the_table_says() -> None:
    assert strandspring.__all__ == dir(strandspring)
    for name in strandspring.__all__:
        assert getattr(strandspring, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = strandspring.nothing
