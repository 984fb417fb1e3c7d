"""Options of the methods with which the refined one is compared."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import ClassVar, Literal, TypeAlias, get_args

from ..core.parameters import N_RANGE, SIGMA_RANGE
from ..ground.options import described, option
from ..identification.options import Method

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
    module: ClassVar[str] = f"{__package__}.two_stage"


@described
@dataclass(frozen=True)
class PaperOptions(Method):
    """Options of the paper's method; the degrees are (4, 4) if None."""

    name: ClassVar[str] = "paper"
    module: ClassVar[str] = f"{__package__}.paper"

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


@dataclass(frozen=True)
class NiParameters:
    """Parameters of Ni's model, in mm and N; the force is zero at displacement 0 when Z is.

    Parameters
    ----------
    K1, K2, K3 : float       Elastic part [N/mm], [N/mm^2], [N/mm^3].
    B, C : float             Base [-], > 0, and exponent [1/mm] of the amplifier.
    eta : float              Slope of Z at its zero crossing [N/mm], > 0.
    theta, lambda_ : float   Shape [N^(1-n)/mm]; theta + lambda > 0 (bounded Z) and lambda >= theta, which is
                             sigma >= 1/2 (paper eqs. 6-7).
    n : float                Smoothness [-]; 0.222 reproduces the paper's rms force at the amplitude 5 mm.

    Raises
    ------
    ValueError               If the parameters are not physically possible or outside the closed form's range.
    """

    K1: float
    K2: float
    K3: float
    B: float
    C: float
    eta: float
    theta: float
    lambda_: float
    n: float = 0.222

    def __post_init__(self) -> None:
        total = self.theta + self.lambda_
        checks = (
            *((field.name, math.isfinite(getattr(self, field.name)), "finite") for field in fields(self)),
            ("B", self.B > 0.0, "> 0"),
            ("eta", self.eta > 0.0, "> 0 [N/mm]"),
            ("lambda_", total > 0.0, "above -theta (paper eq. 6)"),
            ("lambda_", self.lambda_ >= self.theta, "at least theta (paper eq. 6)"),
            ("lambda_", self.lambda_ <= SIGMA_RANGE[1] * total, f"at most {SIGMA_RANGE[1]:g}*(theta + lambda)"),
            ("n", N_RANGE[0] <= self.n <= N_RANGE[1], f"within [{N_RANGE[0]:g}, {N_RANGE[1]:g}]"),
        )
        for name, holds, condition in checks:
            if not holds:
                raise ValueError(f"`{name}` must be {condition}, got {getattr(self, name)!r}.")
        # In logarithms, since the power itself could overflow; within 200, products of z0 and rho stay finite.
        log_z0 = math.log(self.eta / total) / self.n
        if max(abs(log_z0), abs(math.log(self.eta) - log_z0)) > 200.0:
            raise ValueError(
                f"`n` must keep z0 = (eta/(theta + lambda))^(1/n) [N] and eta/z0 [1/mm] within 1e-86 and 1e86, got "
                f"{self.n!r} with ln(z0) = {log_z0:.4g}."
            )

    @property
    def growth(self) -> float:
        """C*ln(B), the rate at which the amplifier grows [1/mm]."""
        return self.C * math.log(self.B)

    @property
    def z0(self) -> float:
        """Z when saturated [N]."""
        return float((self.eta / (self.theta + self.lambda_)) ** (1.0 / self.n))

    @property
    def rho(self) -> float:
        """Slope of Z/z0 at its zero crossing [1/mm]."""
        return self.eta / self.z0

    @property
    def sigma(self) -> float:
        """Recovery after a reversal [-]."""
        return self.lambda_ / (self.theta + self.lambda_)


@described
@dataclass(frozen=True)
class NiOptions(Method):
    """Options of Ni's method; the degrees are (8, 6) if None, which stand for Ni's exponential."""

    name: ClassVar[str] = "ni"
    module: ClassVar[str] = f"{__package__}.ni"

    start: NiParameters | None = None  # read off the record's secant stiffness and loop area if None
