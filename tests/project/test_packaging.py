"""What is installed and what its imports load: public names, schema, bytes that are the same everywhere."""

from __future__ import annotations

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

import strandspring

pytestmark = pytest.mark.long
ROOT = Path(__file__).resolve().parents[2]
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
