"""Summaries that are held as arrays, and made when they are asked for: a grid may have a million points."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import TypeVar, overload

Summary = TypeVar("Summary")


class SummarySequence(Sequence[Summary]):
    """A sequence whose members are made one at a time."""

    @abstractmethod
    def summary(self, index: int) -> Summary:
        """The summary of a place, from 0 on."""

    @overload
    def __getitem__(self, index: int) -> Summary: ...

    @overload
    def __getitem__(self, index: slice) -> list[Summary]: ...

    def __getitem__(self, index: int | slice) -> Summary | list[Summary]:
        """One, or several."""
        if isinstance(index, slice):
            return [self.summary(k) for k in range(*index.indices(len(self)))]
        return self.summary(range(len(self))[index])

    def __iter__(self) -> Iterator[Summary]:
        return map(self.summary, range(len(self)))
