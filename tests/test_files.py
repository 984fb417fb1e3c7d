"""Reading what comes from outside, and writing completely or not at all."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from strandspring.errors import ModelError, StrandspringError
from strandspring.ground.files import _parts, read_bytes, read_text, replacing, write_csv, write_text
from strandspring.ground.locks import lock

FULL_DISK = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
write_text(Path(sys.argv[1]), "new" * 1000)
"""
KILLED = """
with replacing(Path(sys.argv[1])) as part:
    part.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def in_child(program: str, file: Path) -> str:
    """Standard error of a program that writes the file."""
    imports = "import os, signal, sys\nfrom pathlib import Path\nfrom strandspring.ground.files import *\n"
    command = [sys.executable, "-c", imports + program, str(file)]
    return subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False).stderr


def refusal(path: str | Path, maximum: int = 100) -> str:
    with pytest.raises(ModelError) as caught:
        read_text(path, maximum, "a model file", ModelError)
    return str(caught.value).removeprefix(str(path))


def test_only_regular_files_of_a_bounded_size_are_read(tmp_path: Path) -> None:
    text = tmp_path / "text"
    text.write_bytes(b"\xef\xbb\xbfa\r\nb\rc\n")
    assert read_text(text, 100, "a model file", ModelError) == "a\nb\nc\n"
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        assert refusal(path) == ": is not a regular file; give the path of a model file."
    assert refusal(tmp_path) == ": is a folder; give the path of a model file."
    assert refusal(tmp_path / "none") == ": no such file; check the path."
    assert refusal(text / "more").startswith(": cannot be read (Not a directory); ")
    assert refusal(text, 3) == ": has 10 bytes, and a model file may have at most 3; give a smaller one."
    # Files of /proc say that they have no bytes.
    assert read_bytes("/proc/self/maps", 10_000_000, "a model file", ModelError)
    assert refusal("/proc/self/maps", 10) == ": grows while it is read; give a model file that is complete."
    text.write_bytes(b"\xe9")
    assert refusal(text) == ": is not UTF-8 text; give the path of a model file."
    # Nothing in a name steers a terminal.
    assert refusal("\x1b[31m\udcff\n").startswith("\ufffd[31m\ufffd\ufffd: ")


def test_links_to_themselves_and_impossible_names_are_refused(tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    for path in (loop, tmp_path / "a\0b", tmp_path / ("x" * 300), tmp_path / ("y" * 5000)):
        assert re.search("cannot be read|not a possible path", refusal(path))
        with pytest.raises(StrandspringError, match="cannot be written"):
            write_text(path, "text")
    assert [path.name for path in tmp_path.iterdir()] == ["loop"]


def test_files_keep_their_rights_and_links(tmp_path: Path) -> None:
    new, link, before = tmp_path / "new", tmp_path / "link", os.umask(0o027)
    try:
        write_text(new, "a")
    finally:
        os.umask(before)
    assert new.stat().st_mode & 0o777 == 0o640
    new.chmod(0o604)
    link.symlink_to("new")
    write_text(link, "b")
    assert (link.is_symlink(), new.read_text(), new.stat().st_mode & 0o777) == (True, "b", 0o604)


@pytest.mark.long
def test_a_full_disk_leaves_the_old_file_and_killed_programs_nothing_for_long(tmp_path: Path) -> None:
    file = tmp_path / "file"
    write_text(file, "old")
    assert re.search(r"StrandspringError: .*file cannot be written: File too large; check ", in_child(FULL_DISK, file))
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]
    in_child(KILLED, file)
    (left,) = set(tmp_path.iterdir()) - {file}
    assert re.fullmatch(r"\.file\.[0-9a-f]{8}\.part", left.name)
    write_text(file, "of a program that may still begin")
    assert left.exists()
    old = time.time() - 120.0
    others = [tmp_path / ".file2.01234567.part", tmp_path / "file.01234567.part", tmp_path / ".file.part.txt"]
    for other in (left, *others):
        other.touch()
        os.utime(other, (old, old))
    with left.open("rb") as holder:
        assert lock(holder.fileno())
        _parts.cache_clear()
        write_text(file, "while another writes")
        assert left.exists()
    _parts.cache_clear()
    write_text(file, "text")
    assert sorted(tmp_path.iterdir()) == sorted([file, *others])


def test_the_content_is_on_the_disk_before_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    fsync, rename = os.fsync, os.rename
    monkeypatch.setattr(os, "fsync", lambda number: (calls.append("fsync"), fsync(number))[1])
    monkeypatch.setattr(os, "replace", lambda one, other: (calls.append("replace"), rename(one, other))[1])
    write_text(tmp_path / "file", "text")
    assert calls == ["fsync", "replace", "fsync"]
    with replacing(tmp_path / "file") as one, replacing(tmp_path / "file") as other:  # two at a time
        one.write_text("one")
        other.write_text("other")
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "file") as part:  # noqa: PT012
        part.write_text("half")
        raise KeyboardInterrupt
    assert [path.read_text() for path in tmp_path.iterdir()] == ["one"]


def test_text_in_a_table_is_never_a_formula(tmp_path: Path) -> None:
    texts, safe = ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1"], ["a=1", "", "'", "1"]
    numbers = [-1.5, 2, None, True, np.float64(-0.1), np.int64(-3)]
    write_csv(tmp_path / "table.csv", ["=head", "b"], [*((text, -1.0) for text in (*texts, *safe)), numbers])
    with (tmp_path / "table.csv").open(newline="", encoding="utf-8") as file:
        header, *rows, last = csv.reader(file)
    assert header == ["'=head", "b"]
    assert [row[0] for row in rows] == [*(f"'{text}" for text in texts[:5]), "' =1", *safe]
    assert last == ["-1.5", "2", "", "True", "-0.1", "-3"]
