"""What the harness is tested by: each third trial fails."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path


def trial(dice: random.Random, folder: Path) -> Iterator[str]:
    """A failure or not, by the seed of the folder's name."""
    del dice
    yield "faulty"
    assert int(folder.name) % 3 != 2
    yield "accepted"
