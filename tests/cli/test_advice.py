"""Advice names options as Python has them, and only the command line prints flags."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import click
import pytest

import strandspring
from strandspring import Outcome
from strandspring.cli.main import COMMANDS
from strandspring.cli.main import strandspring as strandspring_command
from strandspring.cli.shared.output import with_flags

PACKAGE = Path(strandspring.__file__).parent
# The page of a record prints the options of the command line that choose what its reader marks; a script has its own.
WITH_FLAGS = {PACKAGE / "report" / "record_page.py", PACKAGE / "examples" / "mounts.py"}
OPTIONS = {
    name
    for command in COMMANDS
    for parameter in strandspring_command.get_command(click.Context(strandspring_command), command).params
    for name in parameter.opts
}


def texts(path: Path) -> list[str]:
    """All texts of a file but its docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    plain = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    constants = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and node not in plain]
    return [node.value for node in constants if isinstance(node.value, str)]


def flags(text: str) -> set[str]:
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text)) & OPTIONS


def test_no_flag_stands_outside_the_command_line() -> None:
    files = set(PACKAGE.rglob("*.py")) - set((PACKAGE / "cli").rglob("*.py")) - WITH_FLAGS
    found = {path.relative_to(PACKAGE).as_posix(): text for path in files for text in texts(path) if flags(text)}
    assert not found


@pytest.mark.parametrize("outcome", list(Outcome), ids=lambda outcome: outcome.name)
def test_flags_of_an_outcome_are_options(outcome: Outcome) -> None:
    told = with_flags(outcome.value)
    assert "`" not in told
    assert len(flags(told)) == len(set(re.findall(r"--[a-z-]+", told)))
