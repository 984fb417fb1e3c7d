"""What a model file holds, as pydantic models: checks on load and the published schema come from them.

Imported where a file is checked only, since pydantic is slow to import.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic.config import JsonDict

from ..core.branches import BRANCHES, TIME_CONSTANT_RANGE
from ..core.parameters import (
    FORCE_RANGE,
    KNOTS,
    LARGEST_DISPLACEMENT,
    MAXIMUM_AMPLIFIER_DEGREE,
    MAXIMUM_DEGREE,
    N_RANGE,
    SIGMA_RANGE,
)
from ..ground.tables import TAG, StrictTable
from .joint import LARGEST_SPREAD, LEVEL
from .names import MAX_DESCRIPTION, NAME_PATTERN, NAME_RULE, VERSION, VERSION_OF_BRANCHES


def _within(low: float, high: float) -> JsonDict:
    """Limits for the schema; `SpringParameters` checks them, and says which unit they have."""
    return {"minimum": low, "maximum": high}


_OF_DISPLACEMENT = _within(-LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT)
_Amplifier = Annotated[list[float], Field(min_length=1, max_length=MAXIMUM_AMPLIFIER_DEGREE + 1)]
_Elastic = Annotated[list[float], Field(min_length=1, max_length=MAXIMUM_DEGREE + 1)]
_Knots = Annotated[list[float], Field(min_length=KNOTS[0], max_length=KNOTS[1])]


class _OfMechanism(StrictTable):
    """Parameters of a friction mechanism kappa_omega*FA*omega."""

    kA: _Amplifier = Field(
        description="Amplifier coefficients of ascending powers of displacement - displacement_offset [1/m^i], the "
        "first of which is 1"
    )
    kappa_omega: float = Field(
        description="Saturated hysteretic force at displacement_offset [N]", json_schema_extra=_within(*FORCE_RANGE)
    )
    rho: float = Field(
        description="Slope of omega at its zero crossing [1/m]", json_schema_extra={"exclusiveMinimum": 0.0}
    )
    sigma: float = Field(description="Recovery after a reversal [-]", json_schema_extra=_within(*SIGMA_RANGE))
    n: float = Field(description="Smoothness exponent [-]", json_schema_extra=_within(*N_RANGE))


class Second(_OfMechanism):
    """A second friction mechanism, whose force is added; it has an omega of its own."""


class Branch(StrictTable):
    """A Maxwell branch, whose force r is added: dr/dt = stiffness*dx/dt - r/time_constant."""

    stiffness: float = Field(
        description="What it adds to the stiffness of fast motion [N/m]", json_schema_extra={"minimum": 0.0}
    )
    time_constant: float = Field(
        description="In which its force decays to 1/e at rest [s]", json_schema_extra=_within(*TIME_CONSTANT_RANGE)
    )


class _Common(_OfMechanism):
    """Parameters that every spring has, and those that one of format_version 3 or later may have."""

    displacement_offset: float = Field(
        description="Displacement about which the polynomials are written [m]", json_schema_extra=_OF_DISPLACEMENT
    )
    displacement_min: float = Field(
        description="Lower end of the identified range [m]", json_schema_extra=_OF_DISPLACEMENT
    )
    displacement_max: float = Field(
        description="Upper end of the identified range [m]", json_schema_extra=_OF_DISPLACEMENT
    )
    second: Second | None = Field(None, description="A second friction mechanism; from format_version 3 on")
    branches: list[Branch] = Field([], max_length=BRANCHES, description="Maxwell branches; from format_version 3 on")


class Parameters(_Common):
    """Parameters of the modified normalized Bouc-Wen model, paper eqs. (8)-(11), in SI units."""

    kE: _Elastic = Field(
        description="Elastic coefficients of ascending powers of displacement - displacement_offset [N/m^i]"
    )


class TableParameters(_Common):
    """The parameters with the elastic force FE as a table."""

    FE_knots: _Knots = Field(
        description="Rising displacements, the first displacement_min and the last displacement_max, through whose "
        "forces the cubic spline of FE goes: twice continuously differentiable, and one polynomial over the first two "
        "and over the last two intervals (not-a-knot) [m]"
    )
    FE_forces: _Knots = Field(description="Elastic force FE at each of FE_knots [N]")


def _form_of_elastic_force(content: Any) -> str:
    return f"{TAG}table" if isinstance(content, dict) and {"FE_knots", "FE_forces"} & set(content) else f"{TAG}kE"


class _Open(StrictTable):
    """A table that may hold more than what is read."""

    model_config = ConfigDict(extra="allow")


def _check_ends(ends: list[float | None]) -> list[float | None]:
    low, high = ends
    if low is not None and high is not None and low > high:
        raise ValueError(f"must be a lower and an upper end, got {low:g} and {high:g}; exchange them")
    return ends


_Size = Annotated[float, Field(ge=0.0)]
_Spread = Annotated[float, Field(ge=0.0, le=LARGEST_SPREAD)]
_Interval = Annotated[list[float | None], Field(min_length=2, max_length=2), AfterValidator(_check_ends)]


class PredictionInterval(_Open):
    """Prediction interval of the force [N]."""

    level: Annotated[float, Field(ge=LEVEL, le=LEVEL)]
    factor: _Spread
    additive: _Spread
    relative: _Spread
    error: _Spread
    half_width: _Spread
    held_out_coverage: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    held_out_cycles: _Size


class Joint(_Open):
    """Joint covariance L*L' of the coefficients named by `parameters`, by the rows of the lower triangular L."""

    parameters: list[str]
    root: list[list[float]]


