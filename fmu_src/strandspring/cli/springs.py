"""From records to springs: `show`, `identify` and others; and what springs are, beside records: `info` and others."""

from __future__ import annotations

import sys
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import strandspring

from ..api.options import Comparing, Fitting, Sampling
from ..campaigns.jobs.options import Workers
from ..campaigns.planning.limits import Limits
from ..findings import Outcome
from ..ground.files import user_cache
from ..ground.options import Option
from ..loops.reading import Reading
from ..model.names import check_name, identifier
from ..report import ReportDetails, check_report_path
from . import options as opt
from . import output as out

if TYPE_CHECKING:
    from ..records.record import Record

_FINDINGS = 3  # that are printed, the most harmful ones
_STIFFNESS = Option(
    "number", "Instead of a model or a record: the rough stiffness, with --stroke", "N/m", "N/mm", 1e3, least=0.0,
    is_open=True, metavar="N/MM",
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
    with out.reporting("Drawing the page"):
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
             flags="--report", read=check_report_path)  # fmt: skip
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
        with out.reporting("Drawing the report"):
            identification.report(report, name, details, description)
    if figure is not None:
        write_figure(figure, identification)
    out.present(identification, {"name": name}, _FINDINGS)


def identified(records: tuple[str, ...], reading: Reading, fitting: Fitting) -> strandspring.Identification:
    """Read the records and identify the spring."""
    from ..identification.method import heard_by

    group = opt.read_records(records, reading)
    with out.reporting("Identifying") as show, heard_by(lambda stage: show(f"Identifying: {stage.words}")):
        return strandspring.identify(group, fitting=fitting)


@opt.command(sources="FILE|FOLDER...")
@opt.takes_options(reading=Reading, fitting=Fitting, placing=Workers(None))
@opt.amplitude_option("Amplitude at which stiffness, energy and loss factor are compared",
                      "the largest that all springs have in common", "Output")  # fmt: skip
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

    with out.reporting(noun="files", journal=Path(output) / JOURNAL) as progress:
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


@opt.command(model="MODEL.json|X.fmu", records="[RECORD...]")
@opt.amplitude_option("Amplitude of a loop about the offset", "those of the records, or quarters of the range",
                      several=True)  # fmt: skip
@opt.zero_option
@opt.takes_options(reading=Reading)
@opt.written("MODEL.json", "Write the model file, as out of an FMU.", "Model file", "saved", flags="--save")
def info(model: str, records: tuple[str, ...], save: str | None, reading: Reading, **options: Any) -> None:
    """For each amplitude: secant stiffness between the turning points, energy absorbed per cycle W, loss factor
    W/(2 pi Ws) with Ws = secant stiffness * amplitude^2 / 2, and with --verbose the damping ratio (half of that) and
    forces. Several records also show whether the force depends on frequency, and whether loading paths overlap.

    Of the FMU of a system it shows the candidate and its variables, where the bodies rest, and the natural modes.

    \b
    Examples:
      strandspring info spring.json
      strandspring info dist/spring.fmu --save spring.json
      strandspring info spring.json a13.csv a46.csv --json
    """
    from ..api.common.model_source import describes_system
    from ..model.modelfile import load_model, save_model

    if save is not None:
        save_model(save, load_model(model))
    group = opt.read_records(records, reading, [model])
    with out.reporting("Measuring loops"):
        information: Any = strandspring.info(model, *group, **options)
    out.present(information, {"system" if describes_system(model) else "model": model})


@opt.command(model="MODEL.json", records="RECORD...")
@opt.takes_options(reading=Reading)
@opt.written("OUT.csv", "Write displacement, measured and predicted force here.", "Prediction", method="save_csv")
def predict(model: str, records: tuple[str, ...], reading: Reading) -> None:
    """The hysteretic state at the start of a measured record is unknown; it is estimated as one bounded number,
    omega_start, and reported. OUT.csv holds the ends of the 95 % prediction interval, too, if the model file has one,
    as after the refined method.

    \b
    Examples:
      strandspring predict spring.json other.csv
      strandspring predict spring.json a13.csv a46.csv -o predicted.csv --json
    """
    group = opt.read_records(records, reading, [model])
    with out.reporting("Predicting"):
        prediction = strandspring.predict(model, group)
    out.present(prediction, {"model": model})


