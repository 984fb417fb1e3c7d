"""What commands do beyond their outputs: options, cautions, states, and that nothing comes in place half done."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import click
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import strandspring
from strandspring import Finding, Outcome, Spring
from strandspring.api.common.text import in_few_words
from strandspring.cli.main import COMMANDS
from strandspring.cli.main import strandspring as strandspring_command
from strandspring.cli.shared.output import with_flags
from strandspring.model.modelfile import load_model
from synthetic import sine, spring_of
from terminal import Terminal

pytestmark = pytest.mark.long

PACKAGE = Path(strandspring.__file__).parent
# The page of a record prints the options of the command line that choose what its reader marks; a script has its own.
WITH_FLAGS = {PACKAGE / "report" / "record_page.py", PACKAGE / "examples" / "paper.py"}
WORDS = 25  # of a caution


def test_the_interval_of_a_prediction_holds_95_percent(terminal: Terminal) -> None:
    import pandas as pd

    x = sine(4, 2000)
    force = Spring(spring_of(1.0, 1.0)).response(x) + np.random.default_rng(0).standard_normal(x.size)
    pd.DataFrame({"x [mm]": 1e3 * x, "F [N]": force}).to_csv("noisy.csv", index=False)
    terminal("identify", "noisy.csv", "--degrees", "3,2", "-o", "n.json")
    terminal("predict", "n.json", "noisy.csv", "-o", "p.csv")
    table = pd.read_csv("p.csv")
    assert np.mean(table["force [N]"].between(table["lower [N]"], table["upper [N]"])) == pytest.approx(0.95, abs=0.02)
    terminal("predict", "mount.json", "noisy.csv", "-o", "p.csv")
    assert "mount.json holds no prediction interval, so p.csv has no columns lower and upper" in terminal.err


def test_what_is_clipped_is_in_no_figure(terminal: Terminal) -> None:
    import pandas as pd

    x = sine()
    noisy = Spring(spring_of(1.0, 1.0)).response(x) + 0.05 * np.random.default_rng(0).standard_normal(x.size)
    told = []
    for name, force in (("whole", noisy), ("clipped", noisy.clip(*np.quantile(noisy, [0.1, 0.9])))):
        pd.DataFrame({"x [mm]": 1e3 * x, "F [N]": force}).to_csv(f"{name}.csv", index=False)
        told.append(json.loads(terminal("identify", f"{name}.csv", "-o", "k", "--json"))["records"][0])
    whole, clipped = told
    assert clipped["rmse"] == pytest.approx(whole["rmse"], rel=0.1)  # of a thousand samples
    assert clipped["samples"] < whole["samples"]
    assert clipped["predicted_energy"] == pytest.approx(clipped["energy"], rel=0.02)
    terminal("predict", "mount.json", "clipped.csv")
    assert "are at the end of the force sensor's range" in terminal.err


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


def test_the_same_command_gives_the_same_bytes(terminal: Terminal) -> None:
    for folder in "ab":
        terminal(*f"identify new.csv --degrees 3,2 -o {folder}/new.json --report {folder}/new.html".split())
        terminal("isolate", "mount.json", "--mass", "5", "--points", "4", "--plot", f"{folder}/out.svg")
        terminal("synthesize", "spring", "mount.json", "--noise", "0.03", "--seed", "5", "-o", f"{folder}/n.csv")
    for path in Path("a").iterdir():
        assert path.read_bytes() == (Path("b") / path.name).read_bytes()


# Cautions and advice


@given(
    st.sampled_from(Outcome),
    st.lists(st.sampled_from(["a.csv: by 3 N;", "word", "1,", "n ended at its bound"]), max_size=30),
)
def test_a_detail_is_shown_where_there_is_room(outcome: Outcome, detail: list[str]) -> None:
    text = in_few_words(f"{outcome.value} ({' '.join(detail)})")
    assert text == outcome.value or len(text.split()) <= WORDS


def test_a_caution_has_at_most_25_words() -> None:
    cautions = list(Outcome)[list(Outcome).index(Outcome.WORSE_THAN_LINE) :]
    assert [outcome.name for outcome in cautions if len(with_flags(outcome.value).split()) > WORDS] == []


def texts(path: Path) -> list[str]:
    """All texts of a file but its docstrings."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    plain = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    constants = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and node not in plain]
    return [node.value for node in constants if isinstance(node.value, str)]


def test_advice_names_options_of_the_commands_that_print_it() -> None:
    """Python's names outside the command line; as flags, those of a command whose imports reach the text."""
    import grimp

    context = click.Context(strandspring_command)
    commands = {name: strandspring_command.get_command(context, name) for name in COMMANDS}
    options = {
        name: {
            flag: parameter
            for one in (command, *getattr(command, "commands", {}).values())
            for parameter in one.params
            for flag in parameter.opts
        }
        for name, command in commands.items()
        if command is not None
    }
    every = set().union(*options.values())
    graph = grimp.build_graph("strandspring", cache_dir=None)
    modules = {name: f"strandspring.cli.commands.{name.replace('-', '_')}" for name in options}
    reached = {name: {module, *graph.find_upstream_modules(module)} for name, module in modules.items()}
    wrong = []
    for path in sorted(PACKAGE.rglob("*.py")):
        place = ".".join(("strandspring", *path.relative_to(PACKAGE).with_suffix("").parts))
        printing = {name for name, ways in reached.items() if place in ways}
        for text in texts(path):
            if "cli" not in path.relative_to(PACKAGE).parts and path not in WITH_FLAGS:
                wrong += [(place, flag) for flag in re.findall(r"(?<![\w-])--[a-z][a-z-]*", text) if flag in every]
            for flag, value in re.findall(r"(?<![\w-])(--[a-z][a-z-]*)(?: (\d+))?", with_flags(text)):
                having = {name for name in printing if flag in options[name]}
                if flag in every and printing and not having:
                    wrong.append((place, flag))
                for name in having if value else ():
                    options[name][flag].type_cast_value(context, value)
    assert wrong == []
    assert not [outcome.name for outcome in Outcome if "`" in with_flags(outcome.value)]
