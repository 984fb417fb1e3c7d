"""What an identification is doing, for whoever shows it while a long record takes minutes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from enum import Enum


class Stage(Enum):
    """Stages in their order; the value is what is being done. Methods other than the refined one have fewer."""

    PREPARING = "finding strokes and noise"
    SEARCHING = "searching minima"
    COMPARING = "comparing wider classes"
    REFINING = "refining"
    UNCERTAINTY = "estimating the uncertainty"
    CHECKING = "checking the saved spring"

    @property
    def words(self) -> str:
        """The stage with its place among all.

        Examples
        --------
        >>> from strandspring.identification.methods.progress import Stage
        >>> Stage.REFINING.words
        'refining (4 of 6)'
        """
        return f"{self.value} ({[*Stage].index(self) + 1} of {len(Stage)})"


_listener: ContextVar[Callable[[Stage], None]] = ContextVar("listener", default=lambda _: None)


def begin(stage: Stage) -> None:
    """Say that a stage begins."""
    _listener.get()(stage)


@contextmanager
def heard_by(listener: Callable[[Stage], None]) -> Iterator[None]:
    """Within it, identifications of this thread call a function with each stage that begins."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)
