"""Messages about records besides the results: notes on how they were read, and cautions."""

from __future__ import annotations

from collections.abc import Iterable

from ..records.record import Record
from .output import note


def note_assumptions(records: Iterable[Record]) -> None:
    """Report what was assumed when records were read."""
    for record in records:
        for sentence in record.notes:
            note(f"{record.path}: {sentence}")


def note_cautions(sentences: Iterable[str]) -> None:
    """Report what asks for caution."""
    for sentence in sentences:
        note(f"Caution: {sentence}")
