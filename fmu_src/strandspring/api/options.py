"""Options of functions and commands that belong to no lower folder; nothing here is slow to import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, TypeAlias, get_args

from ..core.parameters import N_RANGE
from ..errors import OptionError
from ..ground.options import check, described, option, options_of
from ..identification.options import Method, RefinedOptions, checked_method
from ..peers.options import NiOptions, PaperOptions, TwoStageOptions

Align: TypeAlias = Literal["record", "middle"]
METHODS: dict[str, type[Method]] = {
    method.name: method for method in (RefinedOptions, TwoStageOptions, PaperOptions, NiOptions)
}


@described
@dataclass(frozen=True)
class Fitting:
    """How records are identified.

    `options` are those of a method, in place of its name: RefinedOptions, TwoStageOptions, PaperOptions or NiOptions.

    Raises
    ------
    ValueError   If there is no method of this name.
    TypeError    If method and options are given, the options are of no method, or a truth value is none.
    """

    group: ClassVar[str] = "Fitting"
    parts: ClassVar[Mapping[str, type[Method]]] = {f"method {name}": METHODS[name] for name in reversed(METHODS)}

    method: str | None = option(
        None, "choice", "Method with its defaults. refined: the class that predicts held-out strokes best, with "
        "verdict and errors; two-stage: two stages as the paper's, by least squares over whole strokes, without "
        "iteration; paper: the paper's method as printed; ni: Ni's model and method, for comparison",
        otherwise="refined", choices=tuple(METHODS),
    )  # fmt: skip
    options: Method | None = None
    save_anyway: bool = option(
        False, "flag", "Save, with a caution, a spring that follows the records worse than a straight line does, "
        "instead of refusing it",
    )  # fmt: skip

    def __post_init__(self) -> None:
        if self.options is not None:
            checked_method(self.options)
            if self.method is not None:
                raise TypeError("`method` and `options` exclude each other; `options` say the method, too.")
        check(self)

    def with_options(self, **given: Any) -> Fitting:
        """This with options of a command, in which those of a method stand beside its name."""
        method, ours = METHODS[given.pop("method", "refined")], options_of(Fitting)
        others = {name: given.pop(name) for name in [*given] if name in ours}
        for name in [name for name in given if name not in options_of(method)]:
            owner = next(other.name for other in METHODS.values() if name in options_of(other))
            raise OptionError(f"{{to[{name}]}} belongs to {{to[method={owner}]}}.", of=method.name)
        return replace(self, options=method(**given), **others)

    @property
    def chosen(self) -> Method:
        """The method with its options."""
        return self.options or METHODS[self.method or "refined"]()


@described
@dataclass(frozen=True)
class Comparing:
    """How two springs are compared."""

    group: ClassVar[str] = "Comparison"

    align: Align = option(
        "record", "choice", "Displacements as in the records of both; or each counted from the middle of its own "
        "range, where the zero was moved between the tests", choices=get_args(Align),
    )  # fmt: skip
    amplitudes: float | Sequence[float] | None = option(
        None, "numbers", "Amplitude of a loop about the middle of the shared range", unit="m", shown="mm", factor=1e-3,
        least=0.0, is_open=True, otherwise="its quarters", metavar="MM",
    )  # fmt: skip
    mass: float | None = option(
        None, "number", "Mass for the transmissibility, whose weight loads the spring", unit="kg", least=0.0,
        is_open=True, otherwise="one that A holds in the middle of the range", metavar="KG",
    )  # fmt: skip
    draws: int = option(
        200, "whole", "Springs drawn from the uncertainty of each model, at least 20; 0 for no verdict", least=0,
        most=100_000,
    )  # fmt: skip
    seed: int = option(0, "whole", "Seed of the draws", least=0)

    def __post_init__(self) -> None:
        check(self)
        if 0 < self.draws < 20:
            raise ValueError(f"`draws` must be 0 or at least 20, got {self.draws!r}.")


@described
@dataclass(frozen=True)
class Sampling:
    """How a record is computed; some are of a spring only, and `exponent` is of Ni's experiment."""

    group: ClassVar[str] = "Sampling"

    mean: float | None = option(
        None, "number", "Mean displacement", unit="m", shown="mm", factor=1e-3, otherwise="the model's offset",
        metavar="MM",
    )  # fmt: skip
    cycles: int | None = option(
        None, "whole", "Cycles of each amplitude", least=1, most=100_000, otherwise="3, of Ni's experiment 1"
    )
    samples: int = option(1000, "whole", "Samples of each cycle", least=8, most=1_000_000)
    frequency: float = option(
        1.0, "number", "Of the times; the force does not depend on it", unit="Hz", least=0.0, is_open=True, metavar="HZ"
    )
    noise: float | None = option(
        None, "number", "eps of the force r*(1 + eps*R), R standard normal (paper eq. 31)", least=0.0,
        otherwise="0, of Ni's experiment 0.03", metavar="EPS",
    )  # fmt: skip
    seed: int = option(0, "whole", "Seed of the noise", least=0)
    drift: float = option(
        0.0, "number", "Relative growth of the force from the first sample to the last", metavar="SHARE"
    )
    displacement_resolution: float = option(
        0.0, "number", "Resolution of the displacement sensor, 0 for all digits", unit="m", shown="mm", factor=1e-3,
        least=0.0, metavar="MM",
    )  # fmt: skip
    force_resolution: float = option(
        0.0, "number", "Resolution of the force sensor, 0 for all digits", unit="N", least=0.0, metavar="N"
    )
    exponent: float | None = option(
        None, "number", "n of eq. (29), which the paper does not print", least=N_RANGE[0], most=N_RANGE[1],
        otherwise="0.222", metavar="N",
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self)
