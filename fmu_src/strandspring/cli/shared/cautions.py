"""Messages about records besides the results: notes on how they were read, and cautions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ...records.record import Record
from .output import note, with_flags

if TYPE_CHECKING:
    from ...api.identification import Identification

_SHOWN = 3  # cautions of an identification on the terminal
_WORDS = 46  # of each of them
_CUT = "..."


def note_assumptions(records: Iterable[Record]) -> None:
    """Report what was assumed when records were read."""
    for record in records:
        for sentence in record.notes:
            note(f"{record.path}: {sentence}")


def note_cautions(sentences: Iterable[str]) -> None:
    """Report what asks for caution."""
    for sentence in sentences:
        note(f"Caution: {sentence}")


def note_most_harmful(identification: Identification, *files: str | None) -> None:
    """Report the most harmful cautions of an identification in few words, and which files hold the others."""
    findings = list(identification.findings.items())
    note_cautions(in_few_words(with_flags(outcome.value), detail) for outcome, detail in findings[:_SHOWN])
    if (more := len(findings) - _SHOWN) > 0:
        note(f"{more} more caution{'s are' if more > 1 else ' is'} in {' and '.join(filter(None, files))}.")


def in_few_words(sentence: str, detail: str) -> str:
    """A sentence with as many clauses of its detail as there is room for.

    Examples
    --------
    >>> in_few_words("The record drifts.", "a.csv: by 3 N; b.csv: by 5 N")
    'The record drifts. (a.csv: by 3 N; b.csv: by 5 N)'
    >>> in_few_words("The record drifts.", "; ".join(f"{k}.csv: by {k} N" for k in range(30)))[-36:]
    '8.csv: by 8 N; ...; 29.csv: by 29 N)'
    """
    if not detail:
        return sentence
    room = _WORDS - len(sentence.split())
    if len(detail.split()) <= room:
        return f"{sentence} ({detail})"
    # The last clause often says what to do.
    first, *others, last = detail.split("; ") if "; " in detail else (detail, "")
    kept = [first]
    while others and _count([*kept, others[0], last]) < room:
        kept.append(others.pop(0))
    if last and _count([*kept, last]) < room:
        return f"{sentence} ({'; '.join([*kept, _CUT, last])})"
    return f"{sentence} ({' '.join(' '.join(kept).split()[: room - 1])} {_CUT})"


def _count(clauses: Iterable[str]) -> int:
    return sum(len(clause.split()) for clause in clauses)
