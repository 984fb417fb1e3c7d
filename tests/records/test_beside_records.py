"""Python files that lie beside records, models and FMUs are never executed, whatever modules they are named like."""

from __future__ import annotations

import shutil
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import packages_distributions
from multiprocessing import spawn
from pathlib import Path

import pytest
from test_formats import FORMATS, text

from springs import MOUNT
from strandspring import Spring
from strandspring.examples import system_models
from strandspring.ground.isolated import ISOLATED, isolated_processes
from tools import slow_but

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = Path(sysconfig.get_path("scripts")) / "strandspring"
# All that could be imported, and what Python imports when it starts; `python -m strandspring` would run another one.
MODULES = {*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize"} - {"strandspring"}
# Leaves its name, and then is the module that it is named like.
LURE = """
import sys
with open({marks!r}, "a") as marks:
    marks.write(__name__ + "\\n")
places = sys.path[:]
sys.path[:] = [place for place in places if place not in ("", {folder!r})]
del sys.modules[__name__]
__import__(__name__)
sys.path[:] = places
"""
COMMANDS = (
    "--help",
    f"show {' '.join(FORMATS)} -o page.html",
    "identify xlsx --method two-stage -o spring.json --report spring.html",
    "identify-many record.csv xlsx --method two-stage --workers 2 -o models",
    "predict mount.json xlsx -o predicted.csv",
    "info mount.json ods",
    "info mount.fmu",
    "compare mount.json mount.json --plot difference.png",
    "synthesize spring mount.json --amplitude 5 -o synthesized.csv",
    "build parquet_file --method two-stage --models models -o dist",
    "build mount.fmu --backend both -o dist",
    "build electronics_box.toml --candidate standard -o dist",
    "verify mount.fmu mount_python.fmu",
    "export mount.json --ssv --modelica --ssp --c --mass 5 -o exported",
    "isolate mount.json --mass 5 --points 20 --plot curves.svg",
    "simulate gun_cradle.toml --draws 16 -o figures.csv",
    "study corner_shear.json --mass 4:6:3 --draws 4 --workers 2 -o study.csv",
    "docs limits --text",
)


class Folder:
    """A folder that holds records, a model, its FMUs, a system, and lures."""

    def __init__(self, path: Path) -> None:
        self.path, self.marks = path / "received", path / "marks.txt"
        shutil.copytree(system_models.SYSTEMS, self.path)
        (self.path / "record.csv").write_text(text())
        for name, write in FORMATS.items():
            write(self.path / name)
        mount = Spring(MOUNT, "mount")
        mount.save(self.path / "mount.json")
        mount.build_fmu(self.path)
        mount.build_fmu(self.path, backend="python")
        (self.path / "nothing.py").touch()
        shutil.copy(ROOT / "build_fmu.py", self.path)
        content = LURE.format(marks=str(self.marks), folder=str(self.path))
        for name in filter(str.isidentifier, MODULES):
            (self.path / f"{name}.py").write_text(content)

    def executed(self, *command: str | Path) -> set[str]:
        """Which lures a command executes."""
        self.marks.write_text("")
        done = subprocess.run(command, cwd=self.path, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, done.stderr
        return set(self.marks.read_text().split())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    return Folder(tmp_path_factory.mktemp("beside"))


@pytest.mark.parametrize("arguments", slow_but(COMMANDS, COMMANDS[1:4]))
def test_a_command_executes_nothing_that_lies_in_the_current_folder(folder: Folder, arguments: str) -> None:
    assert folder.executed(SCRIPT, *arguments.split()) == set()


def test_nor_does_the_script_of_a_checkout(folder: Folder) -> None:
    assert folder.executed(sys.executable, "build_fmu.py", "mount.json", "-o", "dist") == set()


@pytest.mark.parametrize(
    "arguments", ["strandspring info mount.json xlsx", "strandspring.examples.system_models examples"]
)
def test_run_as_a_module_no_more_is_executed_than_python_executes_itself(folder: Folder, arguments: str) -> None:
    of_python = folder.executed(sys.executable, "-m", "nothing")
    assert len(of_python) < 5
    assert folder.executed(sys.executable, "-m", *arguments.split()) == of_python


def test_what_a_program_starts_by_itself_is_as_before() -> None:
    before = spawn.get_command_line()

    def isolated(_: int) -> list[str]:
        with isolated_processes():
            return spawn.get_command_line()

    with ThreadPoolExecutor() as pool:
        assert all(tuple(line[-5:-3])[-len(ISOLATED) :] == ISOLATED for line in pool.map(isolated, range(100)))
    assert spawn.get_command_line() == before
