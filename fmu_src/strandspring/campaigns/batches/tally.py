"""Sentences of many files summed up: how many files each kind of them belongs to, and one of these."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

_NUMBER = re.compile(r"-?\d+(\.\d+)?(e[+-]?\d+)?")
_MOST_KINDS = 1000  # files that all say something else must not fill the memory


@dataclass
class SentenceKind:
    """Sentences that differ in their numbers only.

    Attributes
    ----------
    sentence, file : str   The first of them, and the file that it belongs to.
    count : int            Number of files.
    """

    sentence: str
    file: str
    count: int = 0


@dataclass
class Tally:
    """Sentences by kind.

    Examples
    --------
    >>> from strandspring.campaigns.batches.tally import Tally
    >>> tally = Tally()
    >>> for file, line in (("a.csv", 3), ("b.csv", 12), ("c.csv", 3)):
    ...     tally.add(file, [f"the numbers begin in line {line}"])
    >>> tally.add("c.csv", ["unit of force assumed: N"])
    >>> tally.lines(3)
    ['3 files: the numbers begin in line 3', '1 file: unit of force assumed: N (c.csv)']
    """

    kinds: dict[str, SentenceKind] = field(default_factory=dict)

    def add(self, file: str, sentences: Iterable[str]) -> None:
        """Count a file's sentences."""
        for sentence in dict.fromkeys(sentences):
            key = _NUMBER.sub("#", sentence)
            if key in self.kinds or len(self.kinds) < _MOST_KINDS:
                self.kinds.setdefault(key, SentenceKind(sentence, file)).count += 1
            else:
                self.kinds.setdefault("", SentenceKind("other sentences", file)).count += 1

    @property
    def ranked(self) -> list[SentenceKind]:
        """Kinds, those of most files first."""
        return sorted(self.kinds.values(), key=lambda kind: -kind.count)

    def lines(self, files: int, most: int = 40) -> list[str]:
        """One line for each kind.

        Parameters
        ----------
        files : int   Of the batch; a kind of all of them needs no example.
        most : int    Number of kinds that are listed.
        """
        lines = []
        for kind in self.ranked[:most]:
            place = "" if kind.count == files else f" ({'' if kind.count == 1 else 'first: '}{kind.file})"
            lines.append(f"{kind.count} file{'' if kind.count == 1 else 's'}: {kind.sentence}{place}")
        more = len(self.kinds) - most
        return lines if more <= 0 else [*lines, f"{more} more kinds, of fewer files each"]
