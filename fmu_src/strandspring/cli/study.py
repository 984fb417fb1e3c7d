"""`strandspring study`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click
import numpy as np

from ..api.cautions import outside_range
from ..coordinates import counted_from, zero_sentence
from ..core.parameters import SpringParameters
from ..errors import ModelError
from ..isolation.system import Excitation, IsolatedMass, static_equilibrium
from ..modelfile import ModelFile, load_model
from ..studies.cluster import Cluster
from ..studies.definition import STIFFNESS_FACTORS, Study
from ..studies.journal import journal_path
from ..studies.quantiles import GridPointSummary
from ..studies.run import run_study
from ..studies.runners import Local, Runner
from ..studies.spread import Spread
from .mount import EXCITATIONS, chosen_levels, curve_options, level_options, mount_options, positive, shares_of_room
from .options import FiniteRange
from .output import advancing, note, result, result_json, result_table
from .paths import refuse_overwriting
from .zero import origin_of, zero_option

# Heading: figure, factor from SI to the unit of the heading.
_COLUMNS = {
    "resonance Hz": ("frequency", 1.0),
    "transmissibility": ("transmissibility", 1.0),
    "amplitude mm": ("amplitude", 1e3),
    "loss factor": ("loss_factor", 1.0),
    "isolates from Hz": ("isolation_frequency", 1.0),
}
_QUANTILES = {"median": "median", "5 %": "low", "95 %": "high"}
_DEFAULT_SHARE = 0.01  # see `shares_of_room`
_MOST_VALUES = 10_000  # of one LOW:HIGH:COUNT


def _grid(one: FiniteRange) -> Callable[[str], tuple[float, ...]]:
    """The type of a grid option: a number within a range, or LOW:HIGH:COUNT."""

    def values(text: str) -> tuple[float, ...]:
        low, *rest = text.split(":")
        if not rest:
            return (one.convert(low, None, None),)
        if len(rest) != 2 or not rest[1].isdecimal() or not 2 <= int(rest[1]) <= _MOST_VALUES:
            raise click.BadParameter(
                f"{text!r} is neither a number nor LOW:HIGH:COUNT with COUNT from 2 to {_MOST_VALUES}."
            )
        first, last = (one.convert(end, None, None) for end in (low, rest[0]))
        return tuple(np.linspace(first, last, int(rest[1])).tolist())

    return values


_SEVERAL = "repeat, or give LOW:HIGH:COUNT, for more"


@click.command()
@click.argument("model", metavar="MODEL.json")
@click.option(
    "--mass",
    type=_grid(positive("kg")),
    multiple=True,
    required=True,
    metavar="KG",
    help=f"Mass on the mount [kg]; {_SEVERAL}.",
)
@level_options(_grid, _SEVERAL, "  [default: 1 % of the free travel under the smallest mass]")
@click.option(
    "--stiffness",
    type=_grid(FiniteRange(*STIFFNESS_FACTORS)),
    multiple=True,
    metavar="FACTOR",
    help=f"Factor on all forces of the spring (FE and kappa_omega); {_SEVERAL}.  [default: 1]",
)
@click.option(
    "--draws",
    type=click.IntRange(0, 1_000_000),
    default=100,
    show_default=True,
    help="Springs drawn from the model's uncertainty at each grid point; 0 for the identified spring alone.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of the draws.")
@mount_options
@zero_option
@curve_options(points=24)
@click.option(
    "--workers",
    type=click.IntRange(1, 1024),
    metavar="N",
    help="Number of processes; 1 for none besides this one.  [default: all cores]",
)
@click.option(
    "--scheduler", metavar="tcp://HOST:PORT", help="Run on the cluster of this dask.distributed scheduler instead."
)
@click.option("-o", "--output", required=True, metavar="RESULTS.csv", help="Write one line for each run to this file.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
def study(
    model: str,
    mass: tuple[tuple[float, ...], ...],
    stiffness: tuple[tuple[float, ...], ...],
    draws: int,
    seed: int,
    band: tuple[float, float] | None,
    points: int,
    extrapolate: bool,
    workers: int | None,
    scheduler: str | None,
    output: str,
    zero: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Run a parameter study of resonance and isolation.

    Every grid point (mass, level, stiffness factor) is run with every spring drawn from the standard errors and
    correlations of kappa_omega, rho, sigma and n in the model file. Draw k of a seed is the same spring in every study.
    A refused run, for instance one whose motion leaves the identified range, is a line with the reason. Finished runs
    are kept in RESULTS.csv.part.jsonl until all are done; the same command continues from there.

    \b
    Examples:
      strandspring study spring.json --mass 5 --base-displacement 0.5 -o study.csv
      strandspring study spring.json --mass 4:8:5 --draws 0 -o grid.csv
      strandspring study spring.json --mass 5 --stiffness 0.9:1.1:3 -o s.csv
      strandspring study spring.json --mass 5 --scheduler tcp://host:8786 -o s.csv
    """
    chosen = chosen_levels({kind: _flat(options.pop(kind)) for kind in EXCITATIONS})
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers and --scheduler exclude each other; give one of them.")
    refuse_overwriting([model], {"--output": output, "--output's journal": journal_path(Path(output))})
    content = load_model(model)
    origin = origin_of(model, zero, content.parameters)
    spring = counted_from(origin, content.parameters)
    if chosen is None:
        lightest = IsolatedMass(spring, min(_flat(mass)), **options)
        amplitudes = shares_of_room(lightest, static_equilibrium(lightest), [_DEFAULT_SHARE])
        chosen = Excitation.BASE_DISPLACEMENT, amplitudes
    planned = Study(
        spring=spring,
        excitation=chosen[0],
        masses=_flat(mass),
        levels=tuple(chosen[1]),
        stiffness_factors=_flat(stiffness) or (1.0,),
        draws=draws,
        seed=seed,
        spread=_spread(model, spring, content) if draws else None,
        band=band,
        points=points,
        extrapolate=extrapolate,
        **options,
    )
    summaries = _run(planned, Path(output), Local(workers) if scheduler is None else Cluster(scheduler, note))
    if as_json:
        result_json({"zero": origin, **_json(model, planned, summaries, output)})
        return
    _print_summaries(planned, summaries)
    if sentence := zero_sentence(origin):
        result(sentence)
    result(f"Results: {output}")


