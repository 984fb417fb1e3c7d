"""The paper's workflow as a script and as a notebook."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

from notebook import NOTEBOOK, notebook
from tools import tool


def test_the_notebook_is_the_script() -> None:
    assert NOTEBOOK.read_text(encoding="utf-8") == notebook(), "run python tests/helpers/notebook.py"
    nbformat.validate(nbformat.read(NOTEBOOK, as_version=4))


@pytest.mark.slow
def test_the_notebook_runs() -> None:
    tool("ipykernel")
    client = tool("nbclient").NotebookClient
    cells = client(nbformat.read(NOTEBOOK, as_version=4), timeout=300).execute().cells
    assert [cell for cell in cells if cell.cell_type == "code" and not cell.outputs] == []


@pytest.mark.slow
def test_the_script_runs_and_ranks_the_methods(tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error", "-m", "strandspring.examples.workflow"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.iterdir()) == []
    errors = {name: float(text) for name, text in re.findall(r"(\S+) +RMSE ([\d.]+) N", done.stdout)}
    # Of 40 seeds the paper's method as printed has 1.8 to 4.9 N, ours 1.0 to 1.9 N, refined less; the rms force is the
    # paper's 248.2 N by the choice of X and n.
    assert errors["refined"] < errors["two-stage"] < errors["paper"] < 5.0
    assert float(re.search(r"rms force ([\d.]+) N", done.stdout)[1]) == pytest.approx(248.2, abs=0.5)  # type: ignore[index]
    difference = float(re.search(r"FMU and model (\S+) N", done.stdout)[1])  # type: ignore[index]
    assert difference < 1e-10 * 248.2  # rounding
