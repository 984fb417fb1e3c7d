"""What a user says of one mass on springs: the mount, what shakes it, and the curve over the frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, ClassVar

from ...errors import IsolationError
from ...ground.options import check, described, option

if TYPE_CHECKING:
    from ...kernel.arrays import FloatArray

# Levels of base displacement where none are given, shares of the free travel; help and results of `isolate` name them.
DEFAULT_SHARES = (0.005, 0.01, 0.02)
# Far beyond what any spring of this program carries.
MASS_RANGE = (1e-9, 1e9)  # [kg]
MOST_SPRINGS = 1_000_000  # side by side, and in series
_MOST_POINTS = 100_000
_KINDS = ("base_displacement", "base_acceleration", "base_rotation", "force")
_DIRECTIONS = ("x", "y", "z")


class Excitation(Enum):
    """What shakes the system; the value is how people name it."""

    BASE_DISPLACEMENT = "base displacement"
    BASE_ACCELERATION = "base acceleration"
    FORCE = "force"

    @property
    def unit(self) -> str:
        """SI unit of its level."""
        return {"base displacement": "m", "base acceleration": "m/s^2", "force": "N"}[self.value]

    def base_amplitude(self, level: float, omega: FloatArray) -> FloatArray:
        """Amplitude of the base's displacement at Omega [rad/s], positive in phase with the excitation [m]."""
        if self is Excitation.FORCE:
            return 0.0 * omega
        return 0.0 * omega + level if self is Excitation.BASE_DISPLACEMENT else -level / omega**2

    def level_text(self, level: float) -> str:
        """A level in the unit that people read."""
        return f"{1e3 * level:.4g} mm" if self is Excitation.BASE_DISPLACEMENT else f"{level:.4g} {self.unit}"


def checked_limits(limits: tuple[float, float]) -> tuple[float, float]:
    """The limits of a band [Hz], if they rise from above 0.

    Raises
    ------
    IsolationError   If they do not.
    """
    low, high = limits
    if not (math.isfinite(low) and math.isfinite(high) and 0.0 < low < high):
        raise IsolationError(f"The band must rise from above 0 [Hz], got {low:.10g} to {high:.10g}.")
    return low, high


def direction_of(text: str) -> str | tuple[float, ...]:
    """x, y or z with or without a sign, or three numbers with commas; raises ValueError for anything else."""
    if text.lstrip("+-") in _DIRECTIONS and len(text) <= 2:
        return text
    try:
        components = tuple(float(part) for part in text.split(","))
    except ValueError:
        components = ()
    if len(components) != 3 or not all(map(math.isfinite, components)) or not any(components):
        raise ValueError(f"must be x, y, z, -x, -y, -z or three numbers such as 1,0,1, got {text!r}.")
    return components


@described
@dataclass(frozen=True)
class Mount:
    """A mount of equal springs, and the load on it.

    Raises
    ------
    IsolationError   If a value is out of its bounds.
    """

    group: ClassVar[str] = "Mount"

    load: float | None = option(
        None, "number", "Static load along the axis, positive as the force", unit="N", otherwise="the weight",
        metavar="N",
    )  # fmt: skip
    parallel: int = option(1, "whole", "Rows of springs side by side", least=1, most=MOST_SPRINGS)
    series: int = option(1, "whole", "Springs in series in each row", least=1, most=MOST_SPRINGS)
    damping: float = option(
        0.0, "number", "Viscous damping in parallel with the springs", unit="N s/m", least=0.0, metavar="N*S/M"
    )

    def __post_init__(self) -> None:
        check(self, IsolationError)

    @property
    def stiffness_scale(self) -> float:
        """Stiffness of the mount over that of one spring, P/S."""
        return self.parallel / self.series


@described
@dataclass(frozen=True)
class Curve:
    """The frequencies at which a curve is computed.

    Raises
    ------
    IsolationError   If the band does not rise from above 0, or there are too few points.
    """

    group: ClassVar[str] = "Curve"

    band: tuple[float, float] | None = option(
        None, "limits", "Lowest and highest frequency", unit="Hz", metavar="LOW HIGH", checks=checked_limits,
        otherwise="0.23 to 5 times the natural frequency of small motion",
    )  # fmt: skip
    points: int = option(
        200, "whole", "Number of frequencies, evenly spaced in the logarithm", least=2, most=_MOST_POINTS
    )
    extrapolate: bool = option(
        False, "flag", "Continue where the motion leaves the identified range, instead of refusing"
    )

    def __post_init__(self) -> None:
        check(self, IsolationError)


@described
@dataclass(frozen=True)
class Levels:
    """What shakes the system, and how much: one level or several of one kind of excitation.

    Raises
    ------
    IsolationError   If levels are given of more than one kind, or are not finite and > 0.
    """

    group: ClassVar[str] = "Excitation"

    base_displacement: float | Sequence[float] | None = option(
        None, "numbers", "Displacement amplitude of the base", unit="m", shown="mm", factor=1e-3, least=0.0,
        is_open=True, otherwise="0.5, 1 and 2 % of the free travel, in a study of a model 1 %", metavar="MM",
    )  # fmt: skip
    base_acceleration: float | Sequence[float] | None = option(
        None, "numbers", "Acceleration amplitude of the base", unit="m/s^2", least=0.0, is_open=True, metavar="M/S2"
    )
    base_rotation: float | Sequence[float] | None = option(
        None, "numbers", "Of a system: rotation amplitude of the base about an axis through the origin", unit="rad",
        shown="deg", factor=math.radians(1.0), least=0.0, is_open=True, metavar="DEG",
    )  # fmt: skip
    force: float | Sequence[float] | None = option(
        None, "numbers", "Amplitude of a force on the mass", unit="N", least=0.0, is_open=True, metavar="N"
    )
    directions: str | Sequence[str | Sequence[float]] | None = option(
        None, "texts", "Of a system: direction of the excitation, or axis of the rotation", otherwise="x, y and z",
        metavar="x|y|z|X,Y,Z", parse=direction_of,
    )  # fmt: skip
    at: str | None = option(
        None, "text", "Of a system: the point or body on which the force acts", otherwise="the first body",
        metavar="POINT",
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self, IsolationError)
        given = [name for name in _KINDS if getattr(self, name) is not None]
        if len(given) > 1:
            sentence = f"{{to[{given[0]}]}} and {{to[{given[1]}]}} exclude each other; give one of them."
            raise IsolationError(sentence, given=given)

    @property
    def rotation(self) -> tuple[float, ...] | None:
        """The levels of rotation [rad]; None if there are none."""
        return self.base_rotation  # type: ignore[return-value]  # made numbers by `check`

    @property
    def chosen(self) -> tuple[Excitation, tuple[float, ...]] | None:
        """The excitation for which levels are given, with these [m, m/s^2 or N]; None if there are none."""
        for excitation in Excitation:
            if (levels := getattr(self, excitation.value.replace(" ", "_"))) is not None:
                return excitation, levels
        return None
