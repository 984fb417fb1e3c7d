"""What is installed and loaded, bytes that are the same everywhere, and what sources say of themselves."""

from __future__ import annotations

import ast
import doctest
import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

import architecture
import strandspring
from architecture import PACKAGE, ROOT

pytestmark = pytest.mark.long
IDENTIFY = """import numpy as np; from strandspring import identify
phase = np.linspace(0.0, 12.0, 300)
identify(0.01 * np.sin(phase), 100.0 * np.sin(phase + 0.1))"""
COMMAND = "from strandspring.cli.main import main; main('{} {}/models/rubber_hinge.json'.split())"
OF_COMMANDS = "click fmpy jinja2 markdown_it matplotlib pandas pydantic rich"
NOT_ASKED_FOR = """scipy pandas matplotlib rich strandspring.records.reading strandspring.loops.selection numpy.ma
strandspring.vibration.description.system_file strandspring.campaigns.jobs.cluster"""


@pytest.mark.parametrize(
    ("code", "forbidden"),
    [
        ("import strandspring, strandspring.core.variables", f"{OF_COMMANDS} numpy scipy pythonfmu"),
        (IDENTIFY, OF_COMMANDS),
        (COMMAND.format("isolate --mass 0.05", ROOT), NOT_ASKED_FOR),
        (COMMAND.format("build --platform host", ROOT), NOT_ASKED_FOR),
    ],
    ids=["import", "identify", "isolate", "build"],
)
def test_nothing_is_loaded_that_is_not_needed(code: str, forbidden: str, tmp_path: Path) -> None:
    program = f"{code}\nimport sys; print(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert set(forbidden.split()) & set(done.stdout.splitlines()[-1].split()) == set()


def test_public_names_are_found_where_the_table_says_and_the_schema_is_that_beside_the_models() -> None:
    assert strandspring.__all__ == dir(strandspring)
    assert all(getattr(strandspring, name) is not None for name in strandspring.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = strandspring.nothing
    published = (ROOT / "models/strandspring-model.schema.json").read_text(encoding="utf-8")
    assert strandspring.model_schema() == json.loads(published)


BUILD = """
import os, sys
from setuptools import build_meta
from strandspring.compiled import images
if "not compiled" in sys.argv:
    images.compiled = lambda unit, target: f"{unit} {target}".encode()
os.umask(int(sys.argv[1], 8))
print(getattr(build_meta, f"build_{sys.argv[2]}")("built"))
"""


@pytest.mark.slow
@pytest.mark.parametrize("images", ["not compiled", "compiled"])
def test_sources_and_wheel_have_the_same_bytes_wherever_they_are_built(images: str, tmp_path: Path) -> None:
    """Once as here, once from a folder of another name with files of other times and permissions; there the wheel is
    built of the archive of the sources, by a compiler with an empty cache.
    """

    def built(what: str, folder: Path, umask: str = "022") -> Path:
        environment = {**os.environ, "PYTHONPATH": str(folder / "fmu_src")}
        environment.pop("SOURCE_DATE_EPOCH", None)
        if umask != "022":
            environment["ZIG_GLOBAL_CACHE_DIR"] = str(tmp_path / "cache")
        command = [sys.executable, "-c", BUILD, umask, what, images]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)
        return folder / "built" / done.stdout.splitlines()[-1]

    one, other = tmp_path / "one", tmp_path / "a longer name"
    unwanted = "__pycache__", "*.egg-info", ".git", ".venv*", ".*_cache", ".hypothesis", "build"
    for folder in (one, other):
        shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(*unwanted))
    for path in other.rglob("*"):
        path.chmod(path.stat().st_mode | 0o020)
        os.utime(path, (1e9, 1e9))
    archive = built("sdist", other, "002")
    assert archive.read_bytes() == built("sdist", one).read_bytes()
    with tarfile.open(archive) as members:
        members.extraction_filter = getattr(tarfile, "data_filter", None)  # not in Python 3.11.3
        members.extractall(tmp_path)  # noqa: S202 - it was built above
    unpacked = tmp_path / archive.name.removesuffix(".tar.gz")
    assert built("wheel", unpacked, "002").read_bytes() == built("wheel", one).read_bytes()


def test_a_package_index_gets_no_links_into_the_repository() -> None:
    """The installed package's description is the README without pictures and links that only a checkout has."""
    installed = importlib.metadata.metadata("strandspring")
    # The backport of importlib.metadata, which dask may have loaded, makes a header of it.
    description = str(installed["Description"] or installed.get_payload())
    assert description.startswith("# strandspring")
    assert not re.search(r"\[Python\]|<img|\]\((?!https?:)", description)


def test_the_picture_of_the_architecture_is_drawn_from_the_imports_and_every_folder_has_its_words() -> None:
    page = architecture.PAGE.read_text(encoding="utf-8")
    assert architecture.PICTURE.findall(page) == [architecture.picture()], "run python tests/helpers/architecture.py"
    assert [room for room in architecture.rooms() if f"**{room}**" not in page.split()] == []


def test_every_fault_that_was_named_has_its_test() -> None:
    for line in (ROOT / "tests" / "faults.txt").read_text(encoding="utf-8").splitlines()[1:]:
        _issue, _fault, place = line.split(" | ")
        file, _, name = place.partition("::")
        assert f"def {name}(" in (ROOT / file).read_text(encoding="utf-8"), line


def test_dataclasses_are_frozen_and_those_with_arrays_compare_as_themselves() -> None:
    """Strokes, the tally and the summary of a batch are made step by step."""
    for path in PACKAGE.rglob("*.py"):
        for made in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(made, ast.ClassDef) and made.name not in ("Strokes", "Tally", "BatchSummary"):
                types = " ".join(ast.unparse(one.annotation) for one in made.body if isinstance(one, ast.AnnAssign))
                flags = "frozen=True, eq=False" if re.search("Array|DataFrame", types) else "frozen=True"
                said = [ast.unparse(one) for one in made.decorator_list if "dataclass" in ast.unparse(one)]
                assert not said or flags in said[0], made.name


@pytest.mark.slow
def test_examples_in_docstrings_give_what_they_show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    files = [path for path in PACKAGE.rglob("*.py") if ">>> " in path.read_text(encoding="utf-8")]
    assert len(files) >= 3
    for path in files:
        name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
        ran = doctest.testmod(importlib.import_module(name))
        assert (ran.attempted > 0, ran.failed) == (True, 0), name
    assert list(tmp_path.iterdir()) == []


def test_templates_escape_what_they_are_given() -> None:
    """No environment of Jinja without autoescape, and no template that undoes it."""
    sources = "".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))
    environments = re.findall(r"= Environment\(", sources)
    assert len(environments) == sources.count("autoescape=True") >= 2
    assert not re.search(r"\bTemplate\(", sources)
    templates = list(PACKAGE.rglob("*.j2"))
    assert len(templates) >= 3
    for template in templates:
        assert not re.search(r"\|\s*safe\b|autoescape", template.read_text(encoding="utf-8")), template.name
