"""What Python users give as numbers, made plain floats and whole numbers.

Text, which would be taken apart into its characters, sets, which have no order, and truth values are refused: none of
them is ever meant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Set
from typing import Any

# NumPy, which takes long to import, is not needed to know its values: they have `ndim`, `dtype` and `item`.
_NO_NUMBERS = (str, bytes, bytearray, bool, Mapping, Set)


def number(name: str, value: Any, unit: str = "") -> float:
    """One number, which may be that of NumPy; raises TypeError for anything else, and leaves bounds to others.

    Examples
    --------
    >>> number("mass", [5.0], "kg")
    Traceback (most recent call last):
    TypeError: `mass` must be a number [kg], got [5.0].
    """
    try:
        if isinstance(value, _NO_NUMBERS) or _is_truth(value) or getattr(value, "ndim", 0) != 0:
            raise TypeError
        return float(value)
    except OverflowError:
        return math.inf if value > 0 else -math.inf
    except (TypeError, ValueError):
        raise TypeError(f"`{name}` must be a number{_in(unit)}, got {_shown(value)}.") from None


def numbers(name: str, values: Any, unit: str = "") -> tuple[float, ...]:
    """One number or several in a row, as in a list, an array or a Series; raises TypeError for anything else.

    Examples
    --------
    >>> numbers("amplitudes", [0.01, 0.02]), numbers("mass", 5)
    ((0.01, 0.02), (5.0,))
    >>> numbers("amplitudes", "13", "m")
    Traceback (most recent call last):
    TypeError: `amplitudes` must be numbers [m], got '13'.
    """
    try:
        if isinstance(values, _NO_NUMBERS):
            raise TypeError
        is_one = getattr(values, "ndim", None) == 0
        items = list(values) if hasattr(values, "__iter__") and not is_one else [values]
        return tuple(number(name, value, unit) for value in items)
    except (TypeError, ValueError):
        raise TypeError(f"`{name}` must be numbers{_in(unit)}, got {_shown(values)}.") from None


def limits(name: str, values: Any, unit: str = "") -> tuple[float, float]:
    """Two numbers; raises TypeError for anything else."""
    try:
        low, high = numbers(name, values, unit)
    except (TypeError, ValueError):
        raise TypeError(f"`{name}` must be two numbers, low and high{_in(unit)}, got {_shown(values)}.") from None
    return low, high


def whole(name: str, value: Any) -> int:
    """A whole number, which may be that of NumPy; raises TypeError for anything else.

    Examples
    --------
    >>> whole("draws", 2.5)
    Traceback (most recent call last):
    TypeError: `draws` must be a whole number, got 2.5.
    """
    number_given = value.item() if getattr(value, "ndim", None) == 0 else value
    if isinstance(number_given, bool) or not isinstance(number_given, int):
        raise TypeError(f"`{name}` must be a whole number, got {_shown(value)}.")
    return number_given


def flag(name: str, value: Any) -> bool:
    """A truth value, which may be that of NumPy; raises TypeError for anything else.

    Examples
    --------
    >>> flag("extrapolate", "no")
    Traceback (most recent call last):
    TypeError: `extrapolate` must be True or False, got 'no'.
    """
    if not (isinstance(value, bool) or _is_truth(value)):
        raise TypeError(f"`{name}` must be True or False, got {_shown(value)}.")
    return bool(value)


def workers_of(value: Any) -> int | None:
    """The number of workers, None for one per core; raises TypeError unless it is whole, ValueError below 1."""
    count = None if value is None else whole("workers", value)
    if count is not None and count < 1:
        raise ValueError(f"`workers` must be at least 1, got {value!r}.")
    return count


def is_finite_number(value: object) -> bool:
    """Whether a value is a real number that a double can hold."""
    try:
        return math.isfinite(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return False


def _is_truth(value: Any) -> bool:
    """Whether a value is a truth value of NumPy."""
    return getattr(value, "ndim", None) == 0 and str(value.dtype) == "bool"


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _shown(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
