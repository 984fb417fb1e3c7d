"""How functions that take long report their progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

# Is called with what is being done, the number of parts done, and how many there are.
Progress: TypeAlias = Callable[[str, float, int], None]


def unseen(_task: str, _done: float, _total: int) -> None:
    """Progress that nobody watches."""
