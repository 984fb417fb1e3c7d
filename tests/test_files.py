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


def refusal(path: str | Path, maximum: int = 100) -> str:
    with pytest.raises(ModelError) as caught:
        read_text(path, maximum, "a model file", ModelError)
    return str(caught.value).removeprefix(str(path))


def test_only_regular_files_of_a_bounded_size_are_read(tmp_path: Path) -> None:
    (tmp_path / "text").write_bytes(b"a\r\nb\rc\n")
    assert read_text(tmp_path / "text", 100, "a model file", ModelError) == "a\nb\nc\n"
    (tmp_path / "marked").write_bytes(b"\xef\xbb\xbfa")
    assert read_text(tmp_path / "marked", 100, "a model file", ModelError) == "a"
    assert refusal(tmp_path) == ": is a folder; give the path of a model file."
    assert refusal(tmp_path / "none") == ": no such file; check the path."
    os.mkfifo(tmp_path / "pipe")
    assert refusal(tmp_path / "pipe") == ": is not a regular file; give the path of a model file."
    assert refusal("/dev/zero") == ": is not a regular file; give the path of a model file."
    assert refusal(tmp_path / "text" / "more").startswith(": cannot be read (Not a directory); ")
    assert refusal(tmp_path / "text", 3) == ": has 7 bytes, and a model file may have at most 3; give a smaller one."
    (tmp_path / "latin").write_bytes(b"\xe9")
    assert refusal(tmp_path / "latin") == ": is not UTF-8 text; give the path of a model file."
    assert "is not a possible path" in refusal("a\0b")
    assert "cannot be read (File name too long)" in refusal("x" * 5000)
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    assert "cannot be read (Too many levels of symbolic links)" in refusal(loop)


def test_a_file_without_a_size_is_bounded_while_it_is_read() -> None:
    # Files of /proc say that they have no bytes.
    assert read_bytes("/proc/self/maps", 10_000_000, "a model file", ModelError)
    assert refusal("/proc/self/maps", 10) == ": grows while it is read; give a model file that is complete."


def test_nothing_in_a_name_steers_a_terminal() -> None:
    assert refusal("\x1b[31m\udcff\n").startswith("\ufffd[31m\ufffd\ufffd: ")


def test_links_to_themselves_and_impossible_names_are_refused(tmp_path: Path) -> None:
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    for path in (loop, tmp_path / "a\0b", tmp_path / ("x" * 300), tmp_path / ("y" * 5000)):
        with pytest.raises(StrandspringError, match="cannot be written"):
            write_text(path, "text")
    assert [path.name for path in tmp_path.iterdir()] == ["loop"]
    assert loop.is_symlink()


FULL_DISK = """
import resource, sys
from strandspring.ground.files import write_text
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
write_text(sys.argv[1], "new" * 1000)
"""


def test_what_does_not_fit_on_the_disk_leaves_the_old_file(tmp_path: Path) -> None:
    write_text(tmp_path / "file", "old")
    # In a child: the limit would also stop the log of pytest.
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(tmp_path / "file")], stderr=subprocess.PIPE, text=True, check=False
    )
    assert re.search(r"StrandspringError: .*file cannot be written: File too large; check ", done.stderr)
    assert (tmp_path / "file").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_the_content_is_on_the_disk_before_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    fsync, rename = os.fsync, os.rename
    monkeypatch.setattr(os, "fsync", lambda number: (calls.append("fsync"), fsync(number))[1])
    monkeypatch.setattr(os, "replace", lambda one, other: (calls.append("replace"), rename(one, other))[1])
    write_text(tmp_path / "file", "text")
    assert calls == ["fsync", "replace", "fsync"]


KILLED = """
import os, signal, sys
from pathlib import Path
from strandspring.ground.files import replacing
with replacing(Path(sys.argv[1])) as part:
    part.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_killed_programs_have_left_is_removed(tmp_path: Path) -> None:
    file = tmp_path / "file"
    subprocess.run([sys.executable, "-c", KILLED, str(file)], check=False)
    (left,) = tmp_path.iterdir()
    assert re.fullmatch(r"\.file\.[0-9a-f]{8}\.part", left.name)
    write_text(file, "of a program that may still begin")
    assert left.exists()
    old = time.time() - 120.0
    os.utime(left, (old, old))
    others = [tmp_path / ".file2.01234567.part", tmp_path / "file.01234567.part", tmp_path / ".file.part.txt"]
    for other in others:
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


def test_a_file_can_be_written_by_two_at_a_time(tmp_path: Path) -> None:
    file = tmp_path / "file"
    with replacing(file) as one, replacing(file) as other:
        one.write_text("one")
        other.write_text("other")
    assert file.read_text() == "one"
    assert list(tmp_path.iterdir()) == [file]


def test_text_in_a_table_is_never_a_formula(tmp_path: Path) -> None:
    texts = ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "a=1", "", "'", "1"]
    numbers = [-1.5, 2, None, True, np.float64(-0.1), np.int64(-3)]
    write_csv(tmp_path / "table.csv", ["=head", "b"], [*((text, -1.0) for text in texts), numbers, iter(["-", -1])])
    with (tmp_path / "table.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["'=head", "b"]
    assert [row[0] for row in rows[:-2]] == [*(f"'{text}" for text in texts[:5]), "' =1", *texts[6:]]
    assert {row[1] for row in rows[:-2]} == {"-1.0"}
    assert rows[-2:] == [["-1.5", "2", "", "True", "-0.1", "-3"], ["'-", "-1"]]
