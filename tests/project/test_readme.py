"""What the README says is what happens."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from readme import README, ROOT, blocks, program_with
from strandspring import Spring
from strandspring.core.parameters import SCALARS, SpringParameters
from strandspring.core.variables import variables


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what a user has, with the main job done in it."""
    folder = tmp_path_factory.mktemp("readme")
    (folder / "models").mkdir()
    (folder / "models" / "records").symlink_to(ROOT / "models" / "records")
    (folder / "build_fmu.py").write_bytes((ROOT / "build_fmu.py").read_bytes())
    done = run([sys.executable, "build_fmu.py"], folder)
    assert done.returncode == 0, done.stderr
    (folder / "build.txt").write_text(done.stdout, encoding="utf-8")
    return folder


def run(command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)


def test_the_main_job_says_what_it_did(folder: Path) -> None:
    said = (folder / "build.txt").read_text(encoding="utf-8")
    files = ("models/rubber_hinge.json", "dist/rubber_hinge.fmu", "dist/rubber_hinge_python.fmu")
    for promised in ("rmse", "RNL", "kappa_omega", *files, "valid; 401 steps"):
        assert promised in said, promised
    assert (folder / "dist/rubber_hinge.fmu").stat().st_size > 50_000
    assert (folder / "dist/rubber_hinge_python.fmu").stat().st_size > 50_000


def test_the_first_command_is_the_main_job_and_the_second_the_tests() -> None:
    first, second = blocks("sh")[0].splitlines()
    assert first == 'pip install ".[test]" && python build_fmu.py'
    assert second == "python -m pytest"


@pytest.mark.slow
def test_commands_run_in_order(folder: Path) -> None:
    model = folder / "models/rubber_hinge.json"
    for name, noise in (("loop.csv", "0.01"), ("other.csv", "0.02")):
        made = run(
            [sys.executable, "-m", "strandspring", "synthesize", "spring", str(model), "--noise", noise, "-o", name],
            folder,
        )
        assert made.returncode == 0, made.stderr
    for line in "".join(blocks("sh")[1:]).splitlines():
        program, *arguments = shlex.split(line)
        assert program == "strandspring"
        done = run([sys.executable, "-m", program, *arguments], folder)
        assert done.returncode == 0, (line, done.stderr)
    written = (
        "spring.json", "spring.html", "dist/spring.fmu", "dist/spring_python.fmu", "curves.png", "study.csv",
        "dist/spring.ssv", "dist/spring.ssp", "dist/StrandSpring/Records/spring.mo",
    )  # fmt: skip
    for name in written:
        assert (folder / name).stat().st_size > 0


@pytest.mark.slow
def test_python_programs_run_in_order(folder: Path) -> None:
    (folder / "program.py").write_text("\n".join(blocks("python")), encoding="utf-8")
    done = run([sys.executable, "-W", "error", "program.py"], folder)
    assert done.returncode == 0, done.stderr
    assert "RNL 0.9" in done.stdout
    assert "mJ of work done on the spring" in done.stdout
    assert (folder / "hinge.json").exists()
    assert "def simulate" in program_with("def simulate")


def test_the_table_of_symbols_is_the_fmus_table() -> None:
    table = README.split("| paper |", 1)[1].split("\n\n", 1)[0]
    lines = re.findall(r"^\|(.*)\|$", table, flags=re.MULTILINE)[1:]
    rows = [[cell.strip() for cell in line.split("|")] for line in lines]
    units = {v.name: v.unit for v in (*variables(1, 1), *variables(0, 1, 1))}
    listed = {}
    for _, python, fmu, unit in rows:
        names = re.findall(r"`([^`]+)`", fmu)
        listed[names[0]] = unit
        if python:
            (name,) = re.findall(r"`([^`]+)`", python)
            known = {*SpringParameters.__dataclass_fields__, *dir(Spring), "displacement", "omega_start"}
            assert name in known, name
    assert set(listed) == set(units)
    assert set(SCALARS) < set(listed)
    for name, unit in listed.items():
        expected = units[name] or ""
        assert unit == (f"{expected}/m^i" if name == "kE_0" else "1/m^i" if name == "kA_0" else expected), name
