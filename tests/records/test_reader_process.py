"""Files read in another process: one that crashes, hangs or takes all memory is a damaged file, and leaves nothing."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import asammdf
import h5py
import numpy as np
import pytest

from strandspring.errors import RecordError
from strandspring.records.content import FileContent
from strandspring.records.formats import reader_process
from strandspring.records.formats.reader_process import read_in_process
from strandspring.records.reading import read_record

pytestmark = pytest.mark.long

X = np.linspace(0.0, 1.0, 50)

# A module that does to the process what damaged files do.
HOSTILE = """
import os, time
import numpy as np
from strandspring.records.channels import Channel

def read_tables(content):
    what = content.data.decode()
    if what == "crash":
        os.abort()
    if what == "hang":
        while True:
            pass
    if what == "memory":
        np.ones(10**9)
    if what == "print":
        os.write(1, b"printed")
    open(os.path.join(os.environ["TMPDIR"], "left"), "w").close()
    return [Channel("g", "x", "mm", 3, lambda: (np.arange(3.0), None))]
"""


@pytest.fixture(autouse=True)
def hostile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The module, in a folder that the package of formats is looked for in too."""
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


def content(text: str) -> FileContent:
    return FileContent("a.dat", text.encode(), "")


def test_values_come_from_the_other_process() -> None:
    _, (channel,) = read_in_process("hostile", "a file", content("print"))
    assert (channel.group, channel.name, channel.unit, channel.size, channel.timed) == ("g", "x", "mm", 3, False)
    values, times = channel.load()
    assert values.tolist() == [0.0, 1.0, 2.0]
    assert times is None


@pytest.mark.parametrize(
    ("what", "reason"), [("crash", "the library that reads it crashed"), ("memory", "more data than fits")]
)
def test_a_crash_or_all_memory_is_a_damaged_file(what: str, reason: str) -> None:
    with pytest.raises(RecordError, match=f"a.dat: is a file that is damaged or cut off, .*{reason}.*; export"):
        read_in_process("hostile", "a file", content(what))
    # The next file is read as ever.
    assert len(read_in_process("hostile", "a file", content(""))[1]) == 1


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of processor time are those of Linux")
def test_what_takes_too_long_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader_process, "_SECONDS", 0.5)
    with pytest.raises(RecordError, match="reading it takes too long"):
        read_in_process("hostile", "a file", content("hang"))


def test_one_process_reads_file_after_file() -> None:
    first = read_in_process("hostile", "a file", content(""))
    second = read_in_process("hostile", "a file", content(""))
    assert len(reader_process._running) == 2, "the channels of the first file are still wanted"
    del first, second
    gc.collect()
    assert list(reader_process._running) == reader_process._idle, "one of them waits for the next file"


def test_the_process_ends_with_its_parent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"], file["F"] = X, X
    reading = (
        "import os\n"
        "from strandspring.records.formats import reader_process\n"
        "from strandspring.records.reading import read_record\n"
        f"read_record({str(tmp_path / 'a.h5')!r})\n"
    )
    killed = f"{reading}print(*(p.pid for p in reader_process._running), flush=True)\nos.kill(os.getpid(), 9)\n"
    done = subprocess.run([sys.executable, "-c", killed], capture_output=True, text=True, check=False)
    process = int(done.stdout)
    assert done.stderr == ""
    for _ in range(100):
        status = Path(f"/proc/{process}/stat")
        if not status.exists() or status.read_text().split()[2] == "Z":
            break
        time.sleep(0.1)
    else:
        pytest.fail(f"process {process} has not ended")
    # The next program removes the folder that is left.
    subprocess.run([sys.executable, "-c", reading], check=True)


def test_a_channel_beyond_its_row_is_a_damaged_mdf_file(tmp_path: Path) -> None:
    # asammdf copies the bytes of a channel from where the file says that they are.
    path = tmp_path / "a.mf4"
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(X, X, name=name, unit=unit) for name, unit in (("x", "mm"), ("F", "N"))])
        file.save(path)
    data = path.read_bytes()
    assert len(read_record(path)) == X.size
    offset = (16).to_bytes(4, "little") + (64).to_bytes(4, "little")
    assert data.count(offset) == 1
    path.write_bytes(data.replace(offset, (2**31).to_bytes(4, "little") + offset[4:]))
    with pytest.raises(RecordError, match="is an MDF file that is damaged or cut off"):
        read_record(path)


def test_a_process_that_cannot_be_started_is_refused_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.executable", "/nonexistent/python")
    with pytest.raises(RecordError, match=r"a\.dat: is a file, and the process .* cannot be started .*; free some"):
        read_in_process("hostile", "a file", content(""))
