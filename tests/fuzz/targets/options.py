"""Random command lines: every command with any of its options, with sensible and with absurd values.

What is accepted is finite, what is refused a sentence, and nothing is left half done. Options are read from the
commands themselves, so that a new one is tried, too; without those of a cluster.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import re
import shutil
import webbrowser
from functools import cache
from pathlib import Path
from typing import Any

import click
import numpy as np

from strandspring import Spring, SpringParameters
from strandspring.cli.main import COMMANDS, main, strandspring
from strandspring.docs import site
from targets.mutator import ABSURD

_MODEL = Path(__file__).resolve().parents[3] / "models/rubber_hinge.json"
# Values of options by their names; few of those that may take long with what they allow.
_GIVEN: dict[str, Any] = ABSURD["commands"]
_ABSURD = (*ABSURD["tokens"], *_GIVEN["files"], *ABSURD["of commands"])


def _refuse_constant(text: str) -> float:
    raise AssertionError(f"{text} in JSON")


def judged(arguments: list[str], folder: Path) -> int:
    """The exit status of a command that writes to a folder, which keeps the laws of all commands."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments)
            status = 0
        except SystemExit as leaving:
            status = int(leaving.code or 0)
    printed, said = out.getvalue(), err.getvalue()
    told = f"{arguments!r:.2000}\nstatus {status}\n{printed[:2000]}\n{said[-3000:]}"
    assert status in (0, 1, 2), told
    assert not re.search("Traceback|Warning", printed + said), told
    is_json = "--json" in arguments
    assert status != 1 or is_json or re.fullmatch(r"strandspring: .{10,}\.", said.splitlines()[-1]), told
    if is_json and (status == 0 or printed):
        content = json.loads(printed, parse_constant=_refuse_constant)
        assert content.get("error", {}).get("type") not in ("MemoryError", "OSError"), told
    assert is_json or status or not re.search(r"(?i)(?<![a-z_./])(nan|inf)(?![a-z_./])", printed), told
    for path in folder.rglob("*"):
        assert not path.name.startswith("."), f"{path} is left behind; {told}"
        is_text = path.is_file() and path.suffix in (".csv", ".json", ".ssv", ".mo")
        if status == 0 and is_text and path.stem.startswith(("out", "saved")):
            assert not re.search(r"(?i)\b(nan|inf|infinity)\b", path.read_text("utf-8")), f"{path}: {told}"
    return status


def trial(dice: random.Random, folder: Path) -> str:
    """One command line in a folder with records, a model and an FMU."""
    os.chdir(folder)
    webbrowser.open = lambda *_, **__: True
    site._build = lambda _source, built, _state: built.mkdir()  # takes seconds
    for name, content in _pieces().items():
        Path(name).write_bytes(content)
    Path("folder").mkdir()
    shutil.copy("record.csv", "folder")
    words: list[str] = []
    command: click.Command = strandspring
    while isinstance(command, click.Group):
        context = click.Context(command)
        words.append(dice.choice(list(COMMANDS) if not words else command.list_commands(context)))
        command = command.get_command(context, words[-1]) or command
    status = judged([*words, *_arguments(dice, command)], Path())
    return " ".join([("accepted", "refused", "wrong usage")[status], "by", *words])


def _arguments(dice: random.Random, command: click.Command) -> list[str]:
    """Arguments, and some options, of which few are absurd."""
    absurd, given = dice.choice((0.0, 0.05, 0.3)), []

    def value(one: click.Parameter) -> str:
        if dice.random() < absurd:
            return dice.choice(_ABSURD)
        if isinstance(one.type, click.Choice):
            return str(dice.choice(list(one.type.choices)))
        sensible = str((_GIVEN["sensible"] | _GIVEN["few"]).get(one.name, " ".join(_GIVEN["numbers"])))
        return dice.choice(sensible.split())

    options = [one for one in command.params if isinstance(one, click.Option) and one.name not in _GIVEN["left out"]]
    for one in options:
        if one.required or one.name in _GIVEN["always"] or dice.random() < min(0.4, 2.0 / len(options)):
            flag = max(one.opts, key=len)
            values = [value(one) for _ in range(0 if one.is_flag else one.nargs)]
            given += [f"{flag}={values[0]}"] if len(values) == 1 else [flag, *values]
    for argument in (one for one in command.params if isinstance(one, click.Argument)):
        count = 1 if argument.nargs == 1 or dice.random() < 0.8 else dice.randrange(3)
        given += [value(argument) for _ in range(count)]
    return given


@cache
def _pieces() -> dict[str, bytes]:
    """Content of the files that commands are given."""
    path = np.interp(np.linspace(0.0, 5.0, 201), np.arange(6), [0, 5, -5, 5, -5, 5])  # [mm]
    spring = Spring(SpringParameters((0.0, 50.0, 0.0, 2e5), (1.0,), 0.05, 800.0, 1.0, 1.0, 0.0, -0.005, 0.005))
    rows = "".join(f"{x:.6f},{f:.6f}\n" for x, f in zip(path, spring.response(1e-3 * path), strict=True))
    record = f"displacement [mm],force [N]\n{rows}".encode()
    shutil.copy(_MODEL, "model.json")
    assert judged(["build", "model.json", "-o", "."], Path()) == 0
    (fmu,) = Path().glob("*.fmu")
    model, built = _MODEL.read_bytes(), fmu.read_bytes()
    fmu.unlink()
    return {"record.csv": record, "cut.csv": record[:200], "empty.csv": b"", "model.json": model, "spring.fmu": built}
