"""Messages about records besides the results: notes on how they were read, and cautions."""

from __future__ import annotations

from collections.abc import Iterable

from ...errors import Reader
from ...findings import CAUTIONS, NOTES, Finding, Severity, gathered, of_severity
from ...records.record import Record
from .output import is_verbose, note


def notable() -> tuple[Severity, ...]:
    """What is noted beside cautions: with --verbose also what was read as the file or the user says."""
    return (*NOTES, Severity.STATED) if is_verbose() else NOTES


def note_records(records: Iterable[Record]) -> None:
    """Report what was assumed, and what was left out, when records were read."""
    found = [finding for record in records for finding in record.found]
    note_cautions(found)
    for line in noted(found):
        note(line)


def noted(findings: Iterable[Finding]) -> list[str]:
    """Lines of what is good to know."""
    return [f"Note: {sentence}" for sentence in gathered(of_severity(findings, notable()), Reader.COMMAND_LINE)]


def note_cautions(findings: Iterable[Finding], most: int | None = None) -> None:
    """Report what asks for caution, each in few words, and count those beyond a number; with --verbose all, with their
    details.
    """
    is_brief = not is_verbose()
    sentences = list(gathered(of_severity(findings, CAUTIONS), Reader.COMMAND_LINE, is_brief))
    shown = len(sentences) if most is None or not is_brief else most
    for sentence in sentences[:shown]:
        note(f"Caution: {sentence}")
    if more := len(sentences[shown:]):
        note(f"and {more} more: see the report, --verbose or --json")
