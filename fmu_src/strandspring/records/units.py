"""Units as test rigs spell them, as factors to m, N and s.

Most spellings are accepted in any case ("MM", "Sec"). Where the case decides ("mN" and "MN", "nm" and "Nm") it must be
right, and what could mean two things is refused: "mn" may be milli- or meganewton.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ..errors import RecordError
from ..ground.gravity import STANDARD_GRAVITY
from ..ground.quoting import quoted

Quantity = Literal["displacement", "force", "time"]

_MAX_LENGTH = 24  # longer than any unit; normalizing hostile text takes time


def words(text: str) -> frozenset[str]:
    """The words of a text."""
    return frozenset(text.split())


def _by_spelling(factors: Mapping[float, str]) -> dict[str, float]:
    """Factor of each spelling, from the spellings of each factor."""
    return {spelling: factor for factor, spellings in factors.items() for spelling in spellings.split()}


@dataclass(frozen=True)
class _Kind:
    """Units of one quantity.

    Attributes
    ----------
    noun, examples : str   For messages.
    any_case : dict        SI units per unit, by spelling in lower case.
    exact : dict           The same for spellings whose case matters.
    ambiguous : dict       What a refused spelling could mean.
    """

    noun: str
    examples: str
    any_case: Mapping[str, float]
    exact: Mapping[str, float]
    ambiguous: Mapping[str, str]


_KINDS: Mapping[Quantity, _Kind] = {
    "displacement": _Kind(
        "length",
        "mm, cm, m, um, in, ft",
        _by_spelling(
            {
                1.0: "m meter meters metre metres 米",
                1e-1: "dm decimeter decimeters decimetre decimetres",
                1e-2: "cm centimeter centimeters centimetre centimetres 厘米",
                1e-3: "mm millimeter millimeters millimetre millimetres 毫米",
                1e-6: "um μm micrometer micrometers micrometre micrometres micron microns 微米",
                1e-9: "nanometer nanometers nanometre nanometres",
                1e3: "km kilometer kilometers kilometre kilometres",
                0.0254: "in in. inch inches \" ''",
                2.54e-5: "mil mils thou",
                0.3048: "ft ft. foot feet",
                0.9144: "yd yard yards",
            }
        ),
        {"nm": 1e-9},
        {"Mm": "mm (millimetre) or megameter"},
    ),
    "force": _Kind(
        "force",
        "N, kN, mN, MN, lbf, kip, kgf",
        _by_spelling(
            {
                1.0: "n newton newtons 牛 牛顿",
                10.0: "dan decanewton decanewtons",
                1e3: "kn kilonewton kilonewtons 千牛",
                1e6: "meganewton meganewtons",
                1e-3: "millinewton millinewtons",
                1e-6: "un μn micronewton micronewtons",
                1e-5: "dyn dyne dynes",
                4.4482216152605: "lb lbs lb. lbf lbsf pound pounds",
                4448.2216152605: "kip kips klbf",
                0.27801385095378125: "ozf",
                STANDARD_GRAVITY: "kgf kp",
                1e-3 * STANDARD_GRAVITY: "gf",
            }
        ),
        {"mN": 1e-3, "MN": 1e6},
        dict.fromkeys(("mn", "Mn"), "mN (millinewton) or MN (meganewton)"),
    ),
    "time": _Kind(
        "time",
        "s, ms, min",
        _by_spelling(
            {
                1.0: "s sec sec. secs second seconds 秒",
                1e-3: "ms msec msecs millisecond milliseconds 毫秒",
                1e-6: "usec microsecond microseconds 微秒",
                1e-9: "nanosecond nanoseconds",
                60.0: "min min. mins minute minutes 分钟",
                3600.0: "hr hrs hour hours 小时",
            }
        ),
        {"us": 1e-6, "μs": 1e-6, "ns": 1e-9, "h": 3600.0},
        dict.fromkeys(("Ms", "MS", "mS"), "ms (millisecond) or megasecond"),
    ),
}
# What else rigs record.
_OTHER = words(
    """- % ° °c °f c k v mv kv a ma hz khz rpm deg rad degc degf kelvin celsius volt volts kg g mg t gram kilogram ton
    tonne pa hpa kpa mpa gpa psi ksi bar mbar atm n/mm n/m n/mm^2 n/mm2 mm/s mm/min m/s m/s^2 m/s2 in/s in/min 1/s n*m
    nm n·m j mj w kw ohm ε strain 1 cycle cycles count counts"""
)


def unit_factor(text: str, quantity: Quantity) -> float:
    """SI units per unit `text` of a displacement [m], force [N] or time [s].

    Raises
    ------
    RecordError   If the unit is unknown, ambiguous or of another kind.
    """
    if not isinstance(text, str):
        raise RecordError(f"unit of the {quantity} must be text, such as 'mm', got {text!r:.40}.")
    kind = _KINDS[quantity]
    name = _cleaned(text)
    if name in kind.ambiguous:
        sentence = "unit {unit} of the {quantity} could mean {meanings}; write it exactly."
        raise RecordError(sentence, unit=quoted(text), quantity=quantity, meanings=kind.ambiguous[name])
    factor = kind.exact.get(name, kind.any_case.get(name.casefold()))
    if factor is None:
        stated = kind_of_unit(text)
        reason = "is not known"
        if stated is not None:
            reason = f"is not a unit of {kind.noun}" if stated == "other" else f"is a unit of {_KINDS[stated].noun}"
        raise RecordError(
            f"unit {quoted(text)} of the {quantity} {reason}; give a unit of {kind.noun} ({kind.examples})."
        )
    return factor


def kind_of_unit(text: str) -> Quantity | Literal["other"] | None:
    """Quantity that a unit measures, "other" for a unit of something else, None if it is not a unit."""
    name = _cleaned(text)
    for quantity, kind in _KINDS.items():
        if name in kind.ambiguous or name in kind.exact or name.casefold() in kind.any_case:
            return quantity
    return "other" if name.casefold() in _OTHER else None


def _cleaned(text: str) -> str:
    # NFKC makes one character of the micro sign and the Greek letter mu.
    return unicodedata.normalize("NFKC", text[: 2 * _MAX_LENGTH]).strip().strip("[]()").strip()
