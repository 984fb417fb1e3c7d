"""What commands do beyond their outputs: options, cautions, states, and that nothing comes in place half done."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

import strandspring
from strandspring import Finding, Outcome
from strandspring.api.common.text import in_few_words
from strandspring.cli.main import COMMANDS
from strandspring.cli.main import strandspring as strandspring_command
from strandspring.cli.shared.output import with_flags
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


@given(
    st.sampled_from(Outcome),
    st.lists(st.sampled_from(["a.csv: by 3 N;", "word", "1,", "n ended at its bound"]), max_size=30),
)
def test_a_caution_has_at_most_25_words_and_a_detail_where_there_is_room(outcome: Outcome, detail: list[str]) -> None:
    text = in_few_words(f"{outcome.value} ({' '.join(detail)})")
    assert text == outcome.value or len(text.split()) <= WORDS
    is_caution = list(Outcome).index(outcome) >= list(Outcome).index(Outcome.WORSE_THAN_LINE)
    assert not is_caution or len(with_flags(outcome.value).split()) <= WORDS


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
    for outcome in Outcome:
        advice = with_flags(outcome.value)
        assert "`" not in advice, outcome
        assert set(FLAG.findall(advice)) <= flags, outcome
