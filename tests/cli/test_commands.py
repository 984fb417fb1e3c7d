"""What commands do beyond their outputs: options, cautions, states, and that nothing comes in place half done."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from string import Formatter
from typing import Any

import click
import pytest

import strandspring
from strandspring import Finding, Outcome
from strandspring.cli.main import COMMANDS
from strandspring.cli.main import strandspring as strandspring_command
from strandspring.errors import Reader
from strandspring.findings import Severity, words
from strandspring.model.modelfile import load_model
from terminal import Terminal

pytestmark = pytest.mark.long

PACKAGE = Path(strandspring.__file__).parent
# The page of a record prints the options of the command line that choose what its reader marks; a script has its own.
WITH_FLAGS = {PACKAGE / "report" / "record_page.py", PACKAGE / "examples" / "paper.py"}
WORDS = 25  # of a caution
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


def test_a_spring_worse_than_a_line_is_saved_only_where_that_is_asked_for(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    # No record is known of which a fit is worse than a line.
    worse = Finding(Outcome.WORSE_THAN_LINE)
    monkeypatch.setattr("strandspring.identification.identify._of_saved", lambda *_: iter([worse]))
    for command in ("identify new.csv -o m.json", "build new.csv --models kept"):
        terminal(*command.split(), status=1)
        assert "--save-anyway" in terminal.err
    assert not Path("m.json").exists()
    told = json.loads(terminal("identify", "new.csv", "-o", "m.json", "--save-anyway", "--json"))
    assert "worse_than_line" in {outcome["name"] for outcome in told["outcomes"]}
    assert load_model("m.json").fit["outcomes"] == told["outcomes"]


def test_advice_names_options_that_commands_have() -> None:
    """As flags on the command line, and as Python's names outside it."""
    context = click.Context(strandspring_command)
    commands = [strandspring_command.get_command(context, name) for name in COMMANDS]
    every = [one for command in commands if command for one in (command, *getattr(command, "commands", {}).values())]
    flags = {flag for command in every for parameter in command.params for flag in parameter.opts}
    for path in sorted(PACKAGE.rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        plain = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
        texts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and node not in plain]
        said = " ".join(text for text in texts if isinstance(text, str))
        if "cli" not in path.parts and path not in WITH_FLAGS:
            assert not flags & set(FLAG.findall(said)), path
    for kind in Outcome:
        finding = Finding(kind, fields_of(kind))
        read = {reader: words(finding, reader) for reader in Reader}
        assert not {"{", "}"} & set("".join(read.values())), kind
        assert set(FLAG.findall(read[Reader.COMMAND_LINE])) <= flags, kind
        assert not FLAG.search(read[Reader.PYTHON] + read[Reader.FILE]), kind
        assert "`" not in read[Reader.FILE], kind
        few = words(finding, Reader.COMMAND_LINE, brief=True).split()
        assert len(few) <= WORDS or kind.severity is not Severity.CAUTION, kind


def fields_of(kind: Outcome) -> dict[str, Any]:
    """A number for each field of a kind with a format, and a name for each without."""
    fields = Formatter().parse(" ".join(map(str, kind.value[1:4])))
    return {name: 1.5 if spec else "name" for _, name, spec, _ in fields if name} | {kind.value.measure: 1.0}
