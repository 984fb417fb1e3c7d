"""Random command lines: every command with any of its options, with sensible and with absurd values.

What is accepted must be finite, what is refused a sentence, and nothing may be left half done. Options are read from
the commands themselves, so that a new one is tried, too; without those of a cluster.
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
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import click
import numpy as np

from strandspring.cli.main import COMMANDS, main, strandspring
from strandspring.docs import site
from targets.made import numpy_of, refuse_constant

_ROOT = Path(__file__).resolve().parents[3]
_ABSURD = (
    "", " ", "-", "--", "0", "-1", "1e308", "-1e308", "1e-308", "5e-324", "1e400", "nan", "inf", "-inf", "1e", "0x10",
    "1_0", "9" * 400, "٣", "1,5", "1:2:3", "1:1:1", "0:1:1e9", "1:2:99999999", "a=b", "=", "../..", "/", "/dev/null",
    "a\nb", "\x1b[2J", "\udcff", "x" * 5000, "=1+1", "<b>&amp;", "$x$_{^", "*", "[", "C:\\x", "true",
)  # fmt: skip
_NUMBERS = ("0.03", "0.5", "1", "2", "3", "0.001", "20", "1e-6", "1e6", "1e9")
# Options that may take long with what they allow, with values for which they do not.
_FEW = {"draws": "2", "points": "5", "samples": "40", "cycles": "2", "workers": "1", "smoothing": "5"}
_SENSIBLE = {
    "output": "out.json out.csv out.html folder new", "report": "report.html", "figure": "figure.png",
    "plot": "plot.png", "save": "saved.json", "clean": "clean.csv", "displacement": "1", "force": "2",
    "displacement_unit": "mm in",
    "force_unit": "N kN", "time_unit": "s", "time": "0:1 3", "displacement_range": "-1:1", "degrees": "3,2 auto 1,0",
    "zero": "middle rig 0", "name": "spring", "models": ".", "platforms": "linux64 all", "mass": "0.03", "load": "0.2",
    "band": "1 50 90", "seed": "1", "force_resolution": "0.001", "displacement_resolution": "0.001", "field": "Batch=7",
    "date": "2026-01-01", "delay": "0.001",
}  # fmt: skip
_LEFT_OUT = ("scheduler", "verify")  # the latter co-simulates for seconds
_ALWAYS = ("output", "workers", "mass")
_FILES = ("record.csv", "model.json", "spring.fmu", "cut.csv", "empty.csv", "folder", "none.csv")


def trial(dice: random.Random, folder: Path) -> Iterator[str]:
    """One command line in a folder with records, a model and an FMU."""
    rng = numpy_of(dice)
    os.chdir(folder)
    webbrowser.open = lambda *_, **__: True
    site._build = lambda _source, built, _state: built.mkdir()  # takes seconds
    words, command = _command(rng)
    yield " ".join(words)
    _put_files(Path())
    arguments = [*words, *_arguments(rng, command)]
    status, out, err = _run(arguments)
    told = f"{arguments!r:.2000}\nstatus {status}\n{out[:2000]}\n{err[-3000:]}"
    assert status in (0, 1, 2), told
    assert "Traceback" not in out + err, told
    assert "Warning" not in err, told
    if status == 1:
        *_, last = err.splitlines()
        assert re.fullmatch(r"strandspring: .{10,}\.", last), told
    if "--json" in arguments and (status == 0 or out):
        json.loads(out, parse_constant=refuse_constant)
    for path in Path().rglob("*"):
        assert not path.name.startswith("."), f"{path} is left behind; {told}"
        if (
            status == 0
            and path.is_file()
            and path.suffix in (".csv", ".json", ".ssv", ".mo")
            and path.name not in _FILES
        ):
            assert not re.search(r"(?i)\b(nan|inf|infinity)\b", path.read_text("utf-8")), f"{path}: {told}"
    yield "accepted" if status == 0 else f"{'wrong usage' if status == 2 else 'refused'}: {_kind(err)}"


def _kind(err: str) -> str:
    """The sentence of a refusal without its names and numbers."""
    return re.sub(r"\S*[\d/.]\S*", "..", err.splitlines()[-1].partition(": ")[2])[:60]


def _run(arguments: list[str]) -> tuple[int, str, str]:
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(arguments)
            status = 0
        except SystemExit as leaving:
            status = int(leaving.code or 0)
    return status, out.getvalue(), err.getvalue()


def _command(rng: np.random.Generator) -> tuple[list[str], click.Command]:
    words: list[str] = []
    command: click.Command = strandspring
    while isinstance(command, click.Group):
        context = click.Context(command)
        name = str(rng.choice(list(COMMANDS) if not words else command.list_commands(context)))
        found = command.get_command(context, name)
        assert found is not None
        words.append(name)
        command = found
    return words, command


def _arguments(rng: np.random.Generator, command: click.Command) -> list[str]:
    """Arguments, and some options, of which few are absurd."""
    absurd = float(rng.choice([0.0, 0.05, 0.3]))
    given: list[str] = []
    options = [one for one in command.params if isinstance(one, click.Option) and one.name not in _LEFT_OUT]
    for one in options:
        if one.required or one.name in _ALWAYS or rng.random() < min(0.4, 2.0 / len(options)):
            flag = max(one.opts, key=len)
            for _ in range(1 + int(one.multiple and rng.random() < 0.3)):
                values = [_value(rng, one, absurd) for _ in range(0 if one.is_flag else one.nargs)]
                given += [f"{flag}={values[0]}"] if len(values) == 1 else [flag, *values]
    for one in command.params:
        if isinstance(one, click.Argument):
            count = 1 if one.nargs == 1 or rng.random() < 0.8 else int(rng.integers(0, 3))
            given += [_argument(rng, one, absurd) for _ in range(count)]
    return given


def _argument(rng: np.random.Generator, argument: click.Argument, absurd: float) -> str:
    if rng.random() < absurd:
        return str(rng.choice([*_ABSURD, *_FILES]))
    if isinstance(argument.type, click.Choice):
        return str(rng.choice(list(argument.type.choices)))
    if argument.name in ("records", "sources"):
        return "record.csv"
    return str(rng.choice(["model.json", "spring.fmu"])) if argument.name != "fmus" else "spring.fmu"


def _value(rng: np.random.Generator, option: click.Option, absurd: float) -> str:
    if rng.random() < absurd:
        return str(rng.choice([*_ABSURD, *_FILES]))
    if option.name in _FEW:
        return _FEW[option.name]
    if isinstance(option.type, click.Choice):
        return str(rng.choice(list(option.type.choices)))
    if option.name in _SENSIBLE:
        return str(rng.choice(_SENSIBLE[option.name].split()))
    return str(rng.choice(_NUMBERS))


@cache
def _pieces() -> dict[str, bytes]:
    """Content of the files that commands are given."""
    strokes = np.concatenate([np.linspace(a, b, 40) for a, b in [(0, 5), (5, -5), (-5, 5), (5, -5), (-5, 5)]])
    force = 0.05 * strokes + 0.01 * np.tanh(np.gradient(strokes)) * strokes**2
    rows = "".join(f"{x:.6f},{f:.6f}\n" for x, f in zip(strokes, force, strict=True))
    record = f"displacement [mm],force [N]\n{rows}".encode()
    model = (_ROOT / "models" / "rubber_hinge.json").read_bytes()
    Path("model.json").write_bytes(model)
    status, _, err = _run(["build", "model.json", "-o", "."])
    assert status == 0, err
    (fmu,) = Path().glob("*.fmu")
    pieces = {"record.csv": record, "cut.csv": record[: len(record) // 20], "empty.csv": b"", "model.json": model}
    pieces["spring.fmu"] = fmu.read_bytes()
    fmu.unlink()
    return pieces


def _put_files(folder: Path) -> None:
    for name, content in _pieces().items():
        (folder / name).write_bytes(content)
    (folder / "folder").mkdir()
    shutil.copy(folder / "record.csv", folder / "folder")
