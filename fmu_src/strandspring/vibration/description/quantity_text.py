"""Numbers with units as people write them, in SI: "12 mm", "40 g", "0.04 g^2/Hz", "3 oct/min", "100 N/mm", "5 kg m^2".

A unit is a product of unit names, each with an optional power, and at most one division; lengths, forces and times are
spelled as in records. A name that has several meanings takes the one that fits: "20 g" is a mass where a mass is asked
for and 20 times standard gravity where an acceleration is; likewise "lb", a mass or a force.

A number without a unit could mean several things, 10 an acceleration of 10 g or of 10 m/s^2: it is refused unless
`stated_units` says what it means. Frequencies are in Hz, and 0 is 0 in every unit.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

from ...errors import RecordError, StrandspringError
from ...ground.gravity import STANDARD_GRAVITY
from ...ground.quoting import quoted
from ...ground.strict_json import is_finite
from ...records.units import kind_of_unit, unit_factor

Powers = tuple[int, int, int, int, int]  # of length, mass, time, angle, octaves

_LONGEST = 60
_MOST_FACTORS = 6
_LARGEST_POWER = 4
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?)\s*(.*)", re.DOTALL)
_TOKEN = re.compile(r"\*\*|[*·⋅/^()]|[+-]?\d+|[^\d\s*·⋅/^()+-]+|[+-]")
_OPERATORS = frozenset("*·⋅/^()+-0123456789") | {""}
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d")


@dataclass(frozen=True)
class QuantityKind:
    """A kind of quantity.

    Parameters
    ----------
    name : str         For messages, such as "a length".
    unit : str         In SI, for messages.
    powers : Powers
    example : str      Such as "12 mm".
    key : str          By which files state the unit of numbers without one; "" where they cannot.
    """

    name: str
    unit: str
    powers: Powers
    example: str
    key: str = ""


LENGTH = QuantityKind("a length", "m", (1, 0, 0, 0, 0), "12 mm", "length")
MASS = QuantityKind("a mass", "kg", (0, 1, 0, 0, 0), "20 kg", "mass")
TIME = QuantityKind("a time", "s", (0, 0, 1, 0, 0), "11 ms", "time")
ANGLE = QuantityKind("an angle", "rad", (0, 0, 0, 1, 0), "40 deg", "angle")
FORCE = QuantityKind("a force", "N", (1, 1, -2, 0, 0), "1.5 kN", "force")
VELOCITY = QuantityKind("a velocity", "m/s", (1, 0, -1, 0, 0), "3 m/s", "velocity")
ACCELERATION = QuantityKind("an acceleration", "m/s^2", (1, 0, -2, 0, 0), "15 g", "acceleration")
ANGULAR_VELOCITY = QuantityKind("an angular velocity", "rad/s", (0, 0, -1, 1, 0), "10 deg/s")
FREQUENCY = QuantityKind("a frequency", "Hz", (0, 0, -1, 0, 0), "20 Hz")
STIFFNESS = QuantityKind("a stiffness", "N/m", (0, 1, -2, 0, 0), "100 N/mm", "stiffness")
DAMPING = QuantityKind("a damping coefficient", "N s/m", (0, 1, -1, 0, 0), "50 N s/m", "damping")
INERTIA = QuantityKind("a moment of inertia", "kg m^2", (2, 1, 0, 0, 0), "5 kg m^2", "inertia")
ACCELERATION_DENSITY = QuantityKind(
    "a spectral density of acceleration", "(m/s^2)^2/Hz", (2, 0, -3, 0, 0), "0.04 g^2/Hz", "density"
)
IMPULSE = QuantityKind("an impulse", "N s", (1, 1, -1, 0, 0), "50 N s", "impulse")
OCTAVE_RATE = QuantityKind("a logarithmic sweep rate", "oct/s", (0, 0, -1, 0, 1), "3 oct/min")
FREQUENCY_RATE = QuantityKind("a linear sweep rate", "Hz/s", (0, 0, -2, 0, 0), "10 Hz/s")
_NUMBER_ALONE = QuantityKind("a number without unit", "1", (0, 0, 0, 0, 0), "1")

QUANTITIES = (
    LENGTH, MASS, TIME, ANGLE, FORCE, VELOCITY, ACCELERATION, ANGULAR_VELOCITY, FREQUENCY, STIFFNESS, DAMPING, INERTIA,
    ACCELERATION_DENSITY, IMPULSE, OCTAVE_RATE, FREQUENCY_RATE, _NUMBER_ALONE,
)  # fmt: skip

_STATED: ContextVar[Mapping[str, float]] = ContextVar("stated units", default=MappingProxyType({}))
_OF_RECORDS = {"displacement": LENGTH.powers, "force": FORCE.powers, "time": TIME.powers}
_ALONE = _NUMBER_ALONE.powers
# What a number may be meant in where the example has the SI unit.
_OTHER_READINGS = {
    "mass": ("lb",),
    "velocity": ("in/s",),
    "damping": ("N s/mm",),
    "inertia": ("kg mm^2",),
    "impulse": ("lbf s",),
}
# Spellings whose case matters, then those in lower case that are accepted in any.
_EXACT: Mapping[str, tuple[float, Powers]] = {
    "mg": (1e-6, MASS.powers),
    "Mg": (1e3, MASS.powers),
    "t": (1e3, MASS.powers),
    "mHz": (1e-3, FREQUENCY.powers),
    "MHz": (1e6, FREQUENCY.powers),
    "mrad": (1e-3, ANGLE.powers),
}
_ANY_CASE: Mapping[str, tuple[tuple[float, Powers], ...]] = {
    "kg": ((1.0, MASS.powers),),
    "g": ((1e-3, MASS.powers), (STANDARD_GRAVITY, ACCELERATION.powers)),
    "gn": ((STANDARD_GRAVITY, ACCELERATION.powers),),
    "lb": ((0.45359237, MASS.powers),),
    "lbs": ((0.45359237, MASS.powers),),
    "lbm": ((0.45359237, MASS.powers),),
    "oz": ((0.028349523125, MASS.powers),),
    "slug": ((14.593902937206365, MASS.powers),),
    "hz": ((1.0, FREQUENCY.powers),),
    "khz": ((1e3, FREQUENCY.powers),),
    "rpm": ((1.0 / 60.0, FREQUENCY.powers), (math.pi / 30.0, ANGULAR_VELOCITY.powers)),
    "rad": ((1.0, ANGLE.powers),),
    "deg": ((math.pi / 180.0, ANGLE.powers),),
    "°": ((math.pi / 180.0, ANGLE.powers),),
    "oct": ((1.0, (0, 0, 0, 0, 1)),),
    "octave": ((1.0, (0, 0, 0, 0, 1)),),
    "octaves": ((1.0, (0, 0, 0, 0, 1)),),
    "decade": ((math.log2(10.0), (0, 0, 0, 0, 1)),),
    "decades": ((math.log2(10.0), (0, 0, 0, 0, 1)),),
    "j": ((1.0, (2, 1, -2, 0, 0)),),
    "w": ((1.0, (2, 1, -3, 0, 0)),),
    "pa": ((1.0, (-1, 1, -2, 0, 0)),),
    "1": ((1.0, _ALONE),),
}


class QuantityError(StrandspringError):
    """A text is not a number with a unit of the quantity that is asked for."""


@contextmanager
def stated_units(sizes: Mapping[str, float]) -> Iterator[None]:
    """Numbers without a unit in the block are in the unit of this size [SI units], by `QuantityKind.key`."""
    token = _STATED.set(sizes)
    try:
        yield
    finally:
        _STATED.reset(token)


def in_si(value: object, *quantities: QuantityKind) -> float:
    """A text of a number and its unit, or a number whose unit is stated, in SI units.

    Parameters
    ----------
    value : object
    *quantities : QuantityKind   Those that the value may be.

    Raises
    ------
    QuantityError            If it is something else, not finite, or a number whose unit nobody has stated.

    Examples
    --------
    >>> in_si("20 g", MASS), round(in_si("20 g", ACCELERATION), 3), in_si("100 N/mm", STIFFNESS), in_si(3, FREQUENCY)
    (0.02, 196.133, 100000.0, 3.0)
    """
    return measured(value, *quantities)[0]


def measured(value: object, *quantities: QuantityKind) -> tuple[float, QuantityKind]:
    """Like `in_si`, with which of the quantities the value is; a number without unit is the first of them."""
    wanted = _wanted(quantities)
    if isinstance(value, int | float) and not isinstance(value, bool):
        if not is_finite(value):
            raise QuantityError(f"must be {wanted}, got a number that is not finite")
        return float(value) * _stated_size(value, quantities[0]), quantities[0]
    if not isinstance(value, str):
        raise QuantityError(f"must be {wanted}, got {_named(value)}")
    text = unicodedata.normalize("NFKC", value[: 2 * _LONGEST]).replace("\u2212", "-")
    match = _NUMBER.fullmatch(text)
    if len(value) > _LONGEST or match is None or _DECIMAL_COMMA.match(text):
        comma = "; the decimal mark is a point" if _DECIMAL_COMMA.match(text) else ""
        raise QuantityError(f"must be {wanted}, got {quoted(value)}{comma}")
    number, unit = float(match[1]), match[2].strip()
    if not unit:
        raise QuantityError(f"must be {wanted}, got {quoted(value)}; write the unit")
    meanings = _meanings(unit, f"must be {wanted}, got {quoted(value)}")
    for quantity in quantities:
        for factor, powers in meanings:
            if powers == quantity.powers:
                if not math.isfinite(number * factor):
                    raise QuantityError(f"must be {wanted}, got {quoted(value)}, which is not finite")
                return number * factor, quantity
    known = [kind.name for _, powers in meanings for kind in QUANTITIES if kind.powers == powers]
    raise QuantityError(
        f"must be {wanted}, got {quoted(value)}, which is {' or '.join(dict.fromkeys(known)) or 'something else'}"
    )


def unit_in_si(unit: str, quantity: QuantityKind) -> float:
    """SI units per unit, such as of a column.

    Raises
    ------
    QuantityError   If it is not a unit of the quantity.
    """
    if not isinstance(unit, str) or len(unit) > _LONGEST:
        raise QuantityError(f"must be the unit of {quantity.name}, such as '{quantity.example.split(' ', 1)[1]}'")
    return measured(f"1 {unit}", quantity)[0]


def _stated_size(number: float, quantity: QuantityKind) -> float:
    """SI units per unit of a number without one."""
    size = _STATED.get().get(quantity.key)
    if size is not None:
        return size
    if number == 0.0 or quantity is FREQUENCY or quantity is _NUMBER_ALONE:
        return 1.0
    usual = dict.fromkeys((quantity.example.split(" ", 1)[1], quantity.unit, *_OTHER_READINGS.get(quantity.key, ())))
    readings = " or ".join(f"'{number:.6g} {unit}'" for unit in list(usual)[:2])
    once = f", or state the unit once, as in units = {{ {quantity.key} = '{next(iter(usual))}' }}"
    raise QuantityError(f"{number:.6g} has no unit; write {readings}{once if quantity.key else ''}")


def _wanted(quantities: tuple[QuantityKind, ...]) -> str:
    return " or ".join(f"{kind.name} such as '{kind.example}'" for kind in quantities)


def _named(value: object) -> str:
    """What TOML calls a value."""
    return {bool: "true or false", list: "a list", tuple: "a list", dict: "a table", type(None): "nothing"}.get(
        type(value), "something else"
    )


def _meanings(unit: str, refusal: str) -> list[tuple[float, Powers]]:
    """What a unit may mean: each its size in SI units and its powers."""
    factors = _UnitReader(unit, refusal).factors()
    if len(factors) > _MOST_FACTORS:
        raise QuantityError(f"{refusal}, with more than {_MOST_FACTORS} units")
    sizes: dict[Powers, float] = {}
    for choice in product(*(_meanings_of_name(name, refusal) for name, _ in factors)):
        size, powers = 1.0, _ALONE
        for (factor, powers_of_unit), (_, power) in zip(choice, factors, strict=True):
            size *= factor**power
            powers = _sum(powers, powers_of_unit, power)
        sizes.setdefault(powers, size)
    return [(size, powers) for powers, size in sizes.items()]


def _sum(powers: Powers, added: Powers, times: int) -> Powers:
    length, mass, time, angle, octaves = (total + times * power for total, power in zip(powers, added, strict=True))
    return length, mass, time, angle, octaves


class _UnitReader:
    """A unit as its names and their powers, by recursive descent."""

    def __init__(self, text: str, refusal: str) -> None:
        self.refusal = refusal
        self.tokens = _TOKEN.findall(text.replace("·", "*").replace("⋅", "*"))[::-1]

    def factors(self) -> list[tuple[str, int]]:
        """All of them."""
        units = self._quotient()
        if self.tokens:
            raise self._unclear()
        return units

    def _quotient(self) -> list[tuple[str, int]]:
        units = self._power()
        while self._next() not in ("", "/", ")"):
            self._skip("*")
            units += self._power()
        if self._skip("/"):
            units += [(name, -power) for name, power in self._power()]
            if self._next() not in ("", ")"):
                raise self._unclear("; put what stands below the division into parentheses, as in N/(m s)")
        return units

    def _power(self) -> list[tuple[str, int]]:
        if self._skip("("):
            base = self._quotient()
            if not self._skip(")"):
                raise self._unclear()
        else:
            name = self._next()
            if not (name == "1" or name[:1] not in _OPERATORS):
                raise self._unclear()
            base = [(self.tokens.pop(), 1)]
        raised = self._skip("^") or self._skip("**")
        if not re.fullmatch(r"[+-]?\d", self._next()):
            if raised:
                raise self._unclear()
            return base
        exponent = int(self.tokens.pop())
        powers = [(name, power * exponent) for name, power in base]
        if any(not 1 <= abs(power) <= _LARGEST_POWER for _, power in powers):
            raise self._unclear()
        return powers

    def _next(self) -> str:
        """The next token; "" at the end."""
        return self.tokens[-1] if self.tokens else ""

    def _skip(self, expected: str) -> bool:
        if self._next() != expected:
            return False
        self.tokens.pop()
        return True

    def _unclear(self, advice: str = ", whose unit is not one") -> QuantityError:
        return QuantityError(f"{self.refusal}{advice}")


def _meanings_of_name(name: str, refusal: str) -> tuple[tuple[float, Powers], ...]:
    meanings: list[tuple[float, Powers]] = [_EXACT[name]] if name in _EXACT else [*_ANY_CASE.get(name.casefold(), ())]
    kind = kind_of_unit(name)
    if kind is not None and kind != "other":
        try:
            meanings.append((unit_factor(name, kind), _OF_RECORDS[kind]))
        except RecordError as problem:  # it could mean two things
            said = "unit {unit} of the {quantity} could mean {meanings}; write it exactly".format_map(problem.fields)
            raise QuantityError(f"{refusal}; {said}") from None
    if not meanings:
        raise QuantityError(f"{refusal}, where {quoted(name)} is not a known unit")
    return tuple(meanings)
