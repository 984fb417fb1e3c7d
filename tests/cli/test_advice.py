"""Advice names options as Python has them, and only the command line prints flags."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import click
import grimp
import pytest

import strandspring
from strandspring import Outcome
from strandspring.cli.main import COMMANDS
from strandspring.cli.main import strandspring as strandspring_command
from strandspring.cli.shared.output import with_flags

PACKAGE = Path(strandspring.__file__).parent
# The page of a record prints the options of the command line that choose what its reader marks; a script has its own.
WITH_FLAGS = {PACKAGE / "report" / "record_page.py", PACKAGE / "examples" / "paper.py"}
CONTEXT = click.Context(strandspring_command)
# Of each command its options by their names, those of subcommands too.
OF_COMMANDS = {
    name: {
        flag: parameter
        for one in (command, *getattr(command, "commands", {}).values())
        for parameter in one.params
        for flag in parameter.opts
    }
    for name in COMMANDS
    if (command := strandspring_command.get_command(CONTEXT, name))
}
OPTIONS = {flag for options in OF_COMMANDS.values() for flag in options}
# Whose modules print for these alone.
OF_VIBRATION = {"isolate", "simulate", "study"}


def texts(path: Path) -> list[str]:
    """All texts of a file but its docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    plain = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    constants = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and node not in plain]
    return [node.value for node in constants if isinstance(node.value, str)]


def flags(text: str) -> set[str]:
    return set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text)) & OPTIONS


def test_remedies_are_options_of_the_commands_that_print_them() -> None:
    """As far as imports tell which: some command that reaches the message has the option, each that has it takes the
    value, and of the three commands about vibration each that reaches a message of theirs has it.
    """
    graph = grimp.build_graph("strandspring", cache_dir=None)
    modules = {name: f"strandspring.cli.commands.{name.replace('-', '_')}" for name in OF_COMMANDS}
    reached = {name: {module, *graph.find_upstream_modules(module)} for name, module in modules.items()}
    wrong = []
    for path in sorted(PACKAGE.rglob("*.py")):
        place = ".".join(("strandspring", *path.relative_to(PACKAGE).with_suffix("").parts))
        printing = {name for name, ways in reached.items() if place in ways}
        for text in texts(path) if printing else ():
            for flag, value in re.findall(r"(?<![\w-])(--[a-z][a-z-]*)(?: (\d+))?", with_flags(text)):
                having = {name for name in printing if flag in OF_COMMANDS[name]}
                own = printing & OF_VIBRATION if place.split(".")[1] in ("api", "vibration") else set()
                if flag in OPTIONS and not (having and own <= having):
                    wrong.append((place, flag, value))
                for name in having if value else ():
                    try:
                        OF_COMMANDS[name][flag].type_cast_value(CONTEXT, value)
                    except click.BadParameter:
                        wrong.append((place, flag, value, name))
    assert not wrong


def test_no_flag_stands_outside_the_command_line() -> None:
    files = set(PACKAGE.rglob("*.py")) - set((PACKAGE / "cli").rglob("*.py")) - WITH_FLAGS
    found = {path.relative_to(PACKAGE).as_posix(): text for path in files for text in texts(path) if flags(text)}
    assert not found


@pytest.mark.parametrize("outcome", list(Outcome), ids=lambda outcome: outcome.name)
def test_flags_of_an_outcome_are_options(outcome: Outcome) -> None:
    told = with_flags(outcome.value)
    assert "`" not in told
    assert len(flags(told)) == len(set(re.findall(r"--[a-z-]+", told)))
