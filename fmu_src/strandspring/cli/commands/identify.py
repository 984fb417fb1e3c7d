"""`strandspring identify`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click

from ...api.common.text import verdict_json
from ...api.identification import Identification
from ...api.identification import identify as identify_records
from ...identification.method import Method, heard_by
from ...loops.campaign import campaign_verdicts
from ...model.modelfile import ModelFile, save_model
from ...report import ReportDetails
from ...report.figure import write_figure
from ...report.identification_page import write_report
from ..shared.cautions import note_cautions, note_records, noted
from ..shared.option_types import name_option, output_options, positive, together
from ..shared.options import (
    identification_options,
    identifier,
    method_options,
    read_records,
    record_files,
    record_options,
)
from ..shared.output import folded, present, result, width_of, working
from ..shared.paths import PLOT_FILE, REPORT_FILE, FileNamed, refuse_overwriting

_FINDINGS = 3  # that are printed, the most harmful ones


def _fields(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    pairs = [text.partition("=") for text in texts]
    for text, (label, sign, _) in zip(texts, pairs, strict=True):
        if not sign or not label.strip():
            raise click.BadParameter(f"must be LABEL=TEXT, got {text!r}.")
    return tuple((label.strip(), text.strip()) for label, _, text in pairs)


report_options = together(
    click.option("--report", type=REPORT_FILE, metavar="FILE.html",
                 help="Also write a report: a page with all figures to zoom into."),
    click.option("--date", default="", metavar="TEXT", help="Date in the report.  [default: a line to fill in]"),
    click.option("--operator", default="", metavar="TEXT", help="Who ran the test, likewise."),
    click.option("--specimen", default="", metavar="TEXT", help="Which spring was tested, likewise."),
    click.option("--field", "fields", multiple=True, metavar="LABEL=TEXT", callback=_fields,
                 help="A further line of the report; repeat for more."),
    click.option("--report-mass", "mass", type=positive("kg"), metavar="KG",
                 help="Mass of the report's transmissibility [kg].  [default: one that suits the spring]"),
    click.option("--figure", type=PLOT_FILE, metavar="FILE.svg|png|pdf",
                 help="Also draw the loops as a figure for a paper."),
)  # fmt: skip


class Reporting:
    """What the options ask for, checked before the work begins; takes them out of a command's.

    Raises
    ------
    click.UsageError      If details are given without --report.
    """

    def __init__(self, options: dict[str, Any]) -> None:
        self.report: str | None = options.pop("report")
        self.figure: str | None = options.pop("figure")
        given = {name: options.pop(name) for name in ("date", "operator", "specimen", "fields", "mass")}
        if self.report is None and any(given.values()):
            raise click.UsageError("--date, --operator, --specimen, --field and --report-mass belong to --report.")
        self.details = ReportDetails(**given)

    @property
    def outputs(self) -> dict[str, str | None]:
        """Files that are written, by option."""
        return {"--report": self.report, "--figure": self.figure}

    def write(self, identification: Identification, model: ModelFile) -> None:
        """Write what is asked for."""
        if self.report is not None:
            with working("Drawing the report"):
                write_report(self.report, identification, model, self.details)
        if self.figure is not None:
            write_figure(self.figure, identification)


@click.command()
@click.argument("records", nargs=-1, required=True, metavar="RECORD...")
@click.option(
    "-o", "--output", type=FileNamed(".json"), required=True, metavar="MODEL.json", help="Model file to write."
)
@name_option("Name of the model and its FMU, an identifier.  [default: from the output file]")
@click.option("--description", default="", help="Free text for the model file and the FMU.")
@record_options
@identification_options
@report_options
@output_options
def identify(
    records: tuple[str, ...],
    output: str,
    name: str | None,
    description: str,
    save_anyway: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Identify a spring from force-displacement records.

    A record is a file of a test rig with a displacement and a force: delimited text, and with
    strandspring[formats] Excel, MATLAB, TDMS, MDF, UFF, HDF5, Parquet. A .toml file describes several records.
    All records are fitted as one spring.

    The first line of the result says how far the spring predicts strokes that were held out, and how far the best of
    three plain models does.

    \b
    Examples:
      strandspring identify loop.csv -o spring.json
      strandspring identify rig.txt --displacement 5 --force 7 -o spring.json
      strandspring identify rig.xlsx --cycles 2: -o spring.json --report r.html
      strandspring identify a13.csv a46.csv --degrees 3,2 -o spring.json
      strandspring identify loop.csv -o spring.json --time 1 --moving-mass 0.8
    """
    method = method_options(options)
    reporting = Reporting(options)
    refuse_overwriting(record_files(records), {"--output": output, **reporting.outputs}, ".json")
    chosen = name or identifier(Path(output).stem)
    model, identification = identified(records, options, method, chosen, description, save_anyway)
    verdict = [] if identification.verdict is None else [str(identification.verdict)]
    if not as_json:
        for line in verdict:
            result(folded(line, width_of(sys.stdout)))
    note_cautions(identification.findings, _FINDINGS)
    save_model(output, model)
    reporting.write(identification, model)
    # For one record that holds several amplitudes or frequencies there is `info`.
    of_campaign = campaign_verdicts(identification.records) if len(identification.records) > 1 else (None, None)
    rate, overlap = map(verdict_json, of_campaign)
    notes = noted(identification.all_findings)
    present(
        as_json,
        lambda: {
            "name": model.name,
            **identification.as_json(),
            "rate_independence": rate,
            "overlap": overlap,
        },
        lambda width: [*identification.brief(width)[len(verdict) :], *notes],
        lambda width: [
            *identification.text_lines(width)[len(verdict) :],
            *notes,
            *(found.sentence for found in of_campaign if found is not None),
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
    note_records(group)
    with working("Identifying") as show, heard_by(lambda stage: show(stage.words)):
        identification = identify_records(group, options, save_anyway=save_anyway)
    return identification.model_file(name, description), identification