@opt.command(a="A.json", b="B.json", records="[RECORD...]")
@opt.takes_options(comparing=Comparing, reading=Reading)
@opt.plot_option("Plot loops, stiffness, energy and loss factor")
def compare(a: str, b: str, records: tuple[str, ...], comparing: Comparing, reading: Reading) -> None:
    """Parameters, figures of loops and transmissibility are compared over the range that both share, and judged by the
    uncertainty in the model files, all together at the 5 % level; z is the difference over its standard deviation. With
    records: which of both follows each one better.

    \b
    Examples:
      strandspring compare new.json worn.json
      strandspring compare lot1.json lot2.json loop.csv --mass 5 --plot lots.png
    """
    group = opt.read_records(records, reading, [a, b])
    with out.reporting("Comparing"):
        comparison = strandspring.compare(a, b, group, comparing=comparing)
    out.present(comparison)


@opt.command(sources="[MODEL.json | X.fmu | RECORD...]")
@opt.option_of("stiffness", _STIFFNESS, group="Rig")
@opt.takes_options(limits=Limits, reading=Reading)
@opt.written("PROGRAM.csv", "Write the programme: time [s], displacement [mm].", "Programme", "program", "save_csv")
@opt.plot_option("Plot the programme")
def plan(sources: tuple[str, ...], stiffness: float | None, limits: Limits, reading: Reading) -> None:
    """From a model file with its uncertainty, from a first record, which is identified on the way, or from a rough
    stiffness and stroke. Blocks are chosen one after the other for the most that they decide in their time. Each row
    says what a block decides most: half of the 95 % interval before and after it, in % of the value.

    \b
    Examples:
      strandspring plan spring.json --velocity 50 -o program.csv
      strandspring plan loop.csv --velocity 50 --duration 120 -o program.csv
      strandspring plan --stiffness 20 --stroke -20:20 -o program.csv
    """
    from ..model.modelfile import is_model_path, load_model

    if not sources or (len(sources) == 1 and is_model_path(sources[0])):
        opt.read_records((), reading)
        source: Any = load_model(sources[0]) if sources else None
    else:
        source = identified(sources, reading, Fitting())
        out.remark(source.sentences)
    with out.reporting("Planning"):
        test = strandspring.plan(source, stiffness=stiffness, limits=limits)
    out.present(test)


@click.group()
def synthesize() -> None:
    """Compute records: a spring's response, or the paper's experiment."""


@opt.command(synthesize, flags=(), model="MODEL.json")
@opt.amplitude_option("Amplitude of the sine", "the identified range", several=True)
@opt.takes_options(sampling=Sampling)
@opt.written("RECORD.csv", "Record to write.", "Record", is_required=True)
def spring(model: str, output: str, amplitudes: tuple[float, ...] | None, sampling: Sampling) -> None:
    """Compute the record of a model's spring under sinusoidal displacement.

    \b
    Example:
      strandspring synthesize spring spring.json --noise 0.03 -o loop.csv
    """
    from ..model.modelfile import load_model

    record = strandspring.synthesize(load_model(model), amplitudes, sampling=sampling)
    out.remark_on(replace(record, path=output).found)
    _write(output, record)


@opt.command(synthesize, flags=())
@opt.amplitude_option("X of x = X sin(t)", "5")
@opt.takes_options(sampling=Sampling)
@opt.written("RECORD.csv", "Record to write.", "Record", is_required=True)
@opt.written("FILE.csv", "Also write the record without noise.", "Without noise", "clean", flags="--clean")
def ni(output: str, clean: str | None, amplitude: float | None, sampling: Sampling) -> None:
    """Compute the paper's simulated experiment: Ni's model in its steady state under x = X sin(t).

    The record holds whole periods without their closing sample; the periods before the steady state are omitted.

    \b
    Examples:
      strandspring synthesize ni -o table1.csv --clean true.csv
    """
    record = strandspring.synthesize("ni", amplitude, sampling=sampling)
    _write(output, record)
    if clean is not None:
        strandspring.synthesize("ni", amplitude, sampling=replace(sampling, noise=0.0)).save(Path(clean), "mm")
        click.echo(f"Without noise: {clean}")


def _write(output: str, record: Record) -> None:
    noise = [finding.numbers for finding in record.findings if finding.kind is Outcome.NOISE]
    facts = [f"{len(record)} samples", *("noise level {noise:g}, seed {seed}".format(**of) for of in noise)]
    record.save(output, "mm")
    click.echo(f"Record: {output} ({', '.join(facts)})")
