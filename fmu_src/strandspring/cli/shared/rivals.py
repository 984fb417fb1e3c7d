"""The comparison with other classes of models, in words and as JSON."""

from __future__ import annotations

from typing import Any

from ...api.common.text_table import table_lines
from ...api.identification import Identification
from ...peers.rivals.classes import RIVALS
from ...peers.rivals.ranking import Ranking, RankingEntry
from .output import advancing, note


def compared_with_rivals(identification: Identification) -> tuple[Identification, Ranking]:
    """Rank other classes on the same data; the identification gains a caution where one is clearly better."""
    with advancing("Fitting other classes", len(RIVALS) + 1) as advance:
        compared, ranking = identification.with_rivals(advance)
    for sentence in ranking.notes:
        note(sentence)
    return compared, ranking


def ranking_lines(ranking: Ranking, width: int | None = None) -> list[str]:
    """The ranking in words, with a table of at most a width."""
    headings = ("class", "degrees", "parameters", "held out [N]", "[% of std]", "fitted [N]", "clearly better")
    rows = [_row(ranking, entry) for entry in ranking.entries]
    return [ranking.sentence, *table_lines(headings, rows, ("class",), width)]


def _row(ranking: Ranking, entry: RankingEntry) -> tuple[str, ...]:
    return (
        entry.rival.title,
        _degrees(entry),
        f"{entry.fit.parameters}",
        f"{entry.error:.4g}",
        f"{100.0 * entry.error / ranking.spread:.3g}",
        f"{entry.fit.misfit:.4g}",
        "yes" if ranking.is_clearly_better(entry) else "",
    )


def _degrees(entry: RankingEntry) -> str:
    basis = entry.fit.basis
    return f"{basis.elastic},{basis.amplifier}" if entry.rival.has_amplifier else f"{basis.elastic}"


def ranking_json(ranking: Ranking) -> dict[str, Any]:
    """The ranking as JSON."""
    return {
        "sentence": ranking.sentence,
        "held_out": ranking.held_out,
        "folds": ranking.folds,
        "notes": list(ranking.notes),
        "classes": [
            {
                "name": entry.rival.name,
                "title": entry.rival.title,
                "parameters": entry.fit.parameters,
                "degrees": [entry.fit.basis.elastic, entry.fit.basis.amplifier],
                "shape": entry.fit.shape,
                "error": entry.error,
                "error_share": entry.error / ranking.spread,
                "errors": entry.errors.tolist(),
                "misfit": entry.fit.misfit,
                "clearly_better": ranking.is_clearly_better(entry),
            }
            for entry in ranking.entries
        ],
    }
