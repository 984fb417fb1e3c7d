"""Cautions of an identification on the terminal: three of them, the most harmful first, in few words."""

from __future__ import annotations

import html
import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from strandspring import Outcome
from strandspring.cli.shared.cautions import in_few_words
from strandspring.cli.shared.output import with_flags
from strandspring.model.outcomes import by_harm
from synthetic import record_of, sine, spring_of
from terminal import Terminal

WORDS = 141  # of three cautions


@given(
    st.lists(st.sampled_from(Outcome), min_size=3, max_size=3, unique=True),
    st.lists(st.sampled_from(["a.csv: by 3 N;", "word", "1,", "n ended at its bound"]), max_size=200),
)
def test_three_cautions_have_at_most_141_words(outcomes: list[Outcome], detail: list[str]) -> None:
    text = " ".join(f"Caution: {in_few_words(outcome.value, ' '.join(detail))}" for outcome in outcomes)
    assert len(text.split()) <= WORDS


def test_any_three_sentences_have_at_most_141_words() -> None:
    counts = {outcome: len(f"Caution: {outcome.value}".split()) for outcome in Outcome}
    worst = max(combinations(Outcome, 3), key=lambda three: sum(counts[each] for each in three))
    assert sum(counts[each] for each in worst) <= WORDS, worst


def test_a_caution_has_at_most_30_words() -> None:
    cautions = list(Outcome)[list(Outcome).index(Outcome.SPIKES) :]
    assert [outcome.name for outcome in cautions if len(outcome.value.split()) > 30] == []


def test_findings_are_sorted_by_harm() -> None:
    found = by_harm({Outcome.FIRST_CYCLE_DIFFERS: "", Outcome.SMALL_LOOPS: "a", Outcome.SPIKES: "b"})
    assert list(found.items()) == [
        (Outcome.SPIKES, "b"), (Outcome.SMALL_LOOPS, "a"), (Outcome.FIRST_CYCLE_DIFFERS, "")
    ]  # fmt: skip


@pytest.fixture
def doubtful(tmp_path: Path) -> Path:
    """A record with more than three cautions."""
    record = record_of(spring_of(0.4, 2.0), sine(3, 90), noise=0.03)
    force = record.force.clip(None, np.quantile(record.force, 0.9))
    path = tmp_path / "few.csv"
    times = 0.1 * np.arange(force.size) + np.where(np.arange(force.size) > 40, 5.0, 0.0)
    rows = [f"{t:.1f},{1e3 * x:.4f},{f:.4f}" for t, x, f in zip(times, record.displacement, force, strict=True)]
    path.write_text("time [s],displacement [mm],force [N]\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("report", [False, True])
def test_the_terminal_shows_three_and_names_where_the_others_are(
    doubtful: Path, report: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    model, page = doubtful.with_suffix(".json"), doubtful.with_suffix(".html")
    terminal = Terminal(capsys)
    terminal("identify", str(doubtful), "-o", str(model), *(("--report", str(page)) if report else ()))
    outcomes = json.loads(model.read_text())["fit"]["outcomes"]
    assert len(outcomes) > 3
    lines = [line for line in terminal.err.splitlines() if "aution" in line]
    more = len(outcomes) - 3
    where = f"{model} and {page}" if report else f"{model}"
    assert lines[3:] == [f"{more} more caution{'s are' if more > 1 else ' is'} in {where}."]
    for line, outcome in zip(lines, outcomes[:3], strict=False):
        assert line.startswith(f"Caution: {with_flags(Outcome[outcome['name'].upper()].value)}")
    names = [outcome["name"].upper() for outcome in outcomes]
    assert names == [outcome.name for outcome in Outcome if outcome.name in names]
    if report:
        text = html.unescape(page.read_text())
        assert [name for name in names if " ".join(Outcome[name].value.split()[:6]) not in text] == []
