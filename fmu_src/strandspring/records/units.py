"""Units as test rigs spell them, turned into factors to m, N and s.

Pint knows the units; this file knows the spellings that Pint does not, and which spellings could mean two
things: "mn" may be milli- or meganewton and is refused instead of guessed.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

from ..errors import RecordError

if TYPE_CHECKING:
    import pint

Quantity = Literal["displacement", "force", "time"]

# Long enough for every name of a unit; keeps hostile text away from Pint's expression parser.
_MAX_LENGTH = 24
# One word, no operators or digits: nothing that Pint could compute.
_UNIT_TEXT = re.compile(r"[A-Za-zμ_]+")


@dataclass(frozen=True)
class _Kind:
    """What is accepted for one quantity: SI unit, examples for messages, spellings (lower case)."""

    noun: str
    si: str
    examples: str
    spellings: Mapping[str, str]
    ambiguous: Mapping[str, str]


_KINDS: Mapping[Quantity, _Kind] = {
    "displacement": _Kind(
        "length",
        "meter",
        "mm, cm, m, um, in, ft",
        {
            **dict.fromkeys(("m", "meter", "meters", "metre", "metres", "米"), "meter"),
            **dict.fromkeys(("mm", "毫米"), "millimeter"),
            **dict.fromkeys(("cm", "厘米"), "centimeter"),
            **dict.fromkeys(("um", "μm", "微米", "micron", "microns"), "micrometer"),
            **dict.fromkeys(("in", "in.", "inch", "inches", '"', "''"), "inch"),
            **dict.fromkeys(("ft", "ft.", "foot", "feet"), "foot"),
            **dict.fromkeys(("mil", "mils", "thou"), "thou"),  # Pint's own "mil" is an angle
            "km": "kilometer",
        },
        {"Mm": "mm (millimetre) or megameter"},
    ),
    "force": _Kind(
        "force",
        "newton",
        "N, kN, mN, MN, lbf, kip, kgf",
        {
            **dict.fromkeys(("n", "newton", "newtons", "牛", "牛顿"), "newton"),
            **dict.fromkeys(("kn", "千牛"), "kilonewton"),
            "dan": "decanewton",
            **dict.fromkeys(("lb", "lbs", "lb.", "lbf", "lbsf", "pound", "pounds"), "force_pound"),
            **dict.fromkeys(("kip", "kips", "klbf"), "kip"),
            **dict.fromkeys(("kgf", "kp"), "force_kilogram"),
        },
        {"mn": "mN (millinewton) or MN (meganewton)", "Mn": "mN (millinewton) or MN (meganewton)"},
    ),
    "time": _Kind(
        "time",
        "second",
        "s, ms, min",
        {
            **dict.fromkeys(("s", "sec", "sec.", "secs", "second", "seconds", "秒"), "second"),
            **dict.fromkeys(("ms", "msec", "msecs", "毫秒"), "millisecond"),
            **dict.fromkeys(("min", "min.", "mins", "minute", "minutes", "分钟"), "minute"),
        },
        dict.fromkeys(("Ms", "MS", "mS"), "ms (millisecond) or megasecond"),
    ),
}


def length_factor(text: str) -> float:
    """Metres per unit of length `text`, such as "mm", "Inch" or "µm" [m].

    Raises
    ------
    RecordError   If the unit is unknown, ambiguous or no length.
    """
    return unit_factor(text, "displacement")


def force_factor(text: str) -> float:
    """Newtons per unit of force `text`, such as "kN", "lbs" or "kgf" [N].

    Raises
    ------
    RecordError   If the unit is unknown, ambiguous or no force.
    """
    return unit_factor(text, "force")


def time_factor(text: str) -> float:
    """Seconds per unit of time `text`, such as "ms", "sec" or "min" [s].

    Raises
    ------
    RecordError   If the unit is unknown, ambiguous or no time.
    """
    return unit_factor(text, "time")


def unit_factor(text: str, quantity: Quantity) -> float:
    """SI units per unit `text` of a displacement [m], force [N] or time [s].

    Raises
    ------
    RecordError   If the unit is unknown, ambiguous or of another kind.
    """
    kind = _KINDS[quantity]
    name = _cleaned(text)
    if name in kind.ambiguous:
        raise RecordError(f"unit {quoted(text)} of the {quantity} could mean {kind.ambiguous[name]}; write it exactly.")
    unit = _pint_unit(kind.spellings.get(name.casefold(), name))
    if unit is None:
        raise RecordError(
            f"unit {quoted(text)} of the {quantity} is not known; give a unit of {kind.noun} ({kind.examples})."
        )
    if not unit.is_compatible_with(kind.si):
        found = kind_of_unit(text)
        is_what = f"{unit}" if found is None or found == "other" else f"a unit of {_KINDS[found].noun}"
        raise RecordError(
            f"unit {quoted(text)} of the {quantity} is {is_what}; give a unit of {kind.noun} ({kind.examples})."
        )
    return float(_registry().Quantity(1.0, unit).to(kind.si).magnitude)


@lru_cache(maxsize=256)
def kind_of_unit(text: str) -> Quantity | Literal["other"] | None:
    """Quantity that a unit measures, "other" for a unit of something else, None if it is no unit."""
    name = _cleaned(text)
    for quantity, kind in _KINDS.items():
        if name in kind.ambiguous or name.casefold() in kind.spellings:
            return quantity
    unit = _pint_unit(name)
    if unit is None:
        return None
    matches = (quantity for quantity, kind in _KINDS.items() if unit.is_compatible_with(kind.si))
    return next(matches, "other")


def quoted(text: str) -> str:
    """Quote text of a file or of the user for a message: escaped, and cut after 40 characters."""
    return repr(text if len(text) <= 40 else text[:39] + "…")


def _cleaned(text: str) -> str:
    # NFKC makes one character of the micro sign and the Greek letter mu.
    return unicodedata.normalize("NFKC", text[: 2 * _MAX_LENGTH]).strip().strip("[]()").strip()


def _pint_unit(name: str) -> pint.Unit | None:
    if len(name) > _MAX_LENGTH or not _UNIT_TEXT.fullmatch(name):
        return None
    import pint  # slow to import, and not needed to import this package

    try:
        unit = _registry().parse_units(name)
        # A few logarithmic units parse but have no definition; asking for the dimension tells.
        return unit if unit.dimensionality is not None else None
    except (pint.errors.PintError, ValueError):  # ValueError: Pint takes "nan" for a number
        return None


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[float]:
    import pint

    return pint.UnitRegistry()
