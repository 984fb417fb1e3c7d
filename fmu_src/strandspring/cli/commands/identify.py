"""`strandspring identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ...api.common.text import verdict_json
from ...api.identification import Identification
from ...api.identification import identify as identify_records
from ...identification.methods.method import Method
from ...identification.methods.progress import heard_by
from ...loops.campaign import campaign_verdicts
from ...model.modelfile import ModelFile, save_model
from ...peers.rivals.ranking import Ranking
from ..shared.cautions import note_assumptions, note_cautions
from ..shared.option_types import name_option, output_options
from ..shared.options import (
    identification_options,
    identifier,
    method_options,
    read_records,
    record_files,
    record_options,
)
from ..shared.output import present, working
from ..shared.paths import FileNamed, refuse_overwriting
from ..shared.reporting import Reporting, report_options
from ..shared.rivals import compared_with_rivals, ranking_json, ranking_lines


@click.command()
@click.argument("records", nargs=-1, required=True, metavar="RECORD...")
@click.option(
    "-o", "--output", type=FileNamed(".json"), required=True, metavar="MODEL.json", help="Model file to write."
)
@name_option("Name of the model and its FMU, an identifier.  [default: from the output file]")
@click.option("--description", default="", help="Free text for the model file and the FMU.")
@record_options
@identification_options
@click.option(
    "--rivals", is_flag=True, help="Also fit other classes of models and rank them by their error on what is held out."
)
@report_options
@output_options
def identify(
    records: tuple[str, ...],
    output: str,
    name: str | None,
    description: str,
    rivals: bool,
    save_anyway: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Identify a spring from force-displacement records.

    A record is a file of a test rig with a displacement and a force: delimited text, and with
    strandspring[formats] Excel, MATLAB, TDMS, MDF, UFF, HDF5, Parquet. A .toml file describes several records.
    All records are fitted as one spring.

    \b
    Examples:
      strandspring identify loop.csv -o spring.json
      strandspring identify rig.txt --displacement 5 --force 7 -o spring.json
      strandspring identify rig.xlsx --cycles 2: -o spring.json --report r.html
      strandspring identify a13.csv a46.csv --degrees 3,2 -o spring.json
      strandspring identify loop.csv -o spring.json --rivals
      strandspring identify loop.csv -o spring.json --time 1 --moving-mass 0.8
    """
    method = method_options(options)
    reporting = Reporting(options)
    refuse_overwriting(record_files(records), {"--output": output, **reporting.outputs}, ".json")
    chosen = name or identifier(Path(output).stem)
    model, identification = identified(records, options, method, chosen, description, save_anyway)
    ranking: Ranking | None = None
    if rivals:
        identification, ranking = compared_with_rivals(identification)
        model = identification.model_file(chosen, description)
    note_cautions(identification.cautions)
    save_model(output, model)
    reporting.write(identification, model, "" if ranking is None else ranking.sentence)
    # For one record that holds several amplitudes or frequencies there is `info`.
    verdicts = campaign_verdicts(identification.records) if len(identification.records) > 1 else (None, None)
    rate, overlap = map(verdict_json, verdicts)
    named = f"`strandspring plan {output} -o PROGRAM.csv`"
    notes = [f"Note: {sentence}".replace("`plan()`", named) for sentence in identification.notes]

    def ranked(width: int | None) -> list[str]:
        return [] if ranking is None else ranking_lines(ranking, width)

    present(
        as_json,
        lambda: {
            "name": model.name,
            **identification.as_json(),
            "rate_independence": rate,
            "overlap": overlap,
            "rivals": None if ranking is None else ranking_json(ranking),
        },
        lambda width: [*identification.brief(width), *notes, *ranked(width)],
        lambda width: [
            *identification.text_lines(width),
            *notes,
            *ranked(width),
            *(verdict.sentence for verdict in verdicts if verdict is not None),
        ],
        model=("Model file", output),
        report=("Report", reporting.report),
        figure=("Figure", reporting.figure),
    )


def identified(
    records: tuple[str, ...],
    columns: dict[str, Any],
    options: Method,
    name: str,
    description: str = "",
    save_anyway: bool = False,
) -> tuple[ModelFile, Identification]:
    """Read the records and identify the spring."""
    group = read_records(records, columns)
    note_assumptions(group)
    with working("Identifying") as show, heard_by(lambda stage: show(stage.words)):
        identification = identify_records(group, options, save_anyway=save_anyway)
    return identification.model_file(name, description), identification
