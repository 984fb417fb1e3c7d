"""Tables of a report."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..core.parameters import SpringParameters
from ..ground.result_columns import ResultColumn
from ..identification.figures import RecordFit
from ..loops.cycles import MeasuredLoop
from ..loops.loop import PANELS, LoopFigures
from ..model.joint import HYSTERETIC_PARAMETERS, NORMAL_95
from ..model.stated_figures import energy_ratio
from .charts.engineering import KINDS, NAMES, AmplitudeComparison, EngineeringFigures
from .charts.evaluation import Evaluation
from .content.blocks import PageTable
from .content.chart import Axis
from .content.quantities import NUMBER, by_error, number, percent, span, superscript, unit_of, with_reach

_LISTED = 200  # records in a table


def engineering(evaluation: Evaluation, figures: EngineeringFigures) -> PageTable:
    """Stiffness, energy and loss factor of each amplitude, measured and modelled."""
    largest = {name: max(abs(getattr(row.model, name)) for row in figures.table) for name in NAMES}
    units = [unit_of(kind, largest[name]) if kind else NUMBER for name, kind in zip(NAMES, KINDS, strict=True)]
    rows: list[tuple[str, ...]] = []
    strong = []
    for row in figures.table:
        strong.append(len(rows))
        amplitude = number(0.5 * (row.high - row.low) * evaluation.length.factor, 4)
        for label, cells in _of_amplitude(row, [unit.factor for unit in units], figures.smallest_measured):
            rows.append((amplitude, label, *cells))
            amplitude = ""
    figures_header = (Axis(column.words, unit).label for column, unit in zip(PANELS, units, strict=True))
    header = (f"amplitude [{evaluation.length.name}]", "", *figures_header)
    return PageTable(
        "Stiffness, energy per cycle and loss factor by amplitude", header, tuple(rows), tuple(strong), compact=True
    )


def _of_amplitude(row: AmplitudeComparison, factors: list[float], smallest: float) -> Iterator[tuple[str, list[str]]]:
    def cells(figures: LoopFigures, reach: tuple[float, ...] | None) -> list[str]:
        return [
            with_reach(getattr(figures, name) * factor, None if reach is None else reach[k] * factor)
            for k, (name, factor) in enumerate(zip(NAMES, factors, strict=True))
        ]

    if row.measured is None:
        extrapolated = 0.5 * (row.high - row.low) < smallest
        yield "model, extrapolated" if extrapolated else "model only", cells(row.model, row.reach)
        return
    spread = row.measured.spread
    yield (
        _source(row.measured),
        cells(row.measured.figures, None if spread is None else tuple(getattr(spread, name) for name in NAMES)),
    )
    yield "model", cells(row.model, row.reach)
    pairs = [(getattr(row.model, name), getattr(row.measured.figures, name)) for name in NAMES]
    yield "difference", [percent(a / b - 1.0, sign=True) if b else "–" for a, b in pairs]


def _source(measured: MeasuredLoop) -> str:
    rate = "" if measured.frequency is None else f", {number(measured.frequency, 2)} Hz"
    return f"measured, {measured.cycles} cycle{'s' if measured.cycles > 1 else ''}{rate}"


def parameters(evaluation: Evaluation) -> PageTable:
    """All parameters with unit, standard error and 95 % interval; without the last two if they are unknown."""
    p, known, unit = evaluation.identification.parameters, evaluation.identification.uncertainty, evaluation.length
    main = [_main_row(column, p, known) for column in HYSTERETIC_PARAMETERS]
    if p.FE_knots:
        places = (f"elastic force at {unit.text(x)}" for x in p.FE_knots)
        elastic = [("FE_forces", meaning, "N") for meaning in places]
    else:
        elastic = [("kE", f"elastic force, power {k}", _power("N", k)) for k in range(len(p.kE))]
    amplifier = [("kA", f"amplifier, power {k}", _power("1", k)) for k in range(len(p.kA))]
    amplifier[0] = ("kA", "amplifier, power 0, 1 by definition", "–")
    rows = [*main, *_rows(elastic, p, known), *_rows(amplifier, p, known)]
    groups = [0, len(main), len(rows) - len(amplifier)]
    if not p.is_plain:
        groups.append(len(rows))
        rows += _further_rows(p, known.get("further") or {})
    header: tuple[str, ...] = ("parameter", "meaning", "value", "unit", "standard error", "95 % interval")
    if not known:
        header, rows = header[:4], [row[:4] for row in rows]
    return PageTable("Parameters", header, tuple(rows), tuple(groups))


def _main_row(column: ResultColumn, p: SpringParameters, known: dict[str, Any]) -> tuple[str, ...]:
    value, error = getattr(p, column.key), known.get(column.key)
    low, high = known.get("interval_95", {}).get(column.key, (None, None))
    if low is not None and high is not None:
        interval = f"{by_error(low, error)} to {by_error(high, error)}"
    elif high is not None:
        interval = f"below {number(high, 3)}"
    else:
        interval = "not bounded" if low is None else f"above {number(low, 3)}"
    deviation = "at its bound" if error is None else number(error, 2, zeros=True)
    return column.key, column.words, by_error(value, error), column.shown or "–", deviation, interval


def _rows(
    coefficients: list[tuple[str, str, str]], p: SpringParameters, known: dict[str, Any]
) -> Iterator[tuple[str, ...]]:
    """Rows of the coefficients of FE or FA, each with its name, meaning and unit."""
    for k, (name, meaning, unit) in enumerate(coefficients):
        value, error = getattr(p, name)[k], (known.get(name) or [None] * len(coefficients))[k]
        if error:
            ends = (by_error(value + side * NORMAL_95 * error, error) for side in (-1.0, 1.0))
            reach = number(error, 2, zeros=True), " to ".join(ends)
        else:
            reach = "–", "–"
        yield f"{name}[{k}]", meaning, by_error(value, error), unit, *reach


def _further_rows(p: SpringParameters, known: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """Rows of a second mechanism and of Maxwell branches."""
    parameters = []
    if p.second is not None:
        for column in HYSTERETIC_PARAMETERS:
            parameters.append((f"second.{column.key}", column.words, column.shown, getattr(p.second, column.key)))
        for k, coefficient in enumerate(p.second.kA):
            parameters.append((f"second.kA[{k}]", f"second amplifier, power {k}", _power("1", k), coefficient))
    for j, branch in enumerate(p.branches):
        parameters.append((f"branches[{j}].stiffness", "Maxwell branch, added to fast motion", "N/m", branch.stiffness))
        parameters.append((f"branches[{j}].time_constant", "decay of its force at rest", "s", branch.time_constant))
    for name, meaning, unit, value in parameters:
        of_name = known.get(name) or {}
        error, (low, high) = of_name.get("standard_error"), of_name.get("interval_95") or (None, None)
        reach = ("–", "–")
        if error and low is not None and high is not None:
            reach = number(error, 2, zeros=True), f"{by_error(low, error)} to {by_error(high, error)}"
        yield name, meaning, by_error(value, error), unit or "–", *reach


def _power(unit: str, power: int) -> str:
    return f"{unit}/m{superscript(power) if power > 1 else ''}" if power else unit


def records(evaluation: Evaluation) -> PageTable:
    """Records with what was compared, and how well the spring alone follows them; also the fit where it differs."""
    unit, views = evaluation.residual, evaluation.views[:_LISTED]
    beside = any(view.differs for view in views)
    header = ["record", "samples compared", f"rms error [{unit.name}]", "RNL", "energy / measured"]
    rows = []
    for view in views:
        row = [
            view.name,
            f"{view.fit.samples} of {len(view.record)}",
            number(view.fit.rmse * unit.factor, 3, zeros=True),
            number(view.fit.rnl, 4, zeros=True),
            _ratio(view.fit),
        ]
        row += [number(view.fitted.rnl, 4, zeros=True), _ratio(view.fitted)] if beside else []
        rows.append((*row, view.fit.compared))
    header += ["RNL as fitted", "energy / measured as fitted"] if beside else []
    return PageTable("Records and fit", (*header, "compared"), tuple(rows))


def held_out(evaluation: Evaluation) -> PageTable | None:
    """Error on held-out strokes beside those of plain models; None where nothing was held out."""
    verdict = evaluation.identification.verdict
    if verdict is None or verdict.whole is None:
        return None
    errors = {"this spring": verdict.whole.error, **verdict.whole.plain}
    rows = tuple((name, percent(error)) for name, error in errors.items())
    return PageTable("Held-out error", ("model", "error, share of the force's standard deviation"), rows)


def _ratio(fit: RecordFit) -> str:
    ratio = energy_ratio(fit.figures)
    return "–" if ratio is None else number(ratio, 3, zeros=True)


def provenance(evaluation: Evaluation) -> PageTable:
    """Files with their digests."""
    rows = tuple(
        (view.name, str(len(view.record)), view.record.sha256 or "not from a file")
        for view in evaluation.views[:_LISTED]
    )
    return PageTable("Files", ("file", "samples", "SHA-256"), rows)


def ranges(evaluation: Evaluation) -> tuple[tuple[str, str], ...]:
    """The ranges that belong to the parameters."""
    p, unit = evaluation.identification.parameters, evaluation.length
    if p.FE_knots:
        about = "FA about"
        form = f"FE is a cubic spline through {len(p.FE_knots)} knots, FA a polynomial of degree {len(p.kA) - 1}"
    else:
        about = "Polynomials about"
        form = f"FE is a polynomial of degree {len(p.kE) - 1}, FA one of degree {len(p.kA) - 1}"
    return (
        ("Identified range", span(p.displacement_min, p.displacement_max, unit)),
        (about, f"{unit.text(p.displacement_offset, 6)}"),
        ("Form", form),
    )
