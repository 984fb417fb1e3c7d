"""Readers that others' files and folders cannot harm: processes of their own, and nothing beside a record executed."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import pytest

from springs import MOUNT
from strandspring import RecordError, Spring
from strandspring.records.content import FileContent
from strandspring.records.formats import reader_process
from strandspring.records.formats.reader_process import read_in_process
from tools import slow_but

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = Path(sysconfig.get_path("scripts")) / "strandspring"
# A module that does to the process what damaged files do.
HOSTILE = """
import os, time
import numpy as np
from strandspring.records.channels import Channel

def read_tables(content):
    what = content.data.decode()
    if what == "crash":
        os.abort()
    while what == "hang":
        pass
    if what == "memory":
        np.ones(10**9)
    if what == "print":
        os.write(1, b"printed")
    open(os.path.join(os.environ["TMPDIR"], "left"), "w").close()
    return [Channel("g", "x", "mm", 3, lambda: (np.arange(3.0), None))]
"""


@pytest.fixture
def hostile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The module, in a folder that the package of formats is looked for in too; no temporary file is left."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "sitecustomize.py").write_text(
        f"import strandspring.records.formats as f\nf.__path__.append({str(tmp_path)!r})\n"
    )
    (tmp_path / "hostile.py").write_text(HOSTILE)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    reader_process._stop_all()
    yield
    reader_process._stop_all()
    assert not list((tmp_path / "temporary").iterdir())


def of_hostile(text: str) -> Any:
    return read_in_process("hostile", "a file", FileContent("a.dat", text.encode(), ""))


@pytest.mark.usefixtures("hostile")
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of processor time are those of Linux")
@pytest.mark.parametrize(
    ("what", "reason"),
    [("crash", "the library that reads it crashed"), ("memory", "more data than fits"), ("hang", "takes too long")],
)
def test_what_crashes_hangs_or_takes_all_memory_is_a_damaged_file(
    what: str, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader_process, "_SECONDS", 0.5)
    with pytest.raises(RecordError, match=f"a.dat: is a file that is damaged or cut off, .*{reason}.*; export"):
        of_hostile(what)
    # The next file is read as ever.
    _, (channel,) = of_hostile("print")
    assert (channel.group, channel.name, channel.unit, channel.size, channel.timed) == ("g", "x", "mm", 3, False)
    values, times = channel.load()
    assert (values.tolist(), times) == ([0.0, 1.0, 2.0], None)


@pytest.mark.usefixtures("hostile")
def test_one_process_reads_file_after_file_or_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second = of_hostile(""), of_hostile("")
    assert len(reader_process._running) == 2, "the channels of the first file are still wanted"
    del first, second
    gc.collect()
    assert list(reader_process._running) == reader_process._idle, "one of them waits for the next file"
    reader_process._stop_all()
    monkeypatch.setattr("sys.executable", "/nonexistent/python")
    with pytest.raises(RecordError, match=r"a\.dat: is a file, and the process .* cannot be started .*; free some"):
        of_hostile("")


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


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, samples: Path) -> Path:
    """Records, a model, its FMU, and lures: files named like all modules that could be imported."""
    folder = tmp_path_factory.mktemp("beside") / "received"
    shutil.copytree(samples, folder)
    Spring(MOUNT, "mount").save(folder / "mount.json")
    shutil.copy(ROOT / "build_fmu.py", folder)
    names = {*sys.stdlib_module_names, *packages_distributions(), "sitecustomize", "usercustomize"} - {"strandspring"}
    for name in filter(str.isidentifier, names):
        (folder / f"{name}.py").write_text(LURE.format(marks=str(folder.parent / "marks"), folder=str(folder)))
    return folder


READING = "show plain.csv xlsx hdf5 mdf_4 tdms parquet_file uff xls ods mat npz -o page.html"
IDENTIFYING = "identify-many plain.csv xlsx --method two-stage --workers 2 -o models"


@pytest.mark.parametrize(
    "arguments",
    slow_but([READING, IDENTIFYING, "build mount.json --backend both -o dist", "build_fmu.py"], [IDENTIFYING]),
)
def test_a_command_executes_nothing_that_lies_in_the_current_folder(folder: Path, arguments: str) -> None:
    own = [sys.executable, "build_fmu.py", "mount.json", "-o", "dist"]
    command = own if arguments == "build_fmu.py" else [str(SCRIPT), *arguments.split()]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    marks = folder.parent / "marks"
    assert not marks.exists(), marks.read_text()
