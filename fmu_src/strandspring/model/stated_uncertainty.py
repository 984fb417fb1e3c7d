"""What the field `uncertainty` of a model file must be like where it is read; all else in it is free."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations
from typing import Any

from ..core.parameters import SpringParameters
from ..errors import ModelError
from ..ground.strict_json import is_finite, shown
from .joint import HYSTERETIC_UNITS, JointCovariance

LEVEL = 0.95  # of the prediction interval
INTERVAL_NUMBERS = ("factor", "additive", "relative", "error", "half_width")
PAIRS = tuple(",".join(pair) for pair in combinations(HYSTERETIC_UNITS, 2))  # of a correlation
_ONE = 1.0 + 1e-9  # earlier versions wrote correlations that rounding had made larger than 1
_QUANTILES = 3  # of a posterior at least: its ends and its median

Condition = tuple[str, Callable[[Any], bool]]


def check_uncertainty(spring: SpringParameters, uncertainty: Mapping[str, Any]) -> None:
    """Check the fields that this program reads, as far as they are given.

    Parameters
    ----------
    spring : SpringParameters
    uncertainty : mapping

    Raises
    ------
    ModelError   If one is not what it must be; names it.
    """
    for name in HYSTERETIC_UNITS:
        _check(uncertainty, name, _ERROR)
    for name in (spring.elastic_name, "kA"):
        count = len(getattr(spring, name))
        _check(uncertainty, name, (f"must be a list of {count} finite numbers >= 0 or null", _all(_is_error, count)))
    _check_members(uncertainty, "correlation", dict.fromkeys(PAIRS, _CORRELATION), is_whole=False)
    _check(uncertainty, "indistinct", ("must be a list of strings", _all(lambda value: isinstance(value, str))))
    _check_members(uncertainty, "interval_95", dict.fromkeys(HYSTERETIC_UNITS, _INTERVAL), is_whole=False)
    sizes = dict.fromkeys((*HYSTERETIC_UNITS, "repetitions", "seed"), _SIZE)
    _check_members(uncertainty, "bootstrap", sizes)
    _check_members(
        uncertainty,
        "posterior",
        {
            **dict.fromkeys(HYSTERETIC_UNITS, _POSTERIOR),
            "steps": _SIZE,
            "seed": _SIZE,
            "long_enough": ("must be true or false", lambda value: isinstance(value, bool)),
        },
    )
    _check_members(
        uncertainty,
        "prediction_interval",
        {
            "level": (f"must be {LEVEL}", lambda value: value == LEVEL),
            **dict.fromkeys(INTERVAL_NUMBERS, _SIZE),
            "held_out_coverage": _ERROR,
            "held_out_cycles": _SIZE,
        },
    )
    JointCovariance.of(spring, uncertainty)


def _is_size(value: Any) -> bool:
    return is_finite(value) and value >= 0.0


def _is_error(value: Any) -> bool:
    return value is None or _is_size(value)


def _is_interval(value: Any) -> bool:
    if not _all(lambda end: end is None or is_finite(end), 2)(value):
        return False
    low, high = value
    return low is None or high is None or bool(low <= high)


def _all(holds: Callable[[Any], bool], count: int | None = None) -> Callable[[Any], bool]:
    """Whether a value is a list of so many that the condition holds for."""
    return lambda value: isinstance(value, list) and count in (None, len(value)) and all(map(holds, value))


_OBJECT: Condition = "must be an object", lambda value: isinstance(value, Mapping)
_SIZE: Condition = "must be a finite number >= 0", _is_size
_ERROR: Condition = "must be a finite number >= 0 or null", _is_error
_CORRELATION: Condition = (
    "must be a number within [-1, 1] or null",
    lambda value: value is None or (is_finite(value) and abs(value) <= _ONE),
)
_INTERVAL: Condition = "must be a list of a lower and an upper end, finite numbers or null", _is_interval
_POSTERIOR: Condition = (
    f"must be a list of at least {_QUANTILES} finite numbers",
    lambda value: _all(is_finite)(value) and len(value) >= _QUANTILES,
)


def _check_members(
    uncertainty: Mapping[str, Any], name: str, conditions: Mapping[str, Condition], is_whole: bool = True
) -> None:
    """Check an object, if it is given; with `is_whole` it has to have all members."""
    given = uncertainty.get(name)
    if given is None:
        return
    _check(uncertainty, name, _OBJECT)
    for member, condition in conditions.items():
        if is_whole or member in given:
            _check({f"{name}.{member}": given.get(member)}, f"{name}.{member}", condition, may_be_null=False)


def _check(content: Mapping[str, Any], name: str, condition: Condition, may_be_null: bool = True) -> None:
    value = content.get(name)
    text, holds = condition
    if not (holds(value) or (value is None and may_be_null)):
        raise ModelError(
            f'field "uncertainty.{name}" {text}, got {shown(value)}; identify the spring again, or remove the field '
            f'"uncertainty.{name.split(".")[0]}".'
        )