def _flat(given: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    return tuple(value for values in given for value in values)


def _spread(path: str, spring: SpringParameters, content: ModelFile) -> Spread:
    try:
        return Spread.of(spring, content.uncertainty)
    except ModelError as problem:
        raise ModelError(f"{path}: {problem}") from None


def _run(planned: Study, output: Path, runner: Runner) -> list[GridPointSummary]:
    """Run the study with a progress bar; an interrupt says how many runs are kept."""
    finished: int | None = None

    try:
        with advancing("Running", len(planned)) as advance:

            def progress(runs: int) -> None:
                nonlocal finished
                if finished is None and runs:
                    note(f"{runs} of {len(planned)} runs were finished before.")
                finished = runs
                advance(runs)

            return run_study(planned, output, runner, progress, note)
    except KeyboardInterrupt:
        if finished:
            note(
                f"{finished} of {len(planned)} runs are kept in {journal_path(output)}; the same command continues "
                "from there."
            )
        raise


def _json(model: str, planned: Study, summaries: list[GridPointSummary], output: str) -> dict[str, Any]:
    return {
        "model": model,
        "runs": len(planned),
        "draws": planned.draws,
        "seed": planned.seed,
        "excitation": planned.excitation.value,
        "unit": planned.excitation.unit,
        "points": [
            {
                **asdict(summary.point),
                "runs": summary.runs,
                "refused": summary.refused,
                "reason": summary.reason,
                "at_end_of_band": summary.at_end,
                "extrapolating": summary.extrapolating,
                "figures": {
                    name: None if q is None else {"q05": q.low, "median": q.median, "q95": q.high}
                    for name, q in summary.figures.items()
                },
            }
            for summary in summaries
        ],
        "output": output,
    }


def _print_summaries(planned: Study, summaries: list[GridPointSummary]) -> None:
    springs = f"{planned.draws} draws (seed {planned.seed})" if planned.draws else "the identified spring"
    refused = sum(summary.refused for summary in summaries)
    result(f"{len(planned)} runs: {springs} at each of {len(summaries)} grid points, {refused} refused")
    rows = []
    for summary in summaries:
        point = [*_point(planned.excitation, summary), str(summary.refused)]
        for title, quantile in (_QUANTILES if planned.draws else {"": "median"}).items():
            figures = [_cell(summary, name, scale, quantile) for name, scale in _COLUMNS.values()]
            rows.append([*(point if quantile == "median" else [""] * len(point)), title, *figures])
    result_table(["mass kg", "level", "stiffness", "refused", "", *_COLUMNS], rows)
    for summary in summaries:
        mass, level, stiffness = _point(planned.excitation, summary)
        where = f"{mass} kg, {level}, stiffness x {stiffness}"
        if summary.refused:
            result(f"  {where}: {summary.refused} of {summary.runs} refused, most often: {summary.reason}")
        if summary.at_end:
            result(f"  {where}: {summary.at_end} of {summary.runs} have their peak at an end of the band")
        if summary.extrapolating:
            result(
                f"  Caution: {where}: in {summary.extrapolating} of {summary.runs} the spring moves "
                f"{outside_range(planned.spring)}"
            )


def _point(excitation: Excitation, summary: GridPointSummary) -> list[str]:
    point = summary.point
    return [f"{point.mass:g}", excitation.level_text(point.level), f"{point.stiffness_factor:g}"]


def _cell(summary: GridPointSummary, name: str, scale: float, quantile: str) -> str:
    quantiles = summary.figures[name]
    return "-" if quantiles is None else f"{scale * getattr(quantiles, quantile):.4g}"
