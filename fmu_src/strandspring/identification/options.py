"""Options of the methods of identification."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias, get_args

from ..core.branches import BRANCHES, MECHANISMS
from ..core.parameters import MAXIMUM_AMPLIFIER_DEGREE, MAXIMUM_DEGREE
from ..ground.options import check, described, option

State: TypeAlias = Literal["first", "mean", "last"]


def degrees_of(text: str) -> tuple[int, int] | None:
    """Degrees as people give them on one line; raises ValueError for anything else."""
    if text == "auto":
        return None
    numbers = [part.strip() for part in text.split(",")]
    if len(numbers) != 2 or not all(part.isdecimal() and len(part) <= 2 for part in numbers):
        raise ValueError(f"must be N,M (such as 3,2) or auto, got {text!r}.")
    return int(numbers[0]), int(numbers[1])


@dataclass(frozen=True)
class Method:
    """Options of a method of identification, which check themselves.

    The method itself is the function `candidates` of a module that is slow to import, see `method.Candidates`.
    """

    name: ClassVar[str]
    module: ClassVar[str]

    degrees: tuple[int, int] | None = option(
        None, "text", "Degrees N of the elastic and M of the amplifier polynomial", otherwise="chosen from the records",
        metavar="N,M|auto", parse=degrees_of,
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self)
        if self.degrees is None:
            return
        try:
            elastic, amplifier = self.degrees
            is_possible = 1 <= elastic <= MAXIMUM_DEGREE and 0 <= amplifier <= MAXIMUM_AMPLIFIER_DEGREE
        except (TypeError, ValueError):  # not two numbers
            is_possible = False
        if not is_possible:
            raise ValueError(
                f"`degrees` must be N,M with 1 <= N <= {MAXIMUM_DEGREE} and 0 <= M <= {MAXIMUM_AMPLIFIER_DEGREE}, "
                f"got {self.degrees}."
            )


def checked_method(options: Any) -> Method:
    """The options, unless they are of no method, which is a TypeError."""
    if not isinstance(options, Method):
        raise TypeError(f"`options` must be of a method, such as RefinedOptions(), got {options!r}.")
    return options


@described
@dataclass(frozen=True)
class RefinedOptions(Method):
    """Options of the refined method.

    Offsets of force between records, a drift and a delay are removed without being asked for where then only noise is
    left, see `effects`; what no record shows is given here. With given degrees FE is not a table, and mechanisms and
    branches are only what is given.
    """

    name: ClassVar[str] = "refined"
    module: ClassVar[str] = f"{__package__}.refined"

    moving_mass: float = option(
        0.0, "number", "Mass between load cell and spring, whose inertia is removed; needs times", unit="kg", least=0.0,
        metavar="KG", group="Rig",
    )  # fmt: skip
    fixture_stiffness: float = option(
        math.inf, "number", "Stiffness of what yields between displacement sensor and spring, whose deflection is "
        "removed", unit="N/m", shown="N/mm", factor=1e3, least=0.0, is_open=True, may_be_infinite=True, metavar="N/MM",
        group="Rig",
    )  # fmt: skip
    delay: float | None = option(
        None, "number", "Time by which the force lags, negative if it leads; needs times", unit="s", shown="ms",
        factor=1e-3, otherwise="sought in the records", metavar="MS", group="Rig",
    )  # fmt: skip
    robust: bool = option(False, "flag", "Huber's loss instead of squares, for records with outliers")
    state: State = option(
        "mean", "choice", "Which cycles of an amplitude are fitted where the test changes the spring: the first third, "
        "all, or the last third", choices=get_args(State),
    )  # fmt: skip
    mechanisms: int | None = option(
        None, "whole", "Friction mechanisms", least=1, most=MECHANISMS, metavar="N",
        otherwise="a second one where it predicts better",
    )  # fmt: skip
    branches: int | None = option(
        None, "whole", "Maxwell branches; they need times", least=0, most=BRANCHES,
        otherwise="one or two where they predict better", metavar="N",
    )  # fmt: skip

    @property
    def known(self) -> dict[str, float]:
        """What is removed as the rig's, by name, in SI units."""
        taken = {"moving_mass": self.moving_mass, "fixture_stiffness": self.fixture_stiffness, "delay": self.delay}
        nothing = {"moving_mass": 0.0, "fixture_stiffness": math.inf}
        return {name: size for name, size in taken.items() if size is not None and size != nothing.get(name)}
