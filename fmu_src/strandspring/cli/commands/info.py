"""`strandspring info`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import click

from ...api.common.text import verdict_json
from ...api.identifying.information import Information
from ...api.identifying.information import info as information_of
from ...loops.loop import LoopFigures
from ...loops.measured import MeasuredLoop
from ...model.modelfile import load_model, save_model
from ...model.stated_figures import stated_json
from ..shared.cautions import note_assumptions, note_cautions
from ..shared.options import FiniteRange, read_records, record_files, record_options
from ..shared.output import result, result_json, result_table, working
from ..shared.paths import refuse_overwriting
from ..shared.zero import origin_of, zero_option

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
    zero: str | float | None,
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
    refuse_overwriting([model, *record_files(records)], {"--save": save}, ".json")
    content = load_model(model)
    if save is not None:
        save_model(save, content)
    origin = origin_of(model, zero, content.parameters)
    group = read_records(records, columns)
    note_assumptions(group)
    with working("Measuring loops"):
        information = information_of(model, group, amplitudes=[a * 1e-3 for a in amplitudes], zero=origin)
    note_cautions(information.cautions)
    if as_json:
        result_json(_json(information, model, save))
        return
    for line in information.lines():
        result(line)
    if save is not None:
        result(f"Model file: {save}")
    result_table([*(heading for heading, _, _ in _COLUMNS), "source"], _rows(information), left=["source"])
    for sentence in information.verdicts:
        result(sentence)


def _json(information: Information, path: str, saved: str | None) -> dict[str, Any]:
    loops = [_loop_json("model", loop.figures) for loop in information.modelled]
    for measured, model_loop in information.pairs:
        loops += [_measured_json(measured), _loop_json("model", model_loop.figures)]
    return {
        "model": path,
        "name": information.model.name,
        "parameters": information.parameters.as_dict(),
        "zero": information.zero,
        "saved": saved,
        "fit": stated_json(information.model),
        "loops": loops,
        "rate_independence": verdict_json(information.rate_independence),
        "overlap": verdict_json(information.overlap),
        "cautions": information.cautions,
    }


def _loop_json(source: str, figures: LoopFigures) -> dict[str, Any]:
    return {"source": source, **{name: getattr(figures, name) for _, name, _ in _COLUMNS}}


def _measured_json(loop: MeasuredLoop) -> dict[str, Any]:
    return {
        **_loop_json(loop.path, loop.figures),
        "cycles": loop.cycles,
        "frequency": loop.frequency,
        "gap": loop.gap,
        "spread": None if loop.spread is None else asdict(loop.spread),
    }


def _rows(information: Information) -> Iterator[list[str]]:
    """Rows of the table: the model's loops, then each measured loop with its scatter and the model's."""
    for loop in information.modelled:
        yield [*_cells(loop.figures), "model"]
    for measured, model_loop in information.pairs:
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
