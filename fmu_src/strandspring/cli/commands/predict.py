"""`strandspring predict`."""

from __future__ import annotations

from typing import Any

import click

from ...api.identifying.prediction import predict as predict_records
from ...model.modelfile import load_model
from ..shared.cautions import note_cautions, note_records
from ..shared.option_types import output_options
from ..shared.options import read_records, record_files, record_options
from ..shared.output import note, present, working
from ..shared.paths import FileNamed, refuse_overwriting


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.argument("records", nargs=-1, required=True, metavar="RECORD...")
@click.option(
    "-o",
    "--output",
    type=FileNamed(".csv"),
    metavar="OUT.csv",
    help="Write displacement, measured and predicted force here.",
)
@record_options
@output_options
def predict(model: str, records: tuple[str, ...], output: str | None, as_json: bool, **columns: Any) -> None:
    """Predict the force of records with a model and report the errors.

    The hysteretic state at the start of a measured record is unknown; it is estimated as one bounded number,
    omega_start, and reported. The path is the displacement as recorded, which OUT.csv holds; a caution says by how much
    reversals below its noise change the error, where that counts. OUT.csv holds the ends of the 95 % prediction
    interval too, if the model file has one.

    \b
    Examples:
      strandspring predict spring.json other.csv
      strandspring predict spring.json a13.csv a46.csv -o predicted.csv --json
    """
    refuse_overwriting((model, *record_files(records)), {"--output": output}, ".csv")
    load_model(model)  # a bad model is refused before long records are read
    group = read_records(records, columns)
    note_records(group)
    with working("Predicting"):
        prediction = predict_records(model, group)
    note_cautions(prediction.findings)
    if output is not None:
        if prediction.interval is None:
            note(
                f"{model} holds no prediction interval, so {output} has no columns lower and upper; identify the "
                "spring again with the refined method to have them."
            )
        prediction.save_csv(output)
    present(
        as_json,
        lambda: {"model": model, **prediction.as_json()},
        prediction.brief,
        prediction.text_lines,
        output=("Prediction", output),
    )
