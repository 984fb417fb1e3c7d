"""`strandspring study SYSTEM.toml`."""

from __future__ import annotations

from typing import Any

import click
from click.core import ParameterSource

from ..api.system_studying import SystemStudyResult
from .mount import positive
from .options import together
from .paths import PLOT_FILE

# What the description says, or what is about one spring.
_OF_MODELS = (
    "mass", "base_displacement", "base_acceleration", "force", "stiffness", "load", "parallel", "series", "damping",
    "zero", "band", "points", "extrapolate",
)  # fmt: skip
_OF_SYSTEMS = {"vary": "--vary", "cases": "--case", "candidates": "--candidate", "step": "--step", "plot": "--plot"}

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


def is_system(path: str) -> bool:
    """Whether a path is that of a description, by its ending."""
    return path.lower().endswith(".toml")


def refuse_mixed(context: click.Context, path: str) -> None:
    """Refuse options that do not apply to what is given, and ask for those that are needed.

    Raises
    ------
    click.UsageError   With the option.
    """
    names = {name: f"--{name.replace('_', '-')}" for name in _OF_MODELS} if is_system(path) else _OF_SYSTEMS
    for name, option in names.items():
        if context.get_parameter_source(name) is ParameterSource.DEFAULT:
            continue
        if is_system(path):
            raise click.UsageError(
                f"{option} does not apply to {path}, which describes masses, mounts and loads itself; use --vary "
                "PATH=VALUES instead, as in --vary 'body.box.mass=15 kg:25 kg:5'."
            )
        raise click.UsageError(f"{option} applies to a SYSTEM.toml only, got {path}; leave it out.")
    needed = "vary" if is_system(path) else "mass"
    if not context.params[needed]:
        raise click.MissingParameter(ctx=context, param=next(p for p in context.command.params if p.name == needed))


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
                "figures": {
                    name: None if q is None else {"q05": q.low, "median": q.median, "q95": q.high}
                    for name, q in one.figures.items()
                },
            }
            for one in found.summaries
        ],
    }
