"""Figures and parameters in words and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from ...core.branch_variables import OF_BRANCH
from ...core.parameters import SIGMA_RANGE, SpringParameters
from ...ground.quoting import printable
from ...identification.figures import WITH_RIG
from ...model.joint import HYSTERETIC_PARAMETERS, ForceInterval
from ...model.stated_figures import Figures, differ, in_words

if TYPE_CHECKING:
    from ...identification.figures import RecordFit
    from ...loops.campaign import Overlap, RateIndependence

_DIGITS = 6  # of a value at most
_ROUNDING = 1e-9  # of the range
_AT_BOUND = 1.001  # an end of an interval that is less than this times a bound is the bound itself


def counted(count: int, noun: str) -> str:
    """A number with its noun.

    Examples
    --------
    >>> counted(1, "cycle"), counted(2, "cycle")
    ('1 cycle', '2 cycles')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def verdict_json(finding: RateIndependence | Overlap | None) -> dict[str, Any] | None:
    """A verdict on a test campaign as JSON."""
    if finding is None:
        return None
    return {**asdict(finding), "verdict": finding.verdict.name.lower(), "sentence": finding.sentence}


def fit_lines(fits: tuple[RecordFit, ...], fitted: tuple[RecordFit, ...] = ()) -> list[str]:
    """One line for each record with the figures of the spring alone; a second one where those of the fit differ."""
    lines = []
    for fit, other in zip(fits, fitted or fits, strict=True):
        lines.append(f"  {fit.path}: {in_words(fit.figures)} over {fit.samples} samples ({fit.compared})")
        if differ(fit.figures, other.figures):
            lines.append(f"    {WITH_RIG}: {in_words(other.figures, False)}")
    return lines


def brief_fit_lines(overall: Figures, fits: tuple[RecordFit, ...], fitted: tuple[RecordFit, ...] = ()) -> list[str]:
    """The same without the samples and folders, and the figures of all records if there are several."""
    names = [PurePath(fit.path).name for fit in fits]
    lines = []
    for name, fit, other in zip(names, fits, fitted or fits, strict=True):
        lines.append(f"{name if names.count(name) == 1 else fit.path}: {in_words(fit.figures)}")
        if differ(fit.figures, other.figures):
            lines.append(f"  {WITH_RIG}: {in_words(other.figures, False)}")
    return [*lines, f"All records: {in_words(overall)}"] if len(fits) > 1 else lines


def brief_parameter_lines(p: SpringParameters, uncertainty: dict[str, Any]) -> list[str]:
    """The hysteretic parameters with their standard errors, and the degrees of the others with their range."""
    elastic = "a spline" if p.FE_knots else f"degree {len(p.kE) - 1}"
    low, high = 1e3 * p.displacement_min, 1e3 * p.displacement_max
    shape = f"  FE {elastic}, FA degree {len(p.kA) - 1}, valid from {low:.4g} to {high:.4g} mm"
    return [*hysteretic_lines(p, uncertainty), shape, *_added_lines(p, uncertainty)]


def hysteretic_lines(p: SpringParameters, uncertainty: dict[str, Any]) -> list[str]:
    """The hysteretic parameters, rounded by their standard errors where these are known."""
    return [
        f"  {column.key:<12} {_with_error(column.key, getattr(p, column.key), uncertainty, column.shown)}".rstrip()
        for column in HYSTERETIC_PARAMETERS
    ]


def _added_lines(p: SpringParameters, uncertainty: dict[str, Any]) -> list[str]:
    """The second mechanism and the Maxwell branches, if there are any, rounded by their standard errors."""
    known, lines = uncertainty.get("further") or {}, []

    def shown(name: str, value: float) -> str:
        return with_error(value, known.get(name, {}).get("standard_error"))

    if p.second is not None:
        hysteretic = ", ".join(
            f"{column.key} {shown(f'second.{column.key}', getattr(p.second, column.key))} {column.shown}".rstrip()
            for column in HYSTERETIC_PARAMETERS
        )
        coefficients = ", ".join(shown(f"second.kA[{k}]", value) for k, value in enumerate(p.second.kA))
        lines.append(f"  second mechanism: {hysteretic}, FA degree {len(p.second.kA) - 1}, kA: {coefficients}  1/m^i")
    for j, branch in enumerate(p.branches):
        stiffness, time = (shown(f"branches[{j}].{name}", getattr(branch, name)) for name in OF_BRANCH)
        lines.append(f"  Maxwell branch: stiffness {stiffness} N/m, time constant {time} s")
    return lines


