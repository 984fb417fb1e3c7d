"""What a rig can do, and how long it may take."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from ...core.parameters import LARGEST_DISPLACEMENT, LARGEST_VELOCITY, WIDTH_RANGE
from ...ground.arguments import limits
from ...ground.options import check, described, option
from ...loops.windows import is_window, window

LEAST_SAMPLES = 100  # of a loop, so that its reversals are seen


def checked_stroke(stroke: tuple[float, float]) -> tuple[float, float]:
    """Least and greatest displacement [m]; raises ValueError if they are none of a spring."""
    low, high = limits("stroke", stroke, "m")
    if not (abs(low) <= LARGEST_DISPLACEMENT and abs(high) <= LARGEST_DISPLACEMENT):
        raise ValueError(f"`stroke` must be within +-{LARGEST_DISPLACEMENT:g} [m], got {low!r} to {high!r}.")
    if not WIDTH_RANGE[0] <= high - low <= WIDTH_RANGE[1]:
        raise ValueError(
            f"`stroke` must be a lower and an upper end {WIDTH_RANGE[0]:g} to {WIDTH_RANGE[1]:g} m apart, got {low!r} "
            f"to {high!r}."
        )
    return low, high


def stroke_of(text: str) -> tuple[float, float]:
    """Both ends of LOW:HIGH [mm] in m; raises ValueError for anything else."""
    low, high = window(text) if is_window(text) else (None, None)
    if low is None or high is None:
        raise ValueError(f"must be LOW:HIGH, such as -20:20 [mm], got {text!r}.")
    return checked_stroke((1e-3 * low, 1e-3 * high))


@described
@dataclass(frozen=True)
class Limits:
    """Limits of a rig; a programme stays within all of them.

    Raises
    ------
    ValueError   If a limit is impossible.
    TypeError    If one is no number.
    """

    group: ClassVar[str] = "Rig"

    stroke: tuple[float, float] | None = option(
        None, "limits", "Least and greatest displacement of the rig", unit="m", shown="mm", factor=1e-3,
        otherwise="the model's range", metavar="LOW:HIGH", parse=stroke_of,
        checks=checked_stroke,
    )  # fmt: skip
    velocity: float | None = option(
        None, "number", "Largest velocity of the rig", unit="m/s", shown="mm/s", factor=1e-3, least=0.0, is_open=True,
        most=LARGEST_VELOCITY, otherwise="that of the records; else a loop in 4 s", metavar="MM/S",
    )  # fmt: skip
    force_limit: float | None = option(
        None, "number", "Largest force of either sign, kept to with the uncertainty of the model", unit="N", least=0.0,
        is_open=True, otherwise="none", metavar="N",
    )  # fmt: skip
    duration: float = option(
        300.0, "number", "Longest programme; it ends earlier where more decides little", unit="s", least=0.0,
        is_open=True, most=1e6, metavar="S",
    )  # fmt: skip
    sample_rate: float = option(
        200.0, "number", "Of the programme and the records; a loop takes at least 100 samples", unit="Hz", least=0.0,
        is_open=True, most=1e6, metavar="HZ",
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self)

    @property
    def fastest(self) -> float:
        """The largest velocity, infinite if none is stated [m/s]."""
        return math.inf if self.velocity is None else self.velocity

    @property
    def step(self) -> float:
        """Time from sample to sample [s]."""
        return 1.0 / self.sample_rate
