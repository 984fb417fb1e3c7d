"""`strandspring predict`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np

from ..errors import ModelError
from ..files import write_csv
from ..identification.figures import RecordFit, overall, predict_record
from ..identification.prediction_interval import PredictionInterval, prediction_error
from ..joint import JointCovariance
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.strokes import find_strokes
from ..modelfile import ModelFile, load_model
from ..records.record import Record
from .cautions import caution_backwards, caution_samples, note_assumptions
from .fit_tables import fit_json, fit_lines
from .options import read_records, record_options
from .output import note, progress, result, result_json
from .paths import refuse_overwriting


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.argument("records", nargs=-1, required=True, metavar="RECORD...")
@click.option("-o", "--output", metavar="OUT.csv", help="Write displacement, measured and predicted force here.")
@record_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def predict(model: str, records: tuple[str, ...], output: str | None, as_json: bool, **columns: Any) -> None:
    """Predict the force of records with a model and report the errors.

    The hysteretic state at the start of a measured record is unknown; it is estimated as one bounded number,
    omega_start, and reported. Reversals of the displacement below its noise are removed. OUT.csv holds the ends of the
    95 % prediction interval too, if the model file has one.

    \b
    Examples:
      strandspring predict spring.json other.csv
      strandspring predict spring.json a13.csv a46.csv -o predicted.csv --json
    """
    refuse_overwriting((model, *records), {"--output": output})
    content = load_model(model)
    parameters = content.parameters
    interval = _interval(model, content)
    group = read_records(records, columns)
    solver = PathSolver(parameters)
    fits = tuple(predict_record(solver, record) for record in progress(group, "Predicting"))
    note_assumptions(group)
    caution_backwards(group)
    for record in group:
        caution_samples(record.path, record.displacement, parameters)
    if output is not None:
        if interval is None:
            note(
                f"{model} holds no prediction interval, so {output} has no columns lower and upper; identify the "
                "spring again with the refined method to have them."
            )
        half_widths = [] if interval is None else [interval(*each) for each in zip(group, fits, strict=True)]
        _write(Path(output), group, fits, half_widths)
    rmse, rnl = overall(fits)
    if as_json:
        result_json(
            {"model": model, "rmse": rmse, "rnl": rnl, "records": [fit_json(f) for f in fits], "output": output}
        )
        return
    result(f"Predicted with {model}: rmse {rmse:.4g} N, RNL {rnl:.4f}")
    for line in fit_lines(fits):
        result(line)
    if output is not None:
        result(f"Prediction: {output}")


def _interval(path: str, model: ModelFile) -> Callable[[Record, RecordFit], FloatArray] | None:
    """What gives the half-width of the 95 % prediction interval at each sample [N]; None if the model file has none."""
    try:
        interval = PredictionInterval.of(model.uncertainty)
        joint = JointCovariance.of(model.parameters, model.uncertainty)
    except ModelError as problem:
        raise ModelError(f"{path}: {problem}") from None
    if interval is None or joint is None:
        return None

    def half_width(record: Record, fit: RecordFit) -> FloatArray:
        displacement = find_strokes(record.displacement).displacement
        error = prediction_error(model.parameters, joint, displacement, fit.omega_start)
        return interval.reach(fit.predicted, error)

    return half_width


def _write(path: Path, records: list[Record], fits: tuple[RecordFit, ...], half_widths: list[FloatArray]) -> None:
    header = ["record", "displacement [mm]", "force [N]", "predicted force [N]"]
    columns = [
        [record.displacement * 1e3, record.force, fit.predicted] for record, fit in zip(records, fits, strict=True)
    ]
    if half_widths:
        header += ["lower [N]", "upper [N]"]
        for own, half_width in zip(columns, half_widths, strict=True):
            own += [own[2] - half_width, own[2] + half_width]
    rows = ((number, *row) for number, own in enumerate(columns, 1) for row in np.column_stack(own).tolist())
    write_csv(path, header, rows)
