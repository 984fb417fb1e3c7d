"""`strandspring study SYSTEM.toml`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import click

from ...api.studies.system_studying import SystemStudyResult
from ...model.spread import Quantiles
from .descriptions import refuse_mixed
from .mount import positive
from .options import together
from .paths import PLOT_FILE

# What the description says, or what is about one spring.
_OF_MODELS = (
    "mass", "base_displacement", "base_acceleration", "force", "stiffness", "load", "parallel", "series", "damping",
    "zero", "band", "points", "extrapolate",
)  # fmt: skip
_OF_SYSTEMS = ("vary", "cases", "candidates", "step", "plot")

system_options = together(
    click.option("--vary", multiple=True, metavar="PATH=VALUES",
                 help="Of a SYSTEM.toml: a value of it, such as body.box.mass, and LOW:HIGH:COUNT or a list with "
                 "commas, such as '15 kg:25 kg:5'; repeat for a grid."),
    click.option("--case", "cases", multiple=True, metavar="NAME",
                 help="Of a SYSTEM.toml: only this load case, of several directions all; repeat for more."),
    click.option("--candidate", "candidates", multiple=True, metavar="NAME",
                 help="Of a SYSTEM.toml: only this candidate; repeat for more."),
    click.option("--step", type=positive("s"), metavar="S",
                 help="Of a SYSTEM.toml: time step of the coarser of two runs [s].  [default: the file's, or found for "
                 "errors of 0.1 %]"),
    click.option("--plot", type=PLOT_FILE, metavar="FILE.png",
                 help="Of a SYSTEM.toml: plot acceleration against stroke (.png, .svg or .pdf)."),
)  # fmt: skip


def refuse_wrong_options(context: click.Context, path: str) -> None:
    """Refuse options that do not apply to what is given, and ask for those that are needed.

    Raises
    ------
    click.UsageError   With the option.
    """
    instead = "use --vary PATH=VALUES, as in --vary 'body.box.mass=15 kg:25 kg:5'"
    refuse_mixed(context, path, _OF_MODELS, _OF_SYSTEMS, ("mass", "vary"), instead)


def varied_paths(given: tuple[str, ...]) -> dict[str, str]:
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


def quantiles_json(figures: Mapping[str, Quantiles | None]) -> dict[str, dict[str, float] | None]:
    """Quantiles of figures, null where unknown."""
    return {
        name: None if q is None else {"q05": q.low, "median": q.median, "q95": q.high} for name, q in figures.items()
    }


def json_of(found: SystemStudyResult) -> dict[str, Any]:
    """What is printed of a study with --json."""
    study = found.study
    return {
        "name": found.name,
        "runs": len(study),
        "draws": study.draws,
        "seed": study.seed,
        "vary": [{"path": one.path, "unit": one.unit, "values": one.values} for one in study.varied],
        "cases": [name for _, name in study.cases],
        "cautions": found.cautions,
        "points": [
            {
                "values": one.values,
                "candidate": one.candidate,
                "verdict": one.verdict.value,
                "passing": one.passing,
                "refused": one.refused,
                "reason": one.reason,
                "least_margin": one.governing,
                "figures": quantiles_json(one.figures),
            }
            for one in found.summaries
        ],
    }
