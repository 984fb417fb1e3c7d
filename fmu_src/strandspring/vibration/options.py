"""What a user says of the simulation of a SYSTEM.toml: which part of it, and how."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..errors import MountedSystemError
from ..ground.options import check, described, option

# Of everything unknown.
DRAWS, LEAST_DRAWS, MOST_DRAWS = 64, 16, 10_000


@described
@dataclass(frozen=True)
class Part:
    """What of a system is simulated."""

    group: ClassVar[str] = "System"

    cases: str | Sequence[str] | None = option(
        None, "texts", "Only this load case, in all its directions", otherwise="all", metavar="NAME"
    )
    candidates: str | Sequence[str] | None = option(
        None, "texts", "Only this candidate", otherwise="all", metavar="NAME"
    )


@described
@dataclass(frozen=True)
class Run:
    """How a system is simulated.

    Raises
    ------
    MountedSystemError   If a value is out of bounds.
    """

    group: ClassVar[str] = "Simulation"

    draws: int | None = option(
        None, "whole", "Draws of all that is unknown (omega at rest, springs by the uncertainty of their model files, "
        "scatter of mounts, realisations of random vibration), for the ranges of the figures; of random vibration a "
        "quarter of them", least=LEAST_DRAWS, most=MOST_DRAWS, otherwise="the file's, or 64", metavar="N",
    )  # fmt: skip
    seed: int | None = option(None, "whole", "Seed of the draws", least=0, otherwise="the file's, or 0")
    step: float | None = option(
        None, "number", "Time step of the coarser of two runs", unit="s", least=0.0, is_open=True, metavar="S",
        otherwise="the file's, or found for errors of 0.1 %, in the draws of 0.3 %; of random vibration 0.5 and 2 %",
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self, MountedSystemError)


@described
@dataclass(frozen=True)
class StudyRun(Run):
    """How each run of a study is computed.

    Raises
    ------
    MountedSystemError   If a value is out of bounds.
    """

    draws: int | None = option(
        None, "whole", "Springs drawn from the uncertainty of a model at each grid point, 0 for the identified spring "
        "alone; of a system draws in each run, as of `simulate`", least=0, most=1_000_000,
        otherwise="100, of a system the file's or 64", metavar="N",
    )  # fmt: skip
