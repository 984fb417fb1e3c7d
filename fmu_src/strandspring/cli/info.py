"""`strandspring info`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, replace
from typing import Any

import click

from ..coordinates import counted_from, zero_sentence
from ..core.parameters import SpringParameters
from ..identification.campaign import campaign_verdicts
from ..kernel.path import PathSolver
from ..loops.loop import Loop, LoopFigures
from ..loops.measured import MeasuredLoop, measured_loops
from ..loops.modelled import steady_loop
from ..modelfile import ModelFile, load_model, save_model
from .cautions import caution_backwards, note_assumptions, outside_range
from .fit_tables import parameter_lines, verdict_json
from .options import FiniteRange, read_records, record_options
from .output import note, progress, result, result_json, result_table
from .paths import refuse_overwriting
from .zero import origin_of, zero_option

_DEFAULT_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the identified half range
_SLACK = 1e-3  # share of the identified range by which a loop may pass it: cycles differ by as much

# Heading, figure, factor from SI to the unit of the heading.
_COLUMNS = (
    ("amplitude mm", "amplitude", 1e3),
    ("from mm", "low", 1e3),
    ("to mm", "high", 1e3),
    ("secant N/mm", "secant_stiffness", 1e-3),
    ("energy N*mm", "energy_per_cycle", 1e3),
    ("loss factor", "loss_factor", 1.0),
    ("damping ratio", "damping_ratio", 1.0),
    ("mean N", "mean_force", 1.0),
    ("min N", "min_force", 1.0),
    ("max N", "max_force", 1.0),
)


@click.command()
@click.argument("model", metavar="MODEL.json|X.fmu")
@click.argument("records", nargs=-1, metavar="[RECORD...]")
@click.option(
    "--amplitude",
    "amplitudes",
    type=FiniteRange(1e-6, 1e6, unit="mm"),
    multiple=True,
    metavar="MM",
    help="Amplitude of a loop about the offset [mm]; repeat for more.  [default: those of the records, or quarters "
    "of the identified range]",
)
@zero_option
@click.option("--save", metavar="MODEL.json", help="Write the model file to this file, as out of an FMU.")
@record_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def info(
    model: str,
    records: tuple[str, ...],
    amplitudes: tuple[float, ...],
    zero: str | None,
    save: str | None,
    as_json: bool,
    **columns: Any,
) -> None:
    """Show a model's parameters and loop figures, beside those of records.

    For each amplitude: secant stiffness between the turning points, energy absorbed per cycle W, loss factor
    W/(2 pi Ws) with Ws = secant stiffness * amplitude^2 / 2, equivalent viscous damping ratio (half of that), mean
    force and peak forces. Several records also show whether the force depends on the frequency and whether the
    loading paths of different amplitudes overlap.

    \b
    Examples:
      strandspring info spring.json
      strandspring info dist/spring.fmu --save spring.json
      strandspring info spring.json --amplitude 13 --amplitude 46
      strandspring info spring.json a13.csv a46.csv --json
    """
    refuse_overwriting([model, *records], {"--save": save})
    content = load_model(model)
    if save is not None:
        save_model(save, content)
    origin = origin_of(model, zero, content.parameters)
    parameters = counted_from(origin, content.parameters)
    solver = PathSolver(parameters)
    group = read_records(records, columns)
    note_assumptions(group)
    caution_backwards(group)
    group = [replace(record, displacement=record.displacement - origin) for record in group]
    measured = [loop for record in progress(group, "Measuring loops") for loop in measured_loops(record)]
    modelled = [steady_loop(solver, *ends) for ends in _turning_points(parameters, amplitudes, bool(records))]
    pairs = [(loop, steady_loop(solver, loop.figures.low, loop.figures.high)) for loop in measured]
    _caution(parameters, [*((model, loop.figures) for loop in modelled), *((m.path, m.figures) for m in measured)])
    rate, overlap = campaign_verdicts(group, modelled)
    if as_json:
        loops = [_loop_json("model", loop.figures) for loop in modelled]
        for loop, model_loop in pairs:
            loops += [_measured_json(loop), _loop_json("model", model_loop.figures)]
        result_json(
            {
                "model": model,
                "name": content.name,
                "parameters": parameters.as_dict(),
                "zero": origin,
                "saved": save,
                "loops": loops,
                "rate_independence": verdict_json(rate),
                "overlap": verdict_json(overlap),
            }
        )
        return
    for line in _summary(model, content, parameters):
        result(line)
    if sentence := zero_sentence(origin):
        result(f"  {sentence}")
    if save is not None:
        result(f"Model file: {save}")
    result_table([*(heading for heading, _, _ in _COLUMNS), "source"], _rows(modelled, pairs), left=["source"])
    for verdict in (rate, overlap):
        if verdict is not None:
            result(verdict.sentence)


def _turning_points(p: SpringParameters, amplitudes: tuple[float, ...], has_records: bool) -> list[tuple[float, float]]:
    """Turning points [m] of the loops to show besides those of records."""
    reaches = [amplitude * 1e-3 for amplitude in amplitudes]
    if not reaches and not has_records:
        reaches = [0.5 * share * (p.displacement_max - p.displacement_min) for share in _DEFAULT_SHARES]
    return [(p.displacement_offset - reach, p.displacement_offset + reach) for reach in reaches]


def _caution(p: SpringParameters, loops: list[tuple[str, LoopFigures]]) -> None:
    slack = _SLACK * (p.displacement_max - p.displacement_min)
    for source, figures in loops:
        if figures.low < p.displacement_min - slack or figures.high > p.displacement_max + slack:
            note(
                f"Caution: {source}: the loop from {figures.low * 1e3:.6g} to {figures.high * 1e3:.6g} mm reaches "
                f"{outside_range(p)}"
            )


def _loop_json(source: str, figures: LoopFigures) -> dict[str, Any]:
    return {"source": source, **{name: getattr(figures, name) for _, name, _ in _COLUMNS}}


def _measured_json(loop: MeasuredLoop) -> dict[str, Any]:
    return {
        **_loop_json(loop.path, loop.figures),
        "cycles": loop.cycles,
        "frequency": loop.frequency,
        "spread": None if loop.spread is None else asdict(loop.spread),
    }


def _summary(path: str, model: ModelFile, parameters: SpringParameters) -> list[str]:
    """The model file in words; fit and provenance are free JSON, of which any part may be missing."""
    lines = [f"Model {model.name} ({path})" + (f": {model.description}" if model.description else "")]
    lines += parameter_lines(parameters, model.uncertainty)
    fit, origin = model.fit, model.provenance
    if all(isinstance(fit.get(figure), (int, float)) for figure in ("rmse", "rnl")):
        method = f" by the {_plain(origin['method'])} method" if "method" in origin else ""
        lines.append(f"  identified{method}: rmse {fit['rmse']:.4g} N, RNL {fit['rnl']:.4f}")
    records = origin.get("records")
    files = [r["file"] for r in records if isinstance(r, dict) and "file" in r] if isinstance(records, list) else []
    if files:
        lines.append(f"  from {', '.join(map(_plain, files))}")
    return lines


def _plain(value: Any) -> str:
    """Text of a model file without control characters, which could change the terminal."""
    return "".join(c if c.isprintable() else "?" for c in str(value))


def _rows(modelled: list[Loop], pairs: list[tuple[MeasuredLoop, Loop]]) -> Iterator[list[str]]:
    """Rows of the table: the model's loops, then each measured loop with its scatter and the model's."""
    for loop in modelled:
        yield [*_cells(loop.figures), "model"]
    for measured, model_loop in pairs:
        frequency = "" if measured.frequency is None else f", {measured.frequency:.3g} Hz"
        cycles = f"{measured.cycles} cycle{'s' if measured.cycles > 1 else ''}"
        yield [*_cells(measured.figures), f"{measured.path} ({cycles}{frequency})"]
        if measured.spread is not None:
            yield [*_cells(measured.spread, "+-"), "  from cycle to cycle (standard deviation)"]
        yield [*_cells(model_loop.figures), "model"]


def _cells(figures: Any, sign: str = "") -> list[str]:
    """The columns of one row; empty where these figures lack one, "-" where it is undefined."""
    values = [(getattr(figures, name, None), factor) for _, name, factor in _COLUMNS]
    return ["" if v is None else f"{sign}{v * factor:.4g}" if math.isfinite(v) else "-" for v, factor in values]