def parameter_lines(p: SpringParameters, uncertainty: dict[str, Any]) -> list[str]:
    """The parameters, with their standard errors where known, from a model file's `uncertainty`."""
    lines = hysteretic_lines(p, uncertainty)
    if p.FE_knots:
        low, high = min(p.FE_forces), max(p.FE_forces)
        lines.append(f"  FE a spline through {len(p.FE_knots)} knots, {low:.6g} to {high:.6g} N, see the model file")
    else:
        lines.append(f"  FE degree {len(p.kE) - 1}, kE: {', '.join(f'{c:.6g}' for c in p.kE)}  N/m^i")
    lines.append(f"  FA degree {len(p.kA) - 1}, kA: {', '.join(f'{c:.6g}' for c in p.kA)}  1/m^i")
    lines += _added_lines(p, uncertainty)
    low, high, middle = (1e3 * v for v in (p.displacement_min, p.displacement_max, p.displacement_offset))
    middle = 0.0 if abs(middle) < _ROUNDING * (high - low) else middle
    lines.append(
        f"  valid from {low:.6g} to {high:.6g} mm, {'FA' if p.FE_knots else 'polynomials'} about {middle:.6g} mm"
    )
    interval = ForceInterval.from_uncertainty(uncertainty)
    if interval is not None:
        lines.append(f"  {interval.sentence}")
    lines += [f"  {printable(sentence)}" for sentence in uncertainty.get("indistinct") or ()]
    return [line.rstrip() for line in lines]


def bounds_95(name: str, uncertainty: Mapping[str, Any]) -> tuple[float | None, float | None] | None:
    """Ends of a parameter's 95 % interval, None where it is open or ends where no spring has less; None if unknown."""
    ends = (uncertainty.get("interval_95") or {}).get(name)
    if ends is None:
        return None
    low, high = ends
    is_least = name == "sigma" and low is not None and low <= SIGMA_RANGE[0] * _AT_BOUND
    return None if is_least else low, high


def with_error(value: float, error: float | None) -> str:
    """A value rounded to the second digit of its standard error, of at most six digits.

    Examples
    --------
    >>> with_error(1152.71, 107.0), with_error(0.99737, 0.0067), with_error(2.0, None)
    ('1150 +- 110', '0.9974 +- 0.0067', '2')
    """
    if error is None or not error > 0.0:
        return f"{value:.6g}"
    decimals = 1 - int(f"{error:.1e}".partition("e")[2])
    shown = f"{round(value, decimals):.{max(decimals, 0)}f}"
    if decimals < -_DIGITS or sum(map(str.isdigit, shown.lstrip("-0."))) > _DIGITS:
        return f"{value:.{_DIGITS}g} +- {error:.2g}"
    return f"{shown} +- {round(error, decimals):.{max(decimals, 0)}f}"


def _with_error(name: str, value: float, uncertainty: dict[str, Any], unit: str) -> str:
    """A parameter with its error, or with the end of its interval where the records bound one side or none."""
    low, high = bounds_95(name, uncertainty) or (0.0, 0.0)
    if low is not None and high is not None:
        return f"{with_error(value, uncertainty.get(name))} {unit}"
    if low is None and high is None:
        return f"{value:.4g} {unit}".rstrip() + ", not bounded by these records"
    return f"{value:.4g} {f'> {low:.2g}' if high is None else f'< {high:.2g}'} {unit}".rstrip() + " (95 %)"
