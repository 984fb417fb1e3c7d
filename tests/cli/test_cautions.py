"""Cautions of an identification on the terminal: the most harmful first, in few words."""

from __future__ import annotations

import html
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from strandspring import Finding, Outcome
from strandspring.api.common.text import in_few_words
from strandspring.cli.shared.output import with_flags
from strandspring.model.outcomes import by_harm
from synthetic import record_of, sine, spring_of
from terminal import Terminal

WORDS = 25  # of a caution


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


def test_findings_are_sorted_by_harm() -> None:
    kinds = (Outcome.FIRST_CYCLE_DIFFERS, Outcome.ONE_AMPLITUDE, Outcome.SPIKES)
    assert [found.kind for found in by_harm(map(Finding, kinds))] == list(kinds[::-1])


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


def test_the_terminal_shows_each_caution_once_in_80_columns(doubtful: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, page = doubtful.with_suffix(".json"), doubtful.with_suffix(".html")
    terminal = Terminal(capsys)
    terminal("identify", str(doubtful), "-o", str(model), "--report", str(page))
    outcomes = json.loads(model.read_text())["fit"]["outcomes"]
    assert len(outcomes) > 3
    cautions = terminal.err.split("Caution: ")[1:]
    assert f"and {len(outcomes) - 3} more: see the report" in cautions[2]
    for text, outcome in zip(cautions, outcomes[:3], strict=True):
        assert text.startswith(with_flags(Outcome[outcome["name"].upper()].value))
    terminal("identify", str(doubtful), "-o", str(model), "--verbose")
    for outcome in outcomes:
        # The model file holds no folders.
        sentence = outcome["sentence"].replace(doubtful.name, str(doubtful))
        assert f"Caution: {with_flags(sentence)}\n" in terminal.err
    names = [outcome["name"].upper() for outcome in outcomes]
    assert names == [outcome.name for outcome in Outcome if outcome.name in names]
    text = html.unescape(page.read_text())
    assert [name for name in names if " ".join(Outcome[name].value.split()[:6]) not in text] == []
