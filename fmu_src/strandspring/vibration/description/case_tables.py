"""The tables [[case]] of SYSTEM.toml as pydantic models, one for each kind of load, which a key of its name tells."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from ...ground.tables import OWN, TAG, StrictTable
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
)

MOST_DIRECTIONS = 26  # axes, edges and corners of a cube
MOST_ROWS = 10_000

Shape = Literal[
    "half-sine", "terminal-sawtooth", "initial-sawtooth", "rectangle", "triangle", "trapezoid", "velocity-step"
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


def _rows_of(*kinds: q.QuantityKind) -> ReadBy:
    """A table of pairs."""

    def read(value: Any) -> tuple[tuple[float, float], ...]:
        first, second = kinds
        if not (isinstance(value, list) and 2 <= len(value) <= MOST_ROWS):
            raise ValueError(f"must be a list of 2 to {MOST_ROWS} pairs of {first.name} and {second.name}")
        rows = []
        for number, row in enumerate(value, start=1):
            if not (isinstance(row, list) and len(row) == 2):
                raise ValueError(f"must be a list of pairs, but entry {number} is none")
            try:
                rows.append((q.in_si(row[0], first), q.in_si(row[1], second)))
            except q.QuantityError as problem:
                raise ValueError(f"in entry {number}: {problem}") from None
        return tuple(rows)

    cell = {"anyOf": [{"type": "number"}, {"type": "string", "maxLength": 60}]}
    pair = {"type": "array", "items": cell, "minItems": 2, "maxItems": 2}
    return ReadBy(read, {"type": "array", "items": pair, "minItems": 2, "maxItems": MOST_ROWS})


Pairs = tuple[tuple[float, float], ...]
AmplitudeTable = Annotated[Pairs, _rows_of(q.FREQUENCY, q.ACCELERATION)]
DensityTable = Annotated[Pairs, _rows_of(q.FREQUENCY, q.ACCELERATION_DENSITY)]
ForceTable = Annotated[Pairs, _rows_of(q.TIME, q.FORCE)]


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


class RandomTable(StrictTable):
    """Stationary random vibration."""

    psd: DensityTable | None = Field(
        None, description="One-sided power spectral density of acceleration over frequency, straight in log-log."
    )
    file: FilePath | None = Field(None, description="Table of frequency and density, instead.")
    unit: Unit | None = Field(None, description="Of the density in the file, such as 'g^2/Hz'.")
    duration: Duration
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0


class RandomCase(DirectedCase):
    """Random vibration of the base."""

    random: RandomTable
    settling: Time | None = Field(None, description="From when on rms and spectra are taken; a tenth of the duration.")


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


KINDS = ("pulse", "drop", "sine", "sweep", "random", "record", "force")


def _kind_of_case(value: Any) -> str | None:
    kinds = [kind for kind in KINDS if isinstance(value, dict) and kind in value]
    return f"{TAG}{kinds[0]}" if len(kinds) == 1 else None


AnyCase = Annotated[
    Annotated[PulseCase, Tag(f"{TAG}pulse")]
    | Annotated[DropCase, Tag(f"{TAG}drop")]
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
