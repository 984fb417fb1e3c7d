"""Numbers and units as a report prints them: a few digits, and a unit in which they are neither tiny nor huge."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ..ground.gravity import STANDARD_GRAVITY

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_EXPONENT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]\d{2,3})\b")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:[µmk]?[NJm]|k?N/m{1,2}|mm/s|m/s|k?g|t|s|Hz|%)(?![\w/]))")
_MINUS = "\N{MINUS SIGN}"


@dataclass(frozen=True)
class DisplayUnit:
    """A unit for display.

    Parameters
    ----------
    name : str       As printed; empty for a pure number.
    factor : float   From SI to this unit.
    """

    name: str
    factor: float = 1.0

    def text(self, value: float, digits: int = 4) -> str:
        """A value [SI] with this unit."""
        return f"{number(value * self.factor, digits)} {self.name}".rstrip()


# From small to large, each with the value [SI] from which the next one is taken: rigs speak of mm and N.
_UNITS = {
    "force": ((DisplayUnit("mN", 1e3), 0.1), (DisplayUnit("N"), 1e4), (DisplayUnit("kN", 1e-3), math.inf)),
    "length": ((DisplayUnit("µm", 1e6), 1e-4), (DisplayUnit("mm", 1e3), 30.0), (DisplayUnit("m"), math.inf)),
    "velocity": ((DisplayUnit("mm/s", 1e3), 10.0), (DisplayUnit("m/s"), math.inf)),
    "energy": (
        (DisplayUnit("µJ", 1e6), 1e-3),
        (DisplayUnit("mJ", 1e3), 1.0),
        (DisplayUnit("J"), 1e4),
        (DisplayUnit("kJ", 1e-3), math.inf),
    ),
    "stiffness": ((DisplayUnit("N/m"), 1e3), (DisplayUnit("N/mm", 1e-3), 1e7), (DisplayUnit("kN/mm", 1e-6), math.inf)),
    "mass": ((DisplayUnit("g", 1e3), 1.0), (DisplayUnit("kg"), 1e4), (DisplayUnit("t", 1e-3), math.inf)),
}
# Beyond these a power of ten goes to the unit, so that ticks stay short.
_ORDINARY = (1e-3, 1e6)
NUMBER, PERCENT = DisplayUnit(""), DisplayUnit("%", 100.0)
MM, N, S, HZ = DisplayUnit("mm", 1e3), DisplayUnit("N"), DisplayUnit("s"), DisplayUnit("Hz")
G = DisplayUnit("g", 1.0 / STANDARD_GRAVITY)


def unit_of(kind: str, largest: float) -> DisplayUnit:
    """The unit in which values of this kind up to `largest` [SI] read best.

    Examples
    --------
    >>> unit_of("energy", 0.0042)
    DisplayUnit(name='mJ', factor=1000.0)
    >>> unit_of("force", 2.5e-14).name
    '10⁻¹² mN'
    """
    unit = next(unit for unit, end in _UNITS[kind] if not abs(largest) >= end)
    shown = abs(largest) * unit.factor
    if not (0.0 < shown < _ORDINARY[0] or _ORDINARY[1] <= shown < math.inf):
        return unit
    power = 3 * math.floor(math.log10(shown) / 3.0)
    return DisplayUnit(f"10{superscript(power)} {unit.name}", unit.factor * 10.0**-power)


def superscript(exponent: int) -> str:
    """An exponent in raised digits."""
    return str(exponent).translate(_SUPERSCRIPT)


def number(value: float, digits: int = 4, *, sign: bool = False, zeros: bool = False) -> str:
    """A number with so many significant digits, zeros at the end kept if wanted, in the notation of print.

    Examples
    --------
    >>> number(0.000123456), number(-1234.56), number(2.5e9, 2), number(float("nan"))
    ('0.0001235', '−1235', '2.5×10⁹', '–')
    """
    if not math.isfinite(value):
        return "–"
    text = f"{value:{'+' if sign else ''}{'#' if zeros else ''}.{digits}g}".removesuffix(".")
    magnitude = abs(float(text))
    if "e" in text and 1e-4 <= magnitude < 10 ** max(digits, 6):
        text = f"{float(text):{'+' if sign else ''}.0f}"
    elif "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa.removesuffix('.')}×10{superscript(int(exponent))}"
    return text.replace("-", _MINUS)


def percent(share: float, digits: int = 2, *, sign: bool = False) -> str:
    """A share in percent."""
    return f"{number(100.0 * share, digits, sign=sign)} %"


def by_error(value: float, error: float | None) -> str:
    """A number down to the second digit of its standard error; six digits if that is unknown or zero.

    Examples
    --------
    >>> by_error(0.0643631, 0.00185)
    '0.0644'
    """
    if not error or not value or not math.isfinite(error):
        return number(value, 6)
    figures = math.floor(math.log10(abs(value))) - math.floor(math.log10(error)) + 2
    return number(value, min(max(figures, 2), 9), zeros=True)


def with_reach(value: float, reach: float | None) -> str:
    """A number with what it may be off; without that if it is unknown.

    Examples
    --------
    >>> with_reach(29.7812, 0.107).replace("\\xa0", " "), with_reach(29.7812, None)
    ('29.78 ± 0.11', '29.78')
    """
    if reach is None or not (math.isfinite(value) and 0.0 < reach < math.inf):
        return number(value)
    decimals = 1 - math.floor(math.log10(reach))
    whole = math.floor(math.log10(max(abs(value), reach))) if value else 0
    if decimals < 0 or decimals > 6 or whole > 5:
        return f"{number(value)} ±\N{NO-BREAK SPACE}{number(reach, 2)}"
    return f"{value:.{decimals}f} ±\N{NO-BREAK SPACE}{reach:.{decimals}f}".replace("-", _MINUS)


def prose(sentence: str) -> str:
    """A sentence made for a terminal, in the notation of print.

    Examples
    --------
    >>> prose("from 2.93e-07 to 1.1e+03 J, +- 4 %")
    'from 2.93×10⁻⁷ to 1.1×10³ J, ± 4 %'
    """
    text = _EXPONENT.sub(lambda match: f"{match[1]}×10{superscript(int(match[2]))}", sentence)
    return text.replace("+-", "±")


def bound(text: str) -> str:
    """A text in which no line ends between a number and its unit.

    Examples
    --------
    >>> bound("5.19 mN at 3 Hz").split(" ")
    ['5.19\\xa0mN', 'at', '3\\xa0Hz']
    """
    return _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", text)


def span(low: float, high: float, unit: DisplayUnit) -> str:
    """A range in a unit.

    Examples
    --------
    >>> span(-0.278, -0.2464, DisplayUnit("mm", 1e3))
    '−278 to −246.4 mm'
    """
    return f"{number(low * unit.factor)} to {unit.text(high)}"
