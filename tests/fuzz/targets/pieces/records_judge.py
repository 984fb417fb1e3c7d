"""What a reader of records may do with any file: give a sound record, or refuse it in a sentence with advice."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from strandspring.errors import RecordError
from strandspring.records.record import Record

_LONGEST = 2500  # characters of a message; tables with all their columns are listed
_INTERNAL = re.compile(r"<[\w.]+ object|object at 0x|Traceback|\bdtype\(|^\(.*\)$|errno", re.IGNORECASE)
_QUOTED = re.compile(r"'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"")


def judged(read: Callable[[], Record], path: Path | str = "", is_limited: bool = False) -> tuple[str, Record | None]:
    """The outcome of reading, in few words, and the record.

    Parameters
    ----------
    read : callable
    path : path-like    Which a refusal must name, if it is of the file.
    is_limited : bool   Whether it is read by a process that limits its memory itself.

    Raises
    ------
    AssertionError   If the record is unsound, or the refusal no sentence with place and advice.
    """
    try:
        record = read()
    except RecordError as problem:
        message = str(problem)
        assert message.startswith((str(path), "`")), message
        assert message.isprintable(), message
        assert message.endswith((".", "?")), message
        assert ";" in message or "?" in message or re.search("must|should", message), f"no advice: {message}"
        assert len(message) <= _LONGEST, f"{len(message)} characters: {message[:300]}"
        assert not _INTERNAL.search(message), message
        assert "more data than fits into memory" not in message or is_limited, message
        return f"refused: {_kind(message.removeprefix(str(path)))}", None
    for values in (record.displacement, record.force, record.time):
        assert values is None or (values.size >= 2 and np.isfinite(values).all() and not values.flags.writeable)
        assert values is None or values.size == len(record)
    for note in record.notes:
        assert note.isprintable(), note
        assert not _INTERNAL.search(note), note
    return "accepted", record


def _kind(message: str) -> str:
    """A message without what differs from file to file."""
    text = re.sub(r"[-+]?[0-9][0-9.e+]*", "0", _QUOTED.sub("0", message))
    text = re.sub(r"^[:, ]*(?:(?:line|row) 0)?[:, ]*(?:column (?:0 ?)+)?[:, ]*", "", text)
    return re.split(r"[(;,]", text)[0][:60].strip()
