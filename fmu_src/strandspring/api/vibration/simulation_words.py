"""Answers about systems in words for a terminal: a headline, one table, and each caution once."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from ...vibration.verdicts.answers import CandidateAnswer, CaseAnswer, gathered_cautions, overall_verdicts, untested
from ...vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from ..common.text import counted, in_few_words
from ..common.text_table import table_lines

_NOTHING = 1e-9  # of rounding, in the unit for people
_NEAR = 0.01  # of a limit, within which its share is printed in full
_COLUMNS = {FigureKind.ACCELERATION: "accel. g", FigureKind.SWAY: "sway mm", FigureKind.STROKE: "stroke %"}


def headline(name: str, answers: Sequence[CaseAnswer]) -> str:
    """The verdicts counted, and limits that are not tested."""
    candidates = len({answer.candidate for answer in answers})
    cases = len({answer.case.name for answer in answers})
    counts = Counter(answer.verdict for answer in answers)
    verdicts = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in CaseVerdict if counts[verdict])
    where = f"{counted(candidates, 'candidate')} in {counted(cases, 'load case')}"
    left = ", ".join(kind.value for kind in untested(answers))
    return f"{name}: {where}: {verdicts}{'; limits not tested: ' if left else ''}{left}"


def verdict_lines(answers: Sequence[CaseAnswer], width: int | None = None, brief: bool = False) -> list[str]:
    """A table of verdicts, with the range of the figure of each kind that is nearest to its limit."""
    rows: list[list[str]] = []
    candidate, overall = "", overall_verdicts(answers)
    for answer in answers:
        if answer.candidate != candidate:
            candidate = answer.candidate
            rows.append([f"{candidate}:", overall[candidate].value, *[""] * (len(_COLUMNS) + 1)])
        ranges = [range_words(answer.worst(quantity)) for quantity in _COLUMNS]
        nearest = answer.nearest_limit
        limit = "-" if nearest is None else f"{share_words(nearest)} {nearest.quantity.value}"
        if not brief and nearest is not None:
            limit += f" of {nearest.subject}"
        rows.append([f"  {answer.case.name}", answer.verdict.value, *ranges, limit])
    headings = ["case", "verdict", *_COLUMNS.values(), "nearest limit"]
    return table_lines(headings, rows, {*headings[:2], headings[-1]}, width)


def range_words(figure: Figure | None) -> str:
    """The range of a figure in the unit for people, "-" if there is none.

    Examples
    --------
    >>> from strandspring.vibration.verdicts.verdicts import Figure, FigureKind
    >>> range_words(Figure(FigureKind.SWAY, "board", 0.024, 1e-6, 0.0222, 0.0266))
    '22.2-26.6'
    """
    if figure is None:
        return "-"
    low, high = (f"{figure.quantity.column.factor * end:#.3g}".removesuffix(".") for end in (figure.low, figure.high))
    if float(high) < _NOTHING:
        return "0"
    return high if low == high else f"{low}-{high}"


def share_words(figure: Figure) -> str:
    """How much of its limit a figure takes, with more digits near to it."""
    share = figure.share
    return f"{100.0 * share:.{2 if abs(share - 1.0) < _NEAR else 0}f} %"


def caution_lines(
    candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer], brief: bool = False
) -> Iterator[str]:
    """Limits that are not tested, refusals and cautions, each once: a sentence on several candidates or cases names the
    one it is most about.
    """
    yield from (kind.untested for kind in untested(answers))
    for candidate in candidates:
        if candidate.refusal:
            yield f"{candidate.name}: refused: {candidate.refusal}"
    refused = {(candidate.name, candidate.refusal) for candidate in candidates}
    for answer in answers:
        if answer.refusal and (answer.candidate, answer.refusal) not in refused:
            yield f"{answer.where}: refused: {answer.refusal}"
    for sentence in dict.fromkeys(sentence for candidate in candidates for sentence in candidate.cautions):
        names = [candidate.name for candidate in candidates if sentence in candidate.cautions]
        about = "" if len(names) == len(candidates) else f"{', '.join(names)}: "
        yield f"Caution: {about}{in_few_words(sentence) if brief else sentence}"
    for where, caution, others in gathered_cautions(answers):
        more = f" and {counted(len(others), 'other')}" if others else ""
        yield f"Caution: {where}{more}: {in_few_words(caution.text) if brief else caution.text}"
