"""Options of the methods with which the refined one is compared."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias, get_args

from ..ground.options import described, option
from ..identification.options import Method

if TYPE_CHECKING:
    from ..identification.method import Fitted
    from ..identification.samples import Samples
    from .ni import NiParameters

Branch: TypeAlias = Literal["loading", "unloading"]


def levels_of(text: str) -> tuple[float, ...]:
    """Numbers with commas between them; raises ValueError for anything else."""
    try:
        return tuple(float(level) for level in text.split(","))
    except ValueError:
        raise ValueError(f"must be H1,H2,H3 (such as -0.5,0.35,0.7), got {text!r}.") from None


@described
@dataclass(frozen=True)
class TwoStageOptions(Method):
    """Options of our two-stage method: the paper's two stages, each by least squares over whole strokes."""

    name: ClassVar[str] = "two-stage"

    def candidates(self, samples: Samples, where: str) -> Iterator[Fitted]:
        """The spring, then such of lower degrees unless they are given."""
        from .two_stage import fitted_in_stages

        return fitted_in_stages(self, samples, where)


@described
@dataclass(frozen=True)
class PaperOptions(Method):
    """Options of the paper's method; the degrees are (4, 4) if None."""

    name: ClassVar[str] = "paper"

    steady: float = option(
        0.9, "number", "Half the steady section, share of the amplitude", least=0.0, most=1.0, is_open=True,
        metavar="SHARE", rare=True,
    )  # fmt: skip
    smoothing: int | None = option(
        None, "whole", "Half width of the moving average in samples", least=0, most=10_000,
        otherwise="a 48th of a period, but at least 1", metavar="SAMPLES", rare=True,
    )  # fmt: skip
    branch: Branch = option("loading", "choice", "The branch of the second stage", choices=get_args(Branch), rare=True)
    levels: tuple[float, ...] = option(
        (-0.5, 0.35, 0.7), "text", "Share of saturation at the three points of the loading branch where slopes are "
        "read; on the other with the other sign", metavar="H1,H2,H3", parse=levels_of, rare=True,
    )  # fmt: skip

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (len(self.levels) == 3 and -1.0 < self.levels[0] < 0.0 < self.levels[1] < self.levels[2] < 1.0):
            raise ValueError(f"`levels` must be three with -1 < H1 < 0 < H2 < H3 < 1, got {self.levels}.")

    def candidates(self, samples: Samples, where: str) -> Iterator[Fitted]:
        """Both stages on the mean period of one record; `choices` of the result holds what the paper leaves open."""
        from .paper import PaperMethod

        return PaperMethod(self).candidates(samples, where)


@described
@dataclass(frozen=True)
class NiOptions(Method):
    """Options of Ni's method; the degrees are (8, 6) if None, which stand for Ni's exponential."""

    name: ClassVar[str] = "ni"

    start: NiParameters | None = None  # read off the record's secant stiffness and loop area if None

    def candidates(self, samples: Samples, where: str) -> Iterator[Fitted]:
        """Ni's method on one periodic record."""
        from .ni import fitted_to_period

        return fitted_to_period(self, samples, where)
