"""`strandspring isolate`, `simulate` and `study`: masses and bodies on springs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

import strandspring

from ..campaigns.jobs.options import Workers
from ..ground.files import refuse_unwritable
from ..ground.options import Option, refuse_given
from ..report import check_report_path
from ..vibration.one_mass.options import Curve, Levels, Mount
from ..vibration.options import Part, Run, StudyRun
from . import options as opt
from .output import is_asked, note, present, refuse_overwriting, reporting

_FACTORS = Option(
    "numbers", "Of a model: factor on all forces of the spring (FE and kappa_omega)", least=1e-6, most=1e6,
    otherwise="1", metavar="FACTOR",
)  # fmt: skip
_report_option: opt.Decorator = opt.written(
    "FILE.html", "Of a system: write a report.", "Report", "report", "report", "--report", read=check_report_path
)


@opt.command(models="MODEL.json...|SYSTEM.toml")
@opt.mass_option("Mass on the mount; required with models")
@opt.takes_options(mount=Mount)
@opt.zero_option
@opt.takes_options(levels=Levels)
@opt.given("--candidate", "candidates", multiple=True, metavar="NAME", group="System",
           help="Of a SYSTEM.toml: compute only this candidate; repeat for more.")  # fmt: skip
@opt.takes_options(curve=Curve)
@opt.given("--verify", is_flag=True,
           help="Of models: build the FMU, and compare its motion at three frequencies of each level.")  # fmt: skip
@opt.written("OUT.csv", "Write all figures to this file.", "Curves", method="save_csv")
@opt.plot_option("Plot the curves of all models")
@_report_option
def isolate(models: tuple[str, ...], verify: bool, candidates: tuple[str, ...], **options: Any) -> None:
    """Of a SYSTEM.toml, which describes rigid bodies on mounts, compute it in all degrees of freedom, with rotations to
    the second order and the natural modes, for all its candidates.

    The steady response is found by harmonic balance and followed through folds; between two folds it is unstable (drawn
    dotted). Transmissibility is that of the first harmonic: of motion or, with --force, of force on the base.

    \b
    Examples:
      strandspring isolate spring.json --mass 5
      strandspring isolate old.json new.json --mass 5 --plot compared.png
      strandspring isolate spring.json --mass 5 --force 10 --band 2 50 -o c.csv
      strandspring isolate box.toml --direction z --base-displacement 0.5
    """
    from ..api.common.model_source import OF_MODELS, OF_SYSTEMS, is_system

    is_of_system = is_system(models[0])
    others = {"verify": verify} if is_of_system else {"report": is_asked("report")}
    refuse_given(f"{OF_MODELS}; leave it out." if is_of_system else OF_SYSTEMS, models[0], **others)
    with reporting() as progress:
        isolation: Any = strandspring.isolate(models, candidates=candidates or None, **options, progress=progress)
        if verify:
            isolation = replace(isolation, checked=isolation.verify(progress))
    present(isolation, {"system": isolation.source} if is_of_system else {})


@opt.command(system="SYSTEM.toml")
@opt.takes_options(part=Part, run=Run)
@opt.given("--workers", type=click.IntRange(1, 1024), metavar="N", group="Simulation",
           help="Number of threads.  [default: all cores]")  # fmt: skip
@opt.written("OUT.csv", "Write all figures to this file.", "Figures", method="save_csv")
@_report_option
@opt.plot_option("Plot acceleration against stroke, with verdicts")
@opt.given("--histories", metavar="FOLDER",
           help="Write the motion over time of each candidate in each case into this folder, as CSV.")  # fmt: skip
def simulate(system: str, histories: str | None, part: Part, run: Run, workers: int | None) -> None:
    """SYSTEM.toml describes rigid bodies on mounts, mounts to choose from (candidates), limits and load cases;
    `python -m strandspring.examples.system_models FOLDER` writes examples. Each case is run with the springs as
    identified, and then as often as --draws says with all that is unknown drawn. Figures are ranges over these.

    A candidate passes a case if all ranges are within their limits, and fails if one is beyond; it is "not decided" if
    a limit lies within a range. These are results, with exit status 0; it is 1 if nothing could be simulated.

    \b
    Examples:
      strandspring simulate box.toml
      strandspring simulate box.toml --case shock --candidate softer
      strandspring simulate box.toml --draws 200 -o figures.csv
      strandspring simulate box.toml --report box.html --plot sheet.png
    """
    from ..vibration.description.system_file import load_system_file

    file = load_system_file(system)
    refuse_overwriting(file.files)
    if histories is not None:
        refuse_unwritable(Path(histories), is_folder=True)
    with_courses = is_asked("json") or is_asked("report") or histories is not None
    with reporting() as progress:
        simulation = strandspring.simulate(
            file, part.cases, part.candidates, run=run, workers=workers, courses=with_courses, progress=progress
        )
    courses = () if histories is None else simulation.save_histories(histories)
    present(simulation, {"file": system, "histories": [str(path) for path in courses]})
    if courses and not is_asked("json"):
        click.echo(f"Histories: {len(courses)} files in {histories}")


def _varied(_context: click.Context, _option: click.Parameter, given: tuple[str, ...]) -> dict[str, str] | None:
    """Paths with their values; raises click.UsageError if one is not of this form, or given twice."""
    varied: dict[str, str] = {}
    for text in given:
        name, equals, values = (part.strip() for part in text.partition("="))
        if not (name and equals and values):
            raise click.UsageError(f"--vary must be PATH=VALUES, such as 'body.box.mass=15 kg:25 kg:5', got {text!r}.")
        if name in varied:
            raise click.UsageError(f"--vary {name} is given twice; give all its values in one list with commas.")
        varied[name] = values
    return varied or None


@opt.command(model="MODEL.json|SYSTEM.toml")
@opt.mass_option("Mass on the mount; required with a model", several=True)
@opt.takes_options(levels=Levels)
@opt.option_of("stiffness", _FACTORS, group="Mount")
@opt.takes_options(mount=Mount)
@opt.zero_option
@opt.takes_options(curve=Curve(points=24), run=StudyRun)
@opt.given("--vary", multiple=True, metavar="PATH=VALUES", callback=_varied, group="System",
           help="Of a SYSTEM.toml: a value of it, such as body.box.mass, and LOW:HIGH:COUNT or a list with commas, "
           "such as '15 kg:25 kg:5'; repeat for a grid.")  # fmt: skip
@opt.takes_options(part=Part, placing=Workers(None))
@opt.written("RESULTS.csv", "Write one line for each run to this file.", "Results", is_required=True, read=str)
@opt.plot_option("Of a SYSTEM.toml: plot acceleration against stroke, with verdicts")
def study(model: str, output: str, stiffness: tuple[float, ...] | None, placing: Workers, **options: Any) -> None:
    """Of a model file, every grid point (mass, level, stiffness factor) is run with every spring drawn from the joint
    uncertainty of all coefficients in the model file. Of a SYSTEM.toml, every grid point of --vary is simulated with
    every candidate in every load case; keys with dots between them lead to a value, names or numbers choose an entry of
    a list, and * takes all.

    A refused run, for instance one whose motion leaves the identified range, is a line with the reason. Finished runs
    are kept in RESULTS.csv.part.sqlite until all are done; the same command continues from there.

    \b
    Examples:
      strandspring study spring.json --mass 5 --base-displacement 0.5 -o study.csv
      strandspring study spring.json --mass 4:8:5 --draws 0 -o grid.csv
      strandspring study spring.json --mass 5 --stiffness 0.9:1.1:3 -o s.csv
      strandspring study box.toml --vary 'body.box.mass=15 kg:25 kg:5' -o s.csv
      strandspring study box.toml --vary mount.corner.places=3,4 -o m.csv
    """
    from ..api.common.model_source import OF_SYSTEMS, is_system
    from ..campaigns.studies.journal import journal_path

    journal, is_of_system = journal_path(Path(output)), is_system(model)
    if not is_of_system:
        refuse_given(OF_SYSTEMS, model, plot=is_asked("plot"))
    refuse_overwriting([model], {"--output's journal": journal})
    with reporting(noun="runs", journal=journal) as progress:
        studied: Any = strandspring.study(
            model, stiffness=stiffness or 1.0, placing=placing.notifying(note), output=output, progress=progress,
            **options,
        )  # fmt: skip
    present(studied, {"system" if is_of_system else "model": model})
