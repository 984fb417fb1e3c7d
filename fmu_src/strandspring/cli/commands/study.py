"""`strandspring study`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np

from ...api.studies.study_result import StudyResult
from ...api.studies.studying import study as studied
from ...api.studies.system_studying import study_system
from ...campaigns.studies.definition import STIFFNESS_FACTORS
from ...campaigns.studies.journal import journal_path
from ..shared.descriptions import is_system, refuse_mixed
from ..shared.mount import EXCITATIONS, chosen_levels, curve_options, level_options, mount_options, system_options
from ..shared.option_types import FiniteRange, output_options, positive, together
from ..shared.output import note, present, reporting_kept, save
from ..shared.paths import refuse_overwriting
from ..shared.worker_options import cluster_option, worker_options
from ..shared.zero import zero_option

_MOST_VALUES = 10_000  # of one LOW:HIGH:COUNT


def _grid(number_type: FiniteRange) -> Callable[[str], tuple[float, ...]]:
    """The type of a grid option: a number within a range, or LOW:HIGH:COUNT."""

    def values(text: str) -> tuple[float, ...]:
        low, *rest = text.split(":")
        if not rest:
            return (number_type.convert(low, None, None),)
        if len(rest) != 2 or not rest[1].isdecimal() or not 2 <= int(rest[1]) <= _MOST_VALUES:
            raise click.BadParameter(
                f"{text!r} is neither a number nor LOW:HIGH:COUNT with COUNT from 2 to {_MOST_VALUES}."
            )
        first, last = (number_type.convert(end, None, None) for end in (low, rest[0]))
        return tuple(np.linspace(first, last, int(rest[1])).tolist())

    return values


# What the description says, or what is about one spring.
_OF_MODELS = (
    "mass", "base_displacement", "base_acceleration", "force", "stiffness", "load", "parallel", "series", "damping",
    "zero", "band", "points", "extrapolate",
)  # fmt: skip
_OF_SYSTEMS = ("vary", "cases", "candidates", "step", "plot")

_system_options = together(
    click.option("--vary", multiple=True, metavar="PATH=VALUES",
                 help="Of a SYSTEM.toml: a value of it, such as body.box.mass, and LOW:HIGH:COUNT or a list with "
                 "commas, such as '15 kg:25 kg:5'; repeat for a grid."),
    system_options("Of a SYSTEM.toml: "),
)  # fmt: skip
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
    help="Springs drawn from the model's uncertainty at each grid point, 0 for the identified spring alone; of a "
    "SYSTEM.toml draws in each run, as of `simulate`, at least 16.  [default: 100, or what SYSTEM.toml says, or 64]",
)
@click.option("--seed", type=click.IntRange(min=0), help="Seed of the draws.  [default: 0, or what SYSTEM.toml says]")
@mount_options
@zero_option
@curve_options(points=24)
@_system_options
@worker_options
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="RESULTS.csv",
    help="Write one line for each run to this file.",
)
@output_options
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
    uncertainty of all coefficients in the model file. Of a SYSTEM.toml, --vary gives values of the file: keys with
    dots between them lead to one, names or numbers choose an entry of a list, and * takes all of them; numbers carry a
    unit or are in what the file's `units` state, and percent are of what the file says. "mount.NAME.places" is how
    many of the places have a mount, from the first on. Every grid point is simulated with every candidate in every load
    case; each run is a whole answer of `simulate`, and its figures are the upper ends of their ranges.

    Draw k of a seed is the same spring in every study. A refused run, for instance one whose motion leaves the
    identified range, is a line with the reason. Finished runs are kept in RESULTS.csv.part.sqlite until all are done;
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
    instead = "use --vary PATH=VALUES, as in --vary 'body.box.mass=15 kg:25 kg:5'"
    refuse_mixed(context, model, _OF_MODELS, _OF_SYSTEMS, ("mass", "vary"), instead)
    scheduler = cluster_option(workers, options)
    outputs: dict[str, str | Path | None] = {
        "--output": output,
        "--output's journal": journal_path(Path(output)),
        "--plot": plot,
    }
    refuse_overwriting([model], outputs, ".csv")
    of_system = {name: options.pop(name) for name in ("vary", "cases", "candidates", "step")}
    of_both: dict[str, Any] = {name: options.pop(name) for name in ("draws", "seed")}
    written: dict[str, tuple[str, str | None]] = {"output": ("Results", output)}
    study_result: StudyResult
    with reporting_kept("runs", journal_path(Path(output))) as progress:
        where: dict[str, Any] = {
            "output": output, "workers": workers, "scheduler": scheduler, "progress": progress, "notify": note,
        }  # fmt: skip
        if is_system(model):
            vary = _varied_paths(of_system.pop("vary"))
            chosen: dict[str, Any] = {name: value or None for name, value in of_system.items()}
            study_result = study_system(model, vary, **chosen, **of_both, **where)
            written["plot"] = ("Plot", plot)
        else:
            given = {name: value for name, value in of_both.items() if value is not None}
            study_result = _of_model(model, options, **given, **where)
    save(study_result, None, plot)
    kind = "system" if is_system(model) else "model"
    present(
        as_json,
        lambda: {kind: model, **study_result.as_json()},
        study_result.brief,
        study_result.text_lines,
        study_result.said,
        **written,
    )


def _of_model(model: str, options: dict[str, Any], **others: Any) -> StudyResult:
    """The study of one mass, with the command's options."""
    levels = chosen_levels({kind: _flat(options.pop(kind)) for kind in EXCITATIONS})
    masses, stiffness = _flat(options.pop("mass")), _flat(options.pop("stiffness")) or 1.0
    return studied(model, masses, **levels, stiffness=stiffness, **options, **others)


def _flat(given: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    return tuple(value for values in given for value in values)


def _varied_paths(given: tuple[str, ...]) -> dict[str, str]:
    """Paths with their values; raises click.UsageError if one is not of this form, or given twice."""
    varied: dict[str, str] = {}
    for text in given:
        name, equals, values = (part.strip() for part in text.partition("="))
        if not (name and equals and values):
            raise click.UsageError(f"--vary must be PATH=VALUES, such as 'body.box.mass=15 kg:25 kg:5', got {text!r}.")
        if name in varied:
            raise click.UsageError(f"--vary {name} is given twice; give all its values in one list with commas.")
        varied[name] = values
    return varied
