"""Messages about records besides the results: notes on how they were read, and cautions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ...api.common.text import in_few_words
from ...records.bad_rows import UNREADABLE
from ...records.record import Record
from .output import is_verbose, note, with_flags

# What was read as the file or the user says needs no attention.
_AS_STATED = re.compile(
    r"the numbers begin in .*|\w+ is column .*|.* is read, as given|"
    r"the unit of \w+ is .* \((as given|found in the file)\)"
)
_ASSUMED = re.compile(r"the unit of (\w+) is (.+) \(assumed, as none is given\)")


def note_assumptions(records: Iterable[Record]) -> None:
    """Report what was assumed when records were read, of each in one line; with --verbose all that was found.

    Lines that were left out are cautions.
    """
    for record in records:
        note_cautions(f"{record.path}: {sentence}" for sentence in record.notes if UNREADABLE in sentence)
        for sentence in record.notes if is_verbose() else _assumptions(record.notes):
            note(f"{record.path}: {sentence}")


def note_assumptions_of_many(sentences: Iterable[str]) -> None:
    """The same of sentences that begin with the number of files."""
    for sentence in sentences:
        if UNREADABLE in sentence:
            note_cautions([sentence])
        elif is_verbose() or not _AS_STATED.match(sentence.partition(": ")[2]):
            note(sentence)


def _assumptions(notes: Sequence[str]) -> list[str]:
    """What was neither stated in the file nor given, in one sentence; none if all was."""
    notes = [sentence for sentence in notes if UNREADABLE not in sentence]
    units = [" ".join(match.groups()) for match in map(_ASSUMED.fullmatch, notes) if match]
    others = [sentence for sentence in notes if not (_AS_STATED.fullmatch(sentence) or _ASSUMED.fullmatch(sentence))]
    sentences = [*([f"units assumed: {', '.join(units)}"] if units else []), *others]
    return ["; ".join(sentences)] if sentences else []


def note_cautions(sentences: Iterable[str], most: int | None = None) -> None:
    """Report what asks for caution, each in few words, and count those beyond a number; with --verbose all, with their
    details.
    """
    sentences = tuple(sentences)
    shown = len(sentences) if most is None or is_verbose() else most
    for sentence in sentences[:shown]:
        caution = with_flags(sentence)
        note(f"Caution: {caution if is_verbose() else in_few_words(caution)}")
    if more := len(sentences[shown:]):
        note(f"and {more} more: see the report, --verbose or --json")