class Uncertainty(_Open):
    """What is read where it is given; all else is free. Lists have as many numbers as those of the parameters."""

    kappa_omega: _Size | None = Field(None, description="Standard error [N]; null where it ended at its bound")
    rho: _Size | None = Field(None, description="Standard error [1/m]; null where it ended at its bound")
    sigma: _Size | None = Field(None, description="Standard error [-]; null where it ended at its bound")
    n: _Size | None = Field(None, description="Standard error [-]; null where it ended at its bound")
    kE: list[_Size | None] | None = Field(None, description="Standard error of each of kE")
    FE_forces: list[_Size | None] | None = Field(None, description="Standard error of each of FE_forces [N]")
    kA: list[_Size | None] | None = Field(None, description="Standard error of each of kA")
    correlation: dict[str, Annotated[float, Field(ge=-1.0, le=1.0)] | None] | None = Field(
        None, description="Correlations of the standard errors, by two names and a comma"
    )
    indistinct: list[str] | None = Field(
        None, description="Sentences on parameters that are strongly correlated in the records"
    )
    interval_95: dict[str, _Interval] | None = Field(
        None,
        description="Lower and upper end of the 95 % interval of each parameter; null on a side that is not bounded",
    )
    prediction_interval: PredictionInterval | None = None
    joint: Joint | None = None


class Fit(_Open):
    """Figures of the identification. Programs must expect any part to be missing."""

    rmse: Any = Field(
        None,
        description="Root mean square error of the saved spring alone over all records, driven by their displacement "
        "as recorded [N]",
    )
    rnl: Any = Field(None, description="1 - sqrt(sum of squared errors / sum of squared forces), likewise [-]")
    energy: Any = Field(None, description="Work of the measured force without FE over the samples compared [J]")
    predicted_energy: Any = Field(
        None, description="Work of the saved spring's force without FE over the same samples [J]"
    )
    fitted: Any = Field(
        None,
        description="rmse, rnl, energy and predicted_energy with what the rig added to the records",
    )
    verdict: Any = Field(
        None,
        description="Whether the spring is usable, a sentence; its error on held-out strokes, share of the standard "
        "deviation of the force, and plain: that of each plain model",
    )
    records: Any = Field(
        None,
        description="One object for each record: file, samples compared, first_sample, the figures above, fitted, "
        "omega_start at its first sample, and what was compared, in words",
    )


_Omega = Annotated[float, Field(ge=-1.0, le=1.0)]


class Start(StrictTable):
    """Displacement and state at the first sample of the first record."""

    displacement: float = Field(
        ge=-LARGEST_DISPLACEMENT, le=LARGEST_DISPLACEMENT, description="At that sample, in the record's coordinates [m]"
    )
    omega: _Omega = Field(description="Normalized hysteretic variable there [-]")
    second_omega: _Omega | None = Field(None, description="That of the second mechanism, where there is one [-]")
    branch_forces: list[float] = Field([], description="Force of each Maxwell branch there [N]")
    at_rest: bool = Field(description="Whether the record began at rest")


class Certificate(StrictTable):
    """Range of the recorded force, and how far the saved spring may leave it."""

    force_min: float = Field(description="Least recorded force [N]")
    force_max: float = Field(description="Largest recorded force [N]")
    margin: _Size = Field(description="By which the force of the spring may be below or above [N]")

    @model_validator(mode="after")
    def _check_range(self) -> Certificate:
        if self.force_min > self.force_max:
            raise ValueError(
                f"`force_min` must be at most `force_max`, got {self.force_min:g} and {self.force_max:g}; exchange them"
            )
        return self


_SINCE = {"start": VERSION, "certificate": VERSION}
_SINCE |= {"parameters.second": VERSION_OF_BRANCHES, "parameters.branches": VERSION_OF_BRANCHES}


def _check_version(version: int) -> int:
    if not 1 <= version <= VERSION:
        raise ValueError(f"must be 1 to {VERSION}, got {version}; correct it, or identify again")
    return version


class FileTable(StrictTable):
    """Content of a model file.

    `fit` and `uncertainty` hold figures of the identification; `provenance` names the records with sha256, the method,
    the options and the version. All three may be empty, as for a model written by hand, which has no `start` and no
    `certificate` either.
    """

    format: Literal["strandspring-model"]
    format_version: Annotated[int, AfterValidator(_check_version)] = Field(
        json_schema_extra={"enum": list(range(1, VERSION + 1))}
    )
    name: str = Field(description=NAME_RULE, json_schema_extra={"pattern": NAME_PATTERN})
    description: str = Field("", max_length=MAX_DESCRIPTION)
    parameters: Annotated[
        Annotated[Parameters, Tag(f"{TAG}kE")] | Annotated[TableParameters, Tag(f"{TAG}table")],
        Discriminator(_form_of_elastic_force),
    ]
    start: Start | None = Field(None, description="Where the first record began; from format_version 4 on")
    certificate: Certificate | None = Field(
        None, description="Range that the force of the spring keeps; from format_version 4 on"
    )
    fit: Fit = Field(default_factory=lambda: Fit.model_validate({}))
    uncertainty: Uncertainty = Field(default_factory=lambda: Uncertainty.model_validate({}))
    provenance: dict[str, Any] = Field({})

    @model_validator(mode="after")
    def _check_fields(self) -> FileTable:
        given = self.model_fields_set | {f"parameters.{name}" for name in self.parameters.model_fields_set}
        if late := [name for name, since in _SINCE.items() if name in given and self.format_version < since]:
            raise ValueError(
                f'field "{late[0]}" is for files from format_version {_SINCE[late[0]]} on, and this is one of version '
                f"{self.format_version}; write {_SINCE[late[0]]} there, or remove the field"
            )
        return self
