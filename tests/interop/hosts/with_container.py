"""FMU Manipulation Toolbox: its check of the FMU, then a container around the FMU, which FMPy runs."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import fmpy
import numpy as np

import with_fmpy
from motion import STEP

CHECKED = ("This FMU seems to be compliant with FMI-{}.0.", "No semantic error against the FMI-{} standard.")


def _said(program: str, *arguments: str, folder: Path) -> str:
    command = [str(Path(sys.executable).with_name(program)), *arguments]
    done = subprocess.run(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def run(fmu: str, kind: str) -> tuple[np.ndarray, ...]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(fmu, folder / "spring.fmu")
        said = _said("fmutool", "-input", "spring.fmu", "-check", folder=folder)
        fmi = fmpy.read_model_description(fmu).fmiVersion[0]
        assert all(sentence.format(fmi) in said for sentence in CHECKED), said
        (folder / "box.csv").write_text("rule;from_fmu;from_port;to_fmu;to_port\nFMU;spring.fmu;;;\n", encoding="utf-8")
        _said("fmucontainer", "-container", f"box.csv:{STEP}", "-fmu-directory", ".", folder=folder)
        return with_fmpy.run(str(folder / "box.fmu"), kind)
