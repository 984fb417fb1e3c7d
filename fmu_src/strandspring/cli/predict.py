"""`strandspring predict`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import numpy as np

from ..files import write_csv
from ..identification.figures import RecordFit, overall, predict_record
from ..kernel.path import PathSolver
from ..modelfile import load_model
from ..records.record import Record
from .cautions import caution_backwards, caution_samples, note_assumptions
from .fit_tables import fit_json, fit_lines
from .options import column_options, read_records
from .output import progress, result, result_json
from .paths import refuse_overwriting


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.argument("records", nargs=-1, required=True, metavar="RECORD...")
@click.option("-o", "--output", metavar="OUT.csv", help="Write displacement, measured and predicted force here.")
@column_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def predict(model: str, records: tuple[str, ...], output: str | None, as_json: bool, **columns: Any) -> None:
    """Predict the force of records with a model and report the errors.

    The hysteretic state at the start of a measured record is unknown; it is estimated as one bounded number,
    omega_start, and reported. Reversals of the displacement below its noise are removed.

    \b
    Examples:
      strandspring predict spring.json other.csv
      strandspring predict spring.json a13.csv a46.csv -o predicted.csv --json
    """
    refuse_overwriting((model, *records), {"--output": output})
    parameters = load_model(model).parameters
    group = read_records(records, columns)
    solver = PathSolver(parameters)
    fits = tuple(predict_record(solver, record) for record in progress(group, "Predicting"))
    note_assumptions(group)
    caution_backwards(group)
    for record in group:
        caution_samples(record.path, record.displacement, parameters)
    if output is not None:
        _write(Path(output), group, fits)
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


def _write(path: Path, records: list[Record], fits: tuple[RecordFit, ...]) -> None:
    header = ("record", "displacement [mm]", "force [N]", "predicted force [N]")
    rows = (
        (number, *row)
        for number, (record, fit) in enumerate(zip(records, fits, strict=True), 1)
        for row in np.column_stack((record.displacement * 1e3, record.force, fit.predicted)).tolist()
    )
    write_csv(path, header, rows)
