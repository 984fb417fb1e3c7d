"""What an answer and a refusal must be like."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

# A sentence with advice has one of these, or says what must be.
_ADVICE = (
    r"\b(give|choose|correct|identify|remove|add|use|write|record|ask|upgrade|build|check|compare|must|install|see|take|"
    r"negate|exchange|try|sample|delete|leave|smaller|larger|lower|raise|shift|reverse|copy)\b"
)
_RAW = re.compile(
    r"<[a-z_.]+ object|0x[0-9a-f]{6}|\barray\(|\bnp\.|numpy\.|Traceback|got None\b|\bNone[,;\])]|\[[Ee]rrno|dtype"
)


def finite(what: str, values: Any) -> None:
    """Raise AssertionError unless all values are finite numbers."""
    array = np.asarray(values, dtype=np.float64)
    assert np.isfinite(array).all(), f"{what} is not finite: {array!r:.500}"


def kind_of(refusal: BaseException, path: Path) -> str:
    """The sentence without its numbers and names; AssertionError if it is no sentence with advice."""
    text = str(refusal)
    own = text.replace(str(path), "PATH").replace(str(path.parent), "FOLDER")
    assert re.search(_ADVICE, own, re.IGNORECASE), f"without advice: {text}"
    assert not _RAW.search(own), f"holds what is not for people: {text}"
    assert own.isprintable(), f"holds control characters: {text!a}"
    assert len(own) < 2000, f"too long: {text[:300]}"
    own = re.sub(r"got .*?(;|\.$)", "got ...\\1", own)
    own = re.sub(r"\[\d+\]", "[i]", re.sub(r"-?\d[\d.e+-]*", "0", own))
    return re.sub(r"'[^']*'|\"[^\"]*\"|`[^`]*`", "...", own)[:110]
