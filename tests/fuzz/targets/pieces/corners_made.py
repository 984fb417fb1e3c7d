"""Parameters of springs at the corners of the box that `core/parameters.py` allows, each seed the same.

Every number is at an end of its limits, or anywhere between: range, offset, hysteresis, coefficients of FE and FA at
most over the range, FA down to its least, knots as close as they may be. Some sets are refused, for a limit also
depends on the others.
"""

from __future__ import annotations

import math
import random
from typing import Any

from strandspring.core.parameters import (
    FORCE_RANGE,
    KNOTS,
    LARGEST_AMPLIFIER,
    LARGEST_DISPLACEMENT,
    LEAST_SPACING,
    MAXIMUM_AMPLIFIER_DEGREE,
    MAXIMUM_DEGREE,
    N_RANGE,
    SATURATION_RANGE,
    SIGMA_RANGE,
    WIDTH_RANGE,
)

_INSIDE = 1.0 - 1e-12  # what is rounded stays within
_RESOLVED = 1e-4  # [m], of a range as far away as may be
# Of errors and figures that a model file states, which are no parameters.
_STATED = (0.0, 5e-324, 1e-300, 1e-160, 1e-30, 1.0, 1e30, 1e160, 1e300, 1.7976931348623157e308)


def corner(dice: random.Random) -> dict[str, Any]:
    """The parameters of a spring by their names."""
    width = _end(dice, WIDTH_RANGE)
    low = dice.choice((0.0, 0.0, -0.5 * width, -dice.random() * width))
    if width > _RESOLVED and dice.random() < 0.4:
        low = dice.choice((LARGEST_DISPLACEMENT - width, -LARGEST_DISPLACEMENT))
    high = low + width
    offset = dice.choice((low, high, 0.5 * (low + high), min(max(dice.uniform(low, high), low), high)))
    width, reach = high - low, max(high - offset, offset - low)
    values: dict[str, Any] = {
        "kappa_omega": _end(dice, FORCE_RANGE),
        "rho": _within(_end(dice, SATURATION_RANGE), SATURATION_RANGE) / width,
        "sigma": _end(dice, SIGMA_RANGE),
        "n": _end(dice, N_RANGE),
        "displacement_offset": offset,
        "displacement_min": low,
        "displacement_max": high,
        "kA": _amplifier(dice, reach, offset == low),
    }
    if dice.random() < 0.3:
        return values | _table(dice, low, high)
    count = dice.choice((1, 2, 3, MAXIMUM_DEGREE + 1, dice.randint(1, MAXIMUM_DEGREE + 1)))
    return values | {"kE": [_size(dice) * FORCE_RANGE[1] / reach**k * _INSIDE for k in range(count)]}


def stated(dice: random.Random, content: Any) -> Any:
    """The same uncertainty or figures of a fit with a few numbers of absurd size."""
    if isinstance(content, dict):
        return {key: stated(dice, value) for key, value in content.items()}
    if isinstance(content, list):
        return [stated(dice, value) for value in content]
    if isinstance(content, float) and dice.random() < 0.06:
        return dice.choice(_STATED)
    return content


def _end(dice: random.Random, limits: tuple[float, float]) -> float:
    """An end of limits, or a number between them of any size."""
    low, high = limits
    return dice.choice((low, high, low, high, low * (high / low) ** dice.random()))


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0] / _INSIDE), limits[1] * _INSIDE)


def _size(dice: random.Random) -> float:
    """A share of a limit, of either sign."""
    return dice.choice((-1.0, 1.0)) * dice.choice((0.0, 1.0, 1.0, 10.0 ** dice.uniform(-30.0, 0.0), 5e-324))


def _amplifier(dice: random.Random, reach: float, is_one_sided: bool) -> list[float]:
    """kA of an FA that is positive, or nearly zero at an end of the range."""
    degree = dice.choice((0, 1, 2, MAXIMUM_AMPLIFIER_DEGREE))
    match dice.choice(("small", "large", "touching")):
        case "small":
            shares = [dice.uniform(-1.0, 1.0) / max(degree, 1) for _ in range(degree)]
        case "large":
            shares = [LARGEST_AMPLIFIER * _INSIDE if k % 2 == 0 or is_one_sided else 0.0 for k in range(1, degree + 1)]
        case _:
            root = dice.choice((1.0 - 1e-12, 1.0 - 1e-11, 1.0 - 1e-6))
            shares = [math.comb(degree, k) * (-root) ** k for k in range(1, degree + 1)]
    return [1.0, *(share / reach**k for k, share in enumerate(shares, start=1))]


def _table(dice: random.Random, low: float, high: float) -> dict[str, Any]:
    """Knots that are even, random, or all but the last as close to the first as they may be, and forces."""
    count = dice.choice((KNOTS[0], KNOTS[1], dice.randint(*KNOTS)))
    match dice.choice(("even", "random", "close")):
        case "even":
            shares = [k / (count - 1) for k in range(count)]
        case "random":
            shares = sorted(dice.random() for _ in range(count))
        case _:
            shares = [k * LEAST_SPACING * (1.0 + 1e-6) for k in range(count)]
    knots = [low, *(low + share * (high - low) for share in shares[1:-1]), high]
    return {"FE_knots": knots, "FE_forces": [_size(dice) * FORCE_RANGE[1] for _ in knots]}
