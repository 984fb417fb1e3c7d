"""What is allowed of a system on its mounts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Limits:
    """Limits to which the answers of every case are held; what has none is only reported.

    Parameters
    ----------
    acceleration : mapping    Largest absolute acceleration of each point by its name [m/s^2].
    sway : mapping            Largest displacement of each point relative to the base, from its static pose [m].
    tilt : float or None      Largest rotation of a body relative to the base, from its static pose [rad].
    stroke : float            Share of the identified range that springs may use.
    """

    acceleration: Mapping[str, float] = field(default_factory=dict)
    sway: Mapping[str, float] = field(default_factory=dict)
    tilt: float | None = None
    stroke: float = 1.0
