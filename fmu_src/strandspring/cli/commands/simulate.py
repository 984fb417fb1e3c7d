"""`strandspring simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ...api.vibration.simulating import simulate as simulated
from ...ground.files import refuse_unwritable
from ...report.rendering.report_path import SUFFIXES, check_report_path
from ...vibration.description.system_file import load_system_file
from ...vibration.description.system_tables import MOST_DRAWS
from ...vibration.verdicts.draws import LEAST_DRAWS
from ..shared.mount import system_options
from ..shared.option_types import output_options
from ..shared.output import present, reporting, result, save
from ..shared.paths import FileNamed, FileOfFormat, refuse_overwriting


@click.command()
@click.argument("system", metavar="SYSTEM.toml")
@system_options()
@click.option(
    "--draws",
    type=click.IntRange(LEAST_DRAWS, MOST_DRAWS),
    metavar="N",
    help="Draws of all that is unknown (omega at rest, springs, mounts), for the ranges of the figures; of random "
    "vibration a quarter of them.  [default: the file's, or 64]",
)
@click.option("--seed", type=click.IntRange(min=0), help="Seed of the draws.  [default: the file's, or 0]")
@click.option("--workers", type=click.IntRange(1, 1024), metavar="N", help="Number of threads.  [default: all cores]")
@click.option("--report", type=FileOfFormat(*SUFFIXES), metavar="FILE.html", help="Write a report (.html or .pdf).")
@click.option(
    "--histories",
    metavar="FOLDER",
    help="Write the motion over time of each candidate in each case to a CSV file in this folder; such a file may have "
    "tens of megabytes.",
)
@click.option(
    "-o", "--output", type=FileNamed(".csv"), metavar="OUT.csv", help="Write all figures of all cases to this file."
)
@output_options
def simulate(
    system: str,
    cases: tuple[str, ...],
    candidates: tuple[str, ...],
    report: str | None,
    plot: str | None,
    histories: str | None,
    output: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Simulate bodies on mounts under shock and vibration.

    SYSTEM.toml describes rigid bodies on mounts of identified springs, the mounts to choose from (candidates), limits
    and load cases; `python -m strandspring.examples.system_models FOLDER` writes examples. Each case is run with the
    springs as identified, and then as often as --draws says with all that is unknown drawn: where hysteresis leaves
    each axis at rest, springs by the uncertainty of their model files, scatter of mounts, realisations of random
    vibration. Figures are printed as ranges over these, with the numerical error and cautions that have a size.

    The verdict on a candidate in a case is "pass" (all ranges are within their limits), "fail" (a range is beyond its
    limit), "not decided" (a limit lies within a range), "outside" (a spring leaves its identified range, so that all
    figures are extrapolated), "refused" (it cannot be simulated, or most draws cannot) or "no limits" (none applies).
    On all cases together it is the worst of these, or "not tested" if no case tests some limit. All of these are
    results, with exit status 0; the status is 1 if nothing could be simulated, or there is no case.

    \b
    Examples:
      strandspring simulate box.toml
      strandspring simulate box.toml --case shock --candidate softer
      strandspring simulate box.toml --draws 200 -o figures.csv
      strandspring simulate box.toml --report box.html --plot sheet.png
    """
    file = load_system_file(system)
    refuse_overwriting([system, *file.files], {"--output": output, "--report": report, "--plot": plot}, ".csv")
    if report is not None:
        check_report_path(report)
    if histories is not None:
        refuse_unwritable(Path(histories), is_folder=True)
    with_courses = as_json or report is not None or histories is not None
    with reporting() as progress:
        simulation = simulated(
            file, cases or None, candidates or None, **options, courses=with_courses, progress=progress
        )
    save(simulation, output, plot, report)
    courses = () if histories is None else simulation.save_histories(histories)
    present(
        as_json,
        lambda: {"file": system, **simulation.as_json(), "histories": [str(path) for path in courses]},
        simulation.brief,
        simulation.text_lines,
        simulation.said,
        output=("Figures", output),
        report=("Report", report),
        plot=("Plot", plot),
    )
    if histories is not None and not as_json:
        result(f"Histories: {len(courses)} files in {histories}")
