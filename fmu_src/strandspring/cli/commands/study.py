"""`strandspring study`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click
import numpy as np

from ...api.studies.studying import StudyResult
from ...api.studies.studying import study as studied
from ...api.studies.system_studying import SystemStudyResult, study_system
from ...campaigns.studies.definition import STIFFNESS_FACTORS
from ...campaigns.studies.journal import journal_path
from ..shared.descriptions import is_system
from ..shared.mount import EXCITATIONS, chosen_levels, curve_options, level_options, mount_options, positive
from ..shared.options import FiniteRange, cluster_option, worker_options
from ..shared.output import note, reporting, result, result_json, terminal_width
from ..shared.paths import refuse_overwriting
from ..shared.study_system import json_of, quantiles_json, refuse_wrong_options, system_options, varied_paths
from ..shared.zero import zero_option

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
@click.argument("model", metavar="MODEL.json|SYSTEM.toml")
@click.option(
    "--mass",
    type=_grid(positive("kg")),
    multiple=True,
    metavar="KG",
    help=f"Mass on the mount [kg]; {_SEVERAL}; required with a model.",
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
    help="Springs drawn from the model's uncertainty at each grid point; 0 for the identified spring alone.  "
    "[default: 100, or what SYSTEM.toml says]",
)
@click.option("--seed", type=click.IntRange(min=0), help="Seed of the draws.  [default: 0, or what SYSTEM.toml says]")
@mount_options
@zero_option
@curve_options(points=24)
@system_options
@worker_options
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="RESULTS.csv",
    help="Write one line for each run to this file.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
@click.pass_context
def study(
    context: click.Context,
    /,
    model: str,
    workers: int | None,
    output: str,
    plot: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Run a parameter study of `isolate` for a model file, or of `simulate` for a SYSTEM.toml.

    Of a model file, every grid point (mass, level, stiffness factor) is run with every spring drawn from the joint
    uncertainty of all coefficients in the model file. Of a SYSTEM.toml, --vary gives values of the file: keys with dots
    between them lead to one, names or numbers choose an entry of a list, and * takes all of them; numbers carry a unit
    or are in SI, and percent are of what the file says. "mount.NAME.places" is how many of the places have a mount,
    from the first on. Every grid point is simulated with every candidate, load case and draw.

    Draw k of a seed is the same spring in every study. A refused run, for instance one whose motion leaves the
    identified range, is a line with the reason. Finished runs are kept in RESULTS.csv.part.jsonl until all are done;
    the same command continues from there.

    \b
    Examples:
      strandspring study spring.json --mass 5 --base-displacement 0.5 -o study.csv
      strandspring study spring.json --mass 4:8:5 --draws 0 -o grid.csv
      strandspring study spring.json --mass 5 --stiffness 0.9:1.1:3 -o s.csv
      strandspring study spring.json --mass 5 --scheduler tls://host:8786 -o s.csv
      strandspring study box.toml --vary 'body.box.mass=15 kg:25 kg:5' -o s.csv
      strandspring study box.toml --vary 'mount_type.*.axes.*.series=1,2' -o p.csv
      strandspring study box.toml --vary mount.corner.places=3,4 -o m.csv
    """
    refuse_wrong_options(context, model)
    scheduler = cluster_option(workers, options)
    outputs: dict[str, str | Path | None] = {
        "--output": output,
        "--output's journal": journal_path(Path(output)),
        "--plot": plot,
    }
    refuse_overwriting([model], outputs, ".csv")
    of_system = {name: options.pop(name) for name in ("vary", "cases", "candidates", "step")}
    of_both: dict[str, Any] = {name: options.pop(name) for name in ("draws", "seed")}
    kept: tuple[float, int] = (0, 0)
    found: StudyResult | SystemStudyResult
    try:
        with reporting() as show:

            def progress(task: str, runs: float, total: int) -> None:
                nonlocal kept
                if runs and not kept[1]:
                    note(f"{runs} of {total} runs were finished before.")
                kept = runs, total
                show(task, runs, total)

            where: dict[str, Any] = {
                "output": output, "workers": workers, "scheduler": scheduler, "progress": progress, "notify": note,
            }  # fmt: skip
            if is_system(model):
                vary = varied_paths(of_system.pop("vary"))
                chosen: dict[str, Any] = {name: value or None for name, value in of_system.items()}
                found = study_system(model, vary, **chosen, **of_both, **where)
            else:
                given = {name: value for name, value in of_both.items() if value is not None}
                found = _of_model(model, options, **given, **where)
    except KeyboardInterrupt:
        if kept[0]:
            note(
                f"{kept[0]} of {kept[1]} runs are kept in {journal_path(Path(output))}; the same command continues "
                "from there."
            )
        raise
    if isinstance(found, SystemStudyResult):
        if plot is not None:
            found.save_plot(plot)
        content = {"system": model, **json_of(found), "output": output, "plot": plot}
    else:
        content = {"zero": found.zero, **_json(model, found, output)}
    if as_json:
        result_json(content)
        return
    result("\n".join(found.lines(terminal_width())))
    result(f"Results: {output}")
    if plot is not None:
        result(f"Plot: {plot}")


def _of_model(model: str, options: dict[str, Any], **others: Any) -> StudyResult:
    """The study of one mass, with the command's options."""
    chosen = chosen_levels({kind: _flat(options.pop(kind)) for kind in EXCITATIONS})
    given: dict[str, Any] = {} if chosen is None else {chosen[0].value.replace(" ", "_"): chosen[1]}
    masses, stiffness = _flat(options.pop("mass")), _flat(options.pop("stiffness")) or 1.0
    return studied(model, masses, **given, stiffness=stiffness, **options, **others)


def _flat(given: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    return tuple(value for values in given for value in values)


def _json(model: str, found: StudyResult, output: str) -> dict[str, Any]:
    planned = found.study
    return {
        "model": model,
        "runs": len(planned),
        "draws": planned.draws,
        "seed": planned.seed,
        "excitation": planned.excitation.value,
        "unit": planned.excitation.unit,
        "cautions": found.cautions,
        "points": [
            {
                **asdict(summary.point),
                "runs": summary.runs,
                "refused": summary.refused,
                "reason": summary.reason,
                "at_end_of_band": summary.at_end,
                "extrapolating": summary.extrapolating,
                "figures": quantiles_json(summary.figures),
            }
            for summary in found.summaries
        ],
        "output": output,
    }
