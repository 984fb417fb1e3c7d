"""Tables that several results have: how well records are followed, the parameters of a spring, and loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from ...core.parameters import ARRAYS, SIGMA_RANGE, SpringParameters
from ...ground.result_columns import ResultColumn, values
from ...loops.loop import LOOP_FIGURES, Loop
from ...model.joint import HYSTERETIC_PARAMETERS, further_columns
from ...model.stated_figures import Figures, differ, energy_ratio
from .result import Table

if TYPE_CHECKING:
    from ...identification.figures import RecordFit
    from ...loops.campaign import Overlap, RateIndependence
    from ...loops.cycles import MeasuredLoop

_ROUNDING = 1e-9  # of the range
_AT_BOUND = 1.001  # an end of an interval that is less than this times a bound is the bound itself
_FITS = (
    ResultColumn("record", "", "record", "record"),
    ResultColumn("rmse", "N", "rms error", "rmse", "N"),
    ResultColumn("rnl", "1", "RNL", "RNL"),
    ResultColumn("energy", "1", "loop energy over that measured", "energy", "%", 100.0),
    ResultColumn("fitted_rnl", "1", "RNL as fitted", "RNL as fitted"),
    ResultColumn("fitted_energy", "1", "loop energy as fitted over that measured", "energy as fitted", "%", 100.0),
    ResultColumn("samples", "1", "samples compared", "samples", digits=12),
    ResultColumn("compared", "", "what is compared", "compared"),
)
_UNITS = {"FE_knots": "m", "FE_forces": "N", "kE": "N/m^{}", "kA": "1/m^{}"}
_PARAMETERS = (
    ResultColumn("parameter", "", "parameter", "parameter"),
    ResultColumn("unit", "", "unit", "unit"),
    ResultColumn("value", "", "value", "value", digits=5),
    ResultColumn("standard_error", "", "standard error", "+-", digits=2),
    ResultColumn("low_95", "", "lower end of the 95 % interval"),
    ResultColumn("high_95", "", "upper end of the 95 % interval"),
    ResultColumn("interval", "", "", "95 %", digits=3),
)
LOOPS = (
    ResultColumn("source", "", "source", "loop of"),
    *LOOP_FIGURES,
    ResultColumn("cycles", "1", "cycles", "cycles"),
    ResultColumn("frequency", "Hz", "frequency", "rate", "Hz", digits=3),
    ResultColumn("from", "", "between the turning points of"),
)
_OF_SOME_LOOPS = ("low", "high", "damping_ratio", "mean_force", "min_force", "max_force")


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


def _names_of_paths(paths: Sequence[str]) -> dict[str, str]:
    """File names of paths; the path itself where several files have one name."""
    name_of = {path: PurePath(path).name for path in paths}
    names = list(name_of.values())
    return {path: name if names.count(name) == 1 else path for path, name in name_of.items()}


def fit_table(overall: Figures, fits: Sequence[RecordFit], fitted: Sequence[RecordFit] = ()) -> Table:
    """How well the spring alone follows each record, and all if there are several; the fit where it differs."""
    names = _names_of_paths([fit.path for fit in fits])
    rows: list[dict[str, Any]] = []
    for fit, other in zip(fits, fitted or fits, strict=True):
        rows.append({"record": names[fit.path], **fit.figures, "samples": fit.samples, "compared": fit.compared})
        if differ(fit.figures, other.figures):
            rows[-1] |= {"fitted_rnl": other.rnl, "fitted_energy": energy_ratio(other.figures)}
    if len(fits) > 1:
        rows.append({"record": "all records", **overall})
    return Table(_FITS, [{**row, "energy": energy_ratio(row)} for row in rows], details=("samples", "compared"))


def parameter_table(
    p: SpringParameters, uncertainty: Mapping[str, Any], brief: bool = False, in_files: bool = False
) -> Table:
    """The parameters with what is known of them, in text without an FE as a table; if brief without FE and FA."""
    errors, intervals = {**uncertainty}, {**(uncertainty.get("interval_95") or {})}
    for name, of in (uncertainty.get("further") or {}).items():
        errors[name], intervals[name] = of.get("standard_error"), of.get("interval_95")
    columns = (*HYSTERETIC_PARAMETERS, *further_columns(p))
    figures = [(column.key, column.unit, getattr(*part_with(p, column.key))) for column in columns]
    for array in () if brief else (*(ARRAYS if in_files else ("kE", "kA")), "second.kA"):
        part, name = part_with(p, array)
        figures += [(f"{array}[{k}]", _UNITS[name].format(k), value) for k, value in enumerate(getattr(part, name, ()))]
        errors |= {f"{array}[{k}]": error for k, error in enumerate(uncertainty.get(array) or ())}
    rows = []
    for name, unit, value in figures:
        low, high = ends = intervals.get(name) or (None, None)
        # An end where no spring has less is none.
        is_least = name == "sigma" and low is not None and low <= SIGMA_RANGE[0] * _AT_BOUND
        interval: Any = (low, high) if intervals.get(name) else None
        if interval and (is_least or None in ends):
            interval = f"> {low:.2g}" if low and not is_least else f"< {high:.2g}" if high else "not bounded"
        cells = (name, unit, value, errors.get(name), *ends, interval)
        rows.append(dict(zip((column.key for column in _PARAMETERS), cells, strict=True)))
    return Table(_PARAMETERS, rows)


def part_with(p: SpringParameters, key: str) -> tuple[Any, str]:
    """The part of a spring that a column of `further_columns` is about, and the parameter's name there."""
    owner, _, name = key.rpartition(".")
    parts = {"": p, "second": p.second, **{f"branches[{j}]": branch for j, branch in enumerate(p.branches)}}
    return parts[owner], name


def shape_of(p: SpringParameters) -> str:
    """The degrees of FE and FA, and the identified range, in words."""
    elastic = f"a spline through {len(p.FE_knots)} knots" if p.FE_knots else f"of degree {len(p.kE) - 1}"
    low, high, middle = (1e3 * v for v in (p.displacement_min, p.displacement_max, p.displacement_offset))
    middle = 0.0 if abs(middle) < _ROUNDING * (high - low) else middle
    return f"FE {elastic}, FA of degree {len(p.kA) - 1}, about {middle:.6g} mm; valid from {low:.6g} to {high:.6g} mm"


def loop_table(measured: Sequence[MeasuredLoop], modelled: Sequence[Loop] = (), in_files: bool = False) -> Table:
    """Loops of a model and of records, these with their scatter from cycle to cycle and the model's beside.

    In files every path is whole, and there is no scatter.
    """
    names, of = _names_of_paths([loop.path for loop in measured]), partial(values, LOOP_FIGURES)
    rows: list[dict[str, Any]] = [{"source": "model", **of(loop.figures)} for loop in modelled]
    for loop in measured:
        source, model = (loop.path, "model") if in_files else (names[loop.path], "  model")
        counts = {name: getattr(loop, name) for name in ("cycles", "frequency", "gap", "spread")}
        rows.append({"source": source, **of(loop.figures), **counts})
        if loop.spread is not None and not in_files:
            scatter = {name: float(f"{value:.2g}") for name, value in asdict(loop.spread).items()}
            rows.append({"source": "  +- by cycle", **scatter})
        if loop.predicted is not None:
            rows.append({"source": model, **of(loop.predicted), "from": loop.path})
    return Table(LOOPS, rows, details=_OF_SOME_LOOPS)
