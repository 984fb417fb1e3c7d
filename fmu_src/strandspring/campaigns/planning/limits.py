"""What a rig can do, and how long it may take."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...core.parameters import LARGEST_DISPLACEMENT, LARGEST_VELOCITY, WIDTH_RANGE
from ...ground.arguments import limits, number, optional_number

LEAST_SAMPLES = 100  # of a loop, so that its reversals are seen


@dataclass(frozen=True)
class Limits:
    """Limits of a rig; a programme stays within all of them.

    Parameters
    ----------
    velocity : float                   Largest velocity [m/s].
    stroke : (float, float) or None    Least and greatest displacement [m]; what the spring is known for if None.
    force : float or None              Largest force, of either sign [N]; any if None.
    duration : float                   Of the whole programme [s].
    sample_rate : float                At which the rig commands and records [Hz].

    Raises
    ------
    ValueError   If a limit is impossible.
    TypeError    If one is no number.
    """

    velocity: float
    stroke: tuple[float, float] | None = None
    force: float | None = None
    duration: float = 300.0
    sample_rate: float = 200.0

    def __post_init__(self) -> None:
        for name, unit, largest in (
            ("velocity", "m/s", LARGEST_VELOCITY), ("duration", "s", 1e6), ("sample_rate", "Hz", 1e6)
        ):  # fmt: skip
            value = number(name, getattr(self, name), unit)
            if not 0.0 < value <= largest:
                raise ValueError(f"`{name}` must be > 0 and at most {largest:g} [{unit}], got {value!r}.")
            object.__setattr__(self, name, value)
        force = optional_number("force_limit", self.force, "N")
        if force is not None and not (math.isfinite(force) and force > 0.0):
            raise ValueError(f"`force_limit` must be > 0 [N], got {force!r}.")
        object.__setattr__(self, "force", force)
        if self.stroke is not None:
            object.__setattr__(self, "stroke", checked_stroke(self.stroke))

    @property
    def step(self) -> float:
        """Time from sample to sample [s]."""
        return 1.0 / self.sample_rate


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
