"""The commands that build, export, verify and read FMUs, one after the other in one folder, as a person last read them.

`said.json` holds them with status, output and written files; `python tests/fmi/test_fmu_commands.py` writes it anew,
also what a new command says whose place holds nothing.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import shlex
import sys
import tempfile
from pathlib import Path

import pytest

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[1] / folder) for folder in (".", "helpers")]

from fmu_tools import SPRING
from strandspring import Spring, build_fmu
from strandspring.cli.main import main
from strandspring.fmu.archive import write_archive
from terminal import unfolded

pytestmark = pytest.mark.long
KEPT = Path(__file__).with_name("said.json")
# What differs between computers and builds, and what is said only where nothing has been compiled yet.
COMPILED = re.compile(r"Compiling the spring for .*\n")
CHANGING = re.compile(
    r"(?<=\.fmu )\([^)]*\)"
    r"|\d+\.\d+\.\d+(\.dev\d+)?(\+\w+)?|[\d.]+ (KiB|k?B|MB|m?s|files)\b|[0-9a-f]{12,}|(x86_64|aarch64)-\w+|linux64"
)


def files() -> dict[str, bytes]:
    """All in the working folder."""
    return {path.as_posix(): path.read_bytes() for path in sorted(Path().rglob("*")) if path.is_file()}


def outputs() -> dict[str, list[object]]:
    """Of each command: status, output, errors, and the files that it wrote or changed."""
    for name in ("spring", "mount", "model"):
        Spring(SPRING, name, f"a {name}").save(f"{name}.json")
    content = json.loads(Path("spring.json").read_text())
    for file, name in (("evil", 'x"; int evil; //'), ("up", "../up"), ("option", "-o")):
        Path(f"{file}.json").write_text(json.dumps({**content, "name": name}))
    Path("bad.json").write_text("{}")
    Path("plain").write_text("")
    Path("box.toml").write_text("[body]\n")
    for folder in ("library", "other_library/StrandSpring", "a.b"):
        Path(folder).mkdir(parents=True)
    Path("library/package.mo").touch()
    Path("other_library/StrandSpring/package.mo").write_text("within ;\npackage Other\nend Other;\n")
    os.mkfifo("pipe.ssv")
    write_archive(Path("damaged.fmu"), {"modelDescription.xml": b"<damaged/>", "extra\x1b": b""})
    said = dict[str, list[object]]()
    for command in json.loads(KEPT.read_text(encoding="utf-8")):
        out, err, before, status = io.StringIO(), io.StringIO(), files(), 0
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                main(shlex.split(command))
            except SystemExit as leaving:
                status = int(leaving.code or 0)
        written = [name for name, content in files().items() if before.get(name) != content]
        assert status == 0 or not written, command
        texts = (unfolded(text.getvalue()).replace(str(Path.cwd()), "HERE") for text in (out, err))
        said[command] = [status, *(CHANGING.sub("*", COMPILED.sub("", text)) for text in texts), written]
    return said


def test_commands_say_and_write_what_was_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said = json.loads(json.dumps(outputs()))
    for command, kept in json.loads(KEPT.read_text(encoding="utf-8")).items():
        assert said.pop(command) == kept, command
    assert not said
    given = {"fmi": 3, "author": "A", "zero": 0.02, "platforms": "host"}
    # The command builds the bytes of the function, and with the settings of an FMU its own.
    for states in (False, True):
        made = build_fmu(Spring.load("spring.json"), "function", **given, states=states)  # type: ignore[arg-type]
        assert made.read_bytes() == Path("dist", made.name).read_bytes()
    for first, again in (("dist", "again"), ("author", "again_author")):
        assert Path(again, "spring_fmi3.fmu").read_bytes() == Path(first, "spring_fmi3.fmu").read_bytes()


if __name__ == "__main__":
    KEPT = KEPT.absolute()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        lines = [f"{json.dumps(command)}: {json.dumps(said)}" for command, said in outputs().items()]
        KEPT.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
