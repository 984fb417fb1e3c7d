"""`strandspring identify`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ...api.common.text import verdict_json
from ...api.common.text_table import table_lines
from ...api.identification import Identification
from ...api.identification import identify as identify_records
from ...identification.methods.method import Method
from ...identification.methods.progress import heard_by
from ...loops.campaign import campaign_verdicts
from ...model.modelfile import ModelFile, save_model
from ...peers.rivals.classes import RIVALS
from ...peers.rivals.ranking import Ranking, RankingEntry
from ...report.details import ReportDetails
from ...report.figure import write_figure
from ...report.rendering.report_path import SUFFIXES as REPORT_SUFFIXES
from ...report.rendering.report_path import check_report_path
from ...report.report_content import write_report
from ..shared.cautions import note_assumptions, note_cautions
from ..shared.option_types import name_option, output_options, positive, together
from ..shared.options import (
    identification_options,
    identifier,
    method_options,
    read_records,
    record_files,
    record_options,
)
from ..shared.output import advancing, note, present, working
from ..shared.paths import PLOT_FILE, FileNamed, FileOfFormat, refuse_overwriting


def _fields(_context: click.Context, _option: click.Parameter, texts: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    pairs = [text.partition("=") for text in texts]
    for text, (label, sign, _) in zip(texts, pairs, strict=True):
        if not sign or not label.strip():
            raise click.BadParameter(f"must be LABEL=TEXT, got {text!r}.")
    return tuple((label.strip(), text.strip()) for label, _, text in pairs)


report_options = together(
    click.option("--report", type=FileOfFormat(*REPORT_SUFFIXES), metavar="FILE.html|pdf",
                 help="Also write a report: a page with all figures to zoom into, or a document."),
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
    StrandspringError     If a PDF cannot be made here.
    """

    def __init__(self, options: dict[str, Any]) -> None:
        self.report: str | None = options.pop("report")
        self.figure: str | None = options.pop("figure")
        given = {name: options.pop(name) for name in ("date", "operator", "specimen", "fields", "mass")}
        if self.report is None and any(given.values()):
            raise click.UsageError("--date, --operator, --specimen, --field and --report-mass belong to --report.")
        self.details = ReportDetails(**given)
        if self.report is not None:
            check_report_path(self.report)

    @property
    def outputs(self) -> dict[str, str | None]:
        """Files that are written, by option."""
        return {"--report": self.report, "--figure": self.figure}

    def write(self, identification: Identification, model: ModelFile, comparison: str) -> None:
        """Write what is asked for."""
        if self.report is not None:
            with working("Drawing the report"):
                write_report(self.report, identification, model, self.details, comparison)
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


def compared_with_rivals(identification: Identification) -> tuple[Identification, Ranking]:
    """Rank other classes on the same data; the identification gains a caution where one is clearly better."""
    with advancing("Fitting other classes", len(RIVALS) + 1) as advance:
        compared, ranking = identification.with_rivals(advance)
    for sentence in ranking.notes:
        note(sentence)
    return compared, ranking


def ranking_lines(ranking: Ranking, width: int | None = None) -> list[str]:
    """The ranking in words, with a table of at most a width."""
    headings = ("class", "degrees", "parameters", "held out [N]", "[% of std]", "fitted [N]", "clearly better")
    rows = [_row(ranking, entry) for entry in ranking.entries]
    return [ranking.sentence, *table_lines(headings, rows, ("class",), width)]


def _row(ranking: Ranking, entry: RankingEntry) -> tuple[str, ...]:
    return (
        entry.rival.title,
        _degrees(entry),
        f"{entry.fit.parameters}",
        f"{entry.error:.4g}",
        f"{100.0 * entry.error / ranking.spread:.3g}",
        f"{entry.fit.misfit:.4g}",
        "yes" if ranking.is_clearly_better(entry) else "",
    )


def _degrees(entry: RankingEntry) -> str:
    basis = entry.fit.basis
    return f"{basis.elastic},{basis.amplifier}" if entry.rival.has_amplifier else f"{basis.elastic}"


def ranking_json(ranking: Ranking) -> dict[str, Any]:
    """The ranking as JSON."""
    return {
        "sentence": ranking.sentence,
        "held_out": ranking.held_out,
        "folds": ranking.folds,
        "notes": list(ranking.notes),
        "classes": [
            {
                "name": entry.rival.name,
                "title": entry.rival.title,
                "parameters": entry.fit.parameters,
                "degrees": [entry.fit.basis.elastic, entry.fit.basis.amplifier],
                "shape": entry.fit.shape,
                "error": entry.error,
                "error_share": entry.error / ranking.spread,
                "errors": entry.errors.tolist(),
                "misfit": entry.fit.misfit,
                "clearly_better": ranking.is_clearly_better(entry),
            }
            for entry in ranking.entries
        ],
    }
