"""The tables [[case]] of SYSTEM.toml as pydantic models, one for each kind of load, which a key of its name tells."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from ...ground.tables import OWN, TAG, StrictTable
from ..signals.level_table import Slope, with_slopes
from . import quantity_text as q
from .table_types import (
    Duration,
    FilePath,
    Force,
    Frequency,
    Impulse,
    Name,
    NamedDirection,
    Place,
    PositiveAcceleration,
    PositiveLength,
    ReadBy,
    SweepRate,
    Text,
    Time,
    Velocity,
    forms,
)

MOST_DIRECTIONS = 26  # axes, edges and corners of a cube
MOST_ROWS = 10_000
MOST_TONES = 20

Shape = Literal[
    "half-sine",
    "versed-sine",
    "terminal-sawtooth",
    "initial-sawtooth",
    "rectangle",
    "triangle",
    "trapezoid",
    "velocity-step",
]
Unit = Annotated[str, Field(min_length=1, max_length=60)]


def _read_column(value: Any) -> int | str:
    if isinstance(value, str) and 1 <= len(value) <= 200:
        return value
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= 100_000:
        return value
    raise ValueError("must be the name of a column, or its number from 1 on")


ColumnName = Annotated[
    int | str,
    ReadBy(
        _read_column,
        {"anyOf": [{"type": "string", "minLength": 1, "maxLength": 200}, {"type": "integer", "minimum": 1}]},
    ),
]


_CELL = {"anyOf": [{"type": "number"}, {"type": "string", "maxLength": 60}]}
_PAIRS = {
    "type": "array",
    "items": {"type": "array", "items": _CELL, "minItems": 2, "maxItems": 2},
    "minItems": 2,
    "maxItems": MOST_ROWS,
}
_SLOPE = re.compile(r"\s*([+-]?\d{1,4}(?:\.\d{0,9})?)\s*dB\s*/\s*oct(?:ave)?\s*", re.IGNORECASE)


def _read_pairs(
    value: Any, first: q.QuantityKind, second: q.QuantityKind, has_slopes: bool = False
) -> list[tuple[float, float | Slope]]:
    """Rows of two quantities, or of the first and a slope."""
    if not (isinstance(value, list) and 2 <= len(value) <= MOST_ROWS):
        raise ValueError(f"must be a list of 2 to {MOST_ROWS} pairs of {first.name} and {second.name}")
    rows: list[tuple[float, float | Slope]] = []
    for number, row in enumerate(value, start=1):
        if not (isinstance(row, list) and len(row) == 2):
            raise ValueError(f"must be a list of pairs, but entry {number} is none")
        slope = _SLOPE.fullmatch(row[1]) if has_slopes and isinstance(row[1], str) else None
        try:
            rows.append((q.in_si(row[0], first), Slope(float(slope[1])) if slope else q.in_si(row[1], second)))
        except q.QuantityError as problem:
            raise ValueError(f"in entry {number}: {problem}") from None
    return rows


def _pairs_of(first: q.QuantityKind, second: q.QuantityKind) -> ReadBy:
    """A table of pairs."""
    return ReadBy(lambda value: tuple(_read_pairs(value, first, second)), _PAIRS)


def _levels_of(kind: q.QuantityKind, decibels_per_decade: float) -> ReadBy:
    """Levels over frequency; a slope in dB per octave may lead to one."""
    return ReadBy(
        lambda value: with_slopes(_read_pairs(value, q.FREQUENCY, kind, has_slopes=True), decibels_per_decade), _PAIRS
    )


Pairs = tuple[tuple[float, float], ...]
AmplitudeTable = Annotated[Pairs, _levels_of(q.ACCELERATION, 20.0)]
DensityTable = Annotated[Pairs, _levels_of(q.ACCELERATION_DENSITY, 10.0)]
ForceTable = Annotated[Pairs, _pairs_of(q.TIME, q.FORCE)]
Axis = Literal["x", "y", "z"]


class CaseTable(StrictTable):
    """What all cases have in common."""

    name: Name
    source: Text = Field("", description="Where the levels come from, such as a standard and its table.")
    simulate: Duration | None = Field(
        None, description="Simulated time; the load and five periods of the slowest motion if not given."
    )


class DirectedCase(CaseTable):
    """A case along one direction, or one case for each of several."""

    direction: NamedDirection | None = None
    directions: list[NamedDirection] | None = Field(None, min_length=1, max_length=MOST_DIRECTIONS)


class PulseCase(DirectedCase):
    """A classical pulse of base acceleration."""

    pulse: Shape
    peak: PositiveAcceleration | None = None
    duration: Duration | None = None
    rise: Time | None = Field(None, description="Of a trapezoid; a tenth of the duration if not given.")
    fall: Time | None = None
    velocity: Velocity | None = Field(None, description="Of a velocity step.")


class DropTable(StrictTable):
    """Height of a fall, or the velocity at its end."""

    height: PositiveLength | None = None
    velocity: Velocity | None = None


class DropCase(DirectedCase):
    """A fall of the base with all on it, without weight, that ends suddenly."""

    drop: DropTable


class SineTable(StrictTable):
    """A sine of constant frequency."""

    frequency: Frequency
    amplitude: PositiveAcceleration | None = None
    displacement: PositiveLength | None = Field(None, description="Amplitude of displacement, instead.")
    duration: Duration
    soft_start: Time = 0.0


class SineCase(DirectedCase):
    """Vibration of the base at one frequency."""

    sine: SineTable
    settling: Time | None = Field(None, description="From when on rms and spectra are taken; half the duration.")


class SweepTable(StrictTable):
    """A sine whose frequency rises or falls."""

    first: Frequency
    last: Frequency
    rate: SweepRate = Field(description="Such as '1 oct/min' or '10 Hz/s'.")
    amplitude: PositiveAcceleration | None = None
    displacement: PositiveLength | None = Field(
        None, description="Amplitude of displacement up to where the acceleration reaches its amplitude."
    )
    table: AmplitudeTable | None = Field(None, description="Amplitude over frequency, instead of a constant one.")


class SweepCase(DirectedCase):
    """Vibration of the base over a range of frequency."""

    sweep: SweepTable


class ToneTable(StrictTable):
    """A sine on random vibration for its whole duration, of one frequency or swept once."""

    frequency: Frequency | None = None
    first: Frequency | None = Field(None, description="Where a sweep at a constant rate in octaves begins.")
    last: Frequency | None = None
    amplitude: PositiveAcceleration


class RandomTable(StrictTable):
    """Stationary random vibration along one direction, or uncorrelated along x, y and z at once."""

    psd: (
        Annotated[
            Annotated[dict[Axis, DensityTable], Tag(f"{TAG}table"), Field(min_length=1)]
            | Annotated[DensityTable, Tag(f"{TAG}list")],
            forms("must be a list of pairs of a frequency and a density, or a table with one for each of x, y and z"),
        ]
        | None
    ) = Field(
        None,
        description="One-sided power spectral density of acceleration over frequency, straight in log-log; slopes such "
        "as '+3 dB/oct' may lead to the first level or away from the last.",
    )
    file: FilePath | None = Field(None, description="Table of frequency and density, instead.")
    unit: Unit | None = Field(None, description="Of the density in the file, such as 'g^2/Hz'.")
    grms: (
        Annotated[
            Annotated[dict[Axis, PositiveAcceleration], Tag(f"{TAG}table")]
            | Annotated[PositiveAcceleration, Tag(f"{TAG}quantity")],
            forms("must be an acceleration such as '5 g', or a table with one for each axis"),
        ]
        | None
    ) = Field(None, description="Overall level as the standard states it, which the density is compared with.")
    sine: list[ToneTable] = Field(default=[], max_length=MOST_TONES, description="Sines on random.")
    duration: Duration
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0


class RandomCase(DirectedCase):
    """Random vibration of the base."""

    random: RandomTable
    settling: Time | None = Field(None, description="From when on rms and spectra are taken; a tenth of the duration.")


class SpectrumTable(StrictTable):
    """A shock response spectrum: largest accelerations of oscillators over their frequency."""

    levels: AmplitudeTable = Field(description="Pairs of frequency and acceleration, straight in log-log.")
    q: Annotated[float, Field(gt=0.5, le=1000.0)] | None = Field(None, description="Quality factor; 10 if not given.")
    damping: Annotated[float, Field(gt=0.0, lt=1.0)] | None = Field(None, description="Share of critical, instead.")


class ShockTable(SpectrumTable):
    """A shock of which the spectrum is given, as a synthesized acceleration."""

    duration: Duration
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0


class SpectrumCase(DirectedCase):
    """A shock by its response spectrum."""

    srs: ShockTable


class HeldTable(StrictTable):
    """A constant acceleration, reached without vibration."""

    level: PositiveAcceleration
    rise: Duration | None = Field(None, description="Ten periods of the slowest motion if not given.")
    duration: Duration | None = Field(None, description="With the rise; five periods more if not given.")


class HeldCase(DirectedCase):
    """Constant acceleration of the base."""

    acceleration: HeldTable


Motion = Literal["x", "y", "z", "rx", "ry", "rz"]


class RecordTable(StrictTable):
    """A measured motion of the base."""

    file: FilePath
    time: ColumnName | None = Field(None, description="Found by its name if not given.")
    columns: dict[Motion, ColumnName] = Field(
        description="By what they hold: acceleration along x, y, z, angular velocity about them."
    )
    units: dict[Literal["time"] | Motion, Unit] = Field(
        {}, description="Of each column; that of the file's header where none is given."
    )
    scale: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0


class RecordCase(CaseTable):
    """A measured motion of the base, of one to six columns."""

    record: RecordTable
    settling: Time | None = None


class ForceTableOfCase(StrictTable):
    """A force on a body, such as recoil: a pulse, a table of time and force, or a file."""

    body: Name | None = None
    place: Place | None = Field(
        None, description="Where it acts in the nominal pose; the centre of gravity if not given."
    )
    pulse: Shape | None = None
    peak: Force | None = None
    duration: Duration | None = None
    rise: Time | None = None
    fall: Time | None = None
    impulse: Impulse | None = Field(None, description="Of a velocity step.")
    table: ForceTable | None = None
    file: FilePath | None = None
    time: ColumnName | None = Field(None, description="Found by its name if not given.")
    column: ColumnName = "force"
    time_unit: Unit | None = None
    unit: Unit | None = None


class ForceCase(DirectedCase):
    """A force on a body."""

    force: ForceTableOfCase


KINDS = ("pulse", "drop", "acceleration", "srs", "sine", "sweep", "random", "record", "force")


def _kind_of_case(value: Any) -> str | None:
    kinds = [kind for kind in KINDS if isinstance(value, dict) and kind in value]
    return f"{TAG}{kinds[0]}" if len(kinds) == 1 else None


AnyCase = Annotated[
    Annotated[PulseCase, Tag(f"{TAG}pulse")]
    | Annotated[DropCase, Tag(f"{TAG}drop")]
    | Annotated[HeldCase, Tag(f"{TAG}acceleration")]
    | Annotated[SpectrumCase, Tag(f"{TAG}srs")]
    | Annotated[SineCase, Tag(f"{TAG}sine")]
    | Annotated[SweepCase, Tag(f"{TAG}sweep")]
    | Annotated[RandomCase, Tag(f"{TAG}random")]
    | Annotated[RecordCase, Tag(f"{TAG}record")]
    | Annotated[ForceCase, Tag(f"{TAG}force")],
    Discriminator(
        _kind_of_case,
        custom_error_type=OWN,
        custom_error_message=f"must be a table with exactly one of the keys {', '.join(KINDS)}",
    ),
]
