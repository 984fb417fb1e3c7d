"""`strandspring show`, `identify` and `identify-many`: from records to springs."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from typing import Any

import click

import strandspring

from ..api.options import Fitting
from ..campaigns.jobs.options import Workers
from ..ground.files import user_cache
from ..ground.options import Option
from ..loops.reading import Reading
from ..model.names import check_name, identifier
from ..report import ReportDetails
from . import options as opt
from . import output as out

_FINDINGS = 3  # that are printed, the most harmful ones
_AMPLITUDE = Option(
    "number", "Amplitude at which stiffness, energy and loss factor are compared", "m", "mm", 1e-3, least=1e-9,
    most=1e3, otherwise="the largest that all springs have in common", metavar="MM",
)  # fmt: skip


@opt.command(records="RECORD...")
@opt.takes_options(reading=Reading)
@opt.written("FILE.html", "Write the page to this file, and open nothing.", "Page", "page")
def show(records: tuple[str, ...], output: str | None, reading: Reading) -> None:
    """The page shows what was detected and what would be left out. Zooming into its figures, or choosing cycles, prints
    the options that choose the same in every command that reads records. Without -o it is opened in the browser.

    \b
    Examples:
      strandspring show loop.csv
      strandspring show rig.xlsx --force "Sheet 2/Load" -o rig.html
      strandspring show campaign.toml -o campaign.html
    """
    from ..api.records import Overview

    group = opt.read_records(records, reading)
    page = user_cache() / "record.html" if output is None else Path(output)
    with out.working("Drawing the page"):
        strandspring.show(group, page)
    out.present(Overview(group), page=("Page", page))
    if output is None:
        webbrowser.open(page.resolve().as_uri())


@opt.command(records="RECORD...")
@opt.takes_options(reading=Reading, fitting=Fitting)
@opt.written("MODEL.json", "Model file to write.", "Model file", "model", is_required=True)
@opt.given("--name", type=opt.Written(check_name),
           help="Name of the model and its FMU, an identifier.  [default: from the output file]")  # fmt: skip
@opt.given("--description", default="", help="Free text for the model file and the FMU.")
@opt.written("FILE.html", "Also write a report: a page with all figures to zoom into.", "Report", "report",
             flags="--report", read=opt.report_path)  # fmt: skip
@opt.takes_options(details=ReportDetails)
@opt.written("FILE.svg|png|pdf", "Also draw the loops as a figure for a paper.", "Figure", "figure", flags="--figure")
def identify(
    records: tuple[str, ...], output: str, name: str | None, description: str, report: str | None, figure: str | None,
    details: ReportDetails, reading: Reading, fitting: Fitting,
) -> None:  # fmt: skip
    """A record is a file of a test rig with a displacement and a force: delimited text, and with
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
    if report is None and details != ReportDetails():
        raise click.UsageError("--date, --operator, --specimen, --field and --report-mass belong to --report.")
    from ..report.identification_page import write_figure

    identification = identified(records, reading, fitting)
    name = name or identifier(Path(output).stem)
    identification.spring(name, description).save(output)
    if report is not None:
        with out.working("Drawing the report"):
            identification.report(report, name, details, description)
    if figure is not None:
        write_figure(figure, identification)
    out.present(identification, {"name": name}, _FINDINGS)


def identified(records: tuple[str, ...], reading: Reading, fitting: Fitting) -> strandspring.Identification:
    """Read the records and identify the spring."""
    from ..identification.method import heard_by

    group = opt.read_records(records, reading)
    with out.reporting(is_counted=False) as show, heard_by(lambda stage: show(f"Identifying: {stage.words}")):
        return strandspring.identify(group, fitting=fitting)


@opt.command(sources="FILE|FOLDER...")
@opt.takes_options(reading=Reading, fitting=Fitting, placing=Workers(None))
@opt.option_of("amplitude", _AMPLITUDE)
@opt.given("-o", "--output", required=True, metavar="FOLDER", help="Write models and tables into this folder.")
def identify_many(sources: tuple[str, ...], output: str, placing: Workers, **options: Any) -> None:
    """Of a folder, the files in it that are named like records (.csv, .txt, .xlsx, ...) are taken, not those in folders
    within it. FOLDER gets NAME.json for each spring, and springs.csv and springs.parquet with one row for each file.
    The same command again, also after an interrupt, identifies only files that are new or have changed.

    Exit status: 0 if all are identified, 1 if some are not.

    \b
    Examples:
      strandspring identify-many monday/ -o models
      strandspring identify-many monday/*.csv -o models --force-unit kN
      strandspring identify-many monday/ -o models --amplitude 20 --workers 4
    """
    from ..campaigns.batches.sources import COLUMNAR_TABLE, JOURNAL

    with out.reporting("files", Path(output) / JOURNAL) as progress:
        many = strandspring.identify_many(
            sources, output, placing=placing.notifying(out.note), progress=progress, **options
        )
    if many.batch.columnar_table is None:
        out.note(
            f'{COLUMNAR_TABLE} needs pyarrow and was not written; install it with pip install "strandspring[formats]".'
        )
    out.present(many, table=("Table", many.batch.table))
    if many.problem:
        click.echo(f"strandspring: {many.problem}", err=True)
        sys.exit(1)
