"""`strandspring isolate`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import click

from ...api.vibration.isolation import isolate as isolated
from ...report.rendering.report_path import SUFFIXES, check_report_path
from ..shared.descriptions import is_system, refuse_mixed
from ..shared.mount import EXCITATIONS, chosen_levels, curve_options, level_options, mount_options, positive
from ..shared.option_types import output_options, together
from ..shared.output import present, reporting, save
from ..shared.paths import PLOT_FILE, FileNamed, FileOfFormat, refuse_overwriting
from ..shared.zero import zero_option

# What the description says, or what is about one spring.
_OF_MODELS = ("mass", "load", "parallel", "series", "damping", "zero", "verify")
_OF_SYSTEMS = ("base_rotation", "directions", "at", "candidates", "report")


class _Direction(click.types.StringParamType):
    """x, y or z with or without a sign, or three numbers with commas."""

    name = "direction"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        from ...vibration.bodies.six_response import DIRECTIONS  # of systems alone, and slow to import

        if value.lstrip("+-") in DIRECTIONS and len(value) <= 2:
            return value
        try:
            components = tuple(float(text) for text in value.split(","))
        except ValueError:
            components = ()
        if len(components) != 3 or not all(map(math.isfinite, components)) or not any(components):
            self.fail(f"must be x, y, z, -x, -y, -z or three numbers such as 1,0,1, got {value!r}.", param, ctx)
        return components


_system_options = together(
    click.option("--direction", "directions", type=_Direction(), multiple=True, metavar="x|y|z|X,Y,Z",
                 help="Of a SYSTEM.toml: direction of the excitation, or axis of the rotation; repeat for more.  "
                 "[default: x, y and z]"),
    click.option("--base-rotation", type=positive("deg", math.radians(1.0)), multiple=True, metavar="DEG",
                 help="Of a SYSTEM.toml: rotation amplitude of the base about an axis through the origin [deg]; "
                 "repeat for more levels."),
    click.option("--at", metavar="POINT",
                 help="Of a SYSTEM.toml: the point or body on which --force acts.  [default: the first body]"),
    click.option("--candidate", "candidates", multiple=True, metavar="NAME",
                 help="Of a SYSTEM.toml: compute only this candidate; repeat for more."),
    click.option("--report", type=FileOfFormat(*SUFFIXES), metavar="FILE.html",
                 help="Of a SYSTEM.toml: write a report (.html or .pdf)."),
)  # fmt: skip


@click.command()
@click.argument("models", nargs=-1, required=True, metavar="MODEL.json...|SYSTEM.toml")
@click.option("--mass", type=positive("kg"), metavar="KG", help="Mass on the mount [kg]; required with models.")
@mount_options
@zero_option
@level_options(
    lambda level: level,
    "repeat for more levels",
    "  [default: 0.5, 1 and 2 % of the free travel, the smallest of all models]",
)
@_system_options
@curve_options(points=200)
@click.option(
    "-o", "--output", type=FileNamed(".csv"), metavar="OUT.csv", help="Write all points of the curves to this file."
)
@click.option("--plot", type=PLOT_FILE, metavar="FILE.png", help="Plot the curves of all models (.png, .svg or .pdf).")
@click.option(
    "--verify",
    is_flag=True,
    help="Build the FMU, co-simulate it at three frequencies of each level from the computed motion, and compare after "
    "20 periods.",
)
@output_options
@click.pass_context
def isolate(
    context: click.Context,
    /,
    models: tuple[str, ...],
    mass: float | None,
    output: str | None,
    plot: str | None,
    verify: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """Compute transmissibility and resonance of a mass on the spring, or on several springs to compare them.

    Of a SYSTEM.toml, which describes rigid bodies on mounts, compute it in all degrees of freedom, with rotations to
    the second order and the natural modes, for all its candidates. Where a body turns by half a degree or more, curves
    are compared with time integration of the exact equations, and a caution names differences from 2 % on.

    The steady response is found by harmonic balance and followed through folds, where a frequency has several motions;
    between two folds they are unstable (drawn dotted). Transmissibility is that of the first harmonic: absolute motion
    over base motion or, with --force, the force on the base over that force. Small peaks of the amplitude below the
    resonance are superharmonic: a multiple of the frequency meets the natural frequency.

    \b
    Examples:
      strandspring isolate spring.json --mass 5
      strandspring isolate old.json new.json --mass 5 --plot compared.png
      strandspring isolate spring.json --mass 20 --parallel 4 --plot t.png
      strandspring isolate spring.json --mass 5 --base-displacement 0.5
      strandspring isolate spring.json --mass 5 --force 10 --band 2 50 -o c.csv
      strandspring isolate spring.json --mass 5 --verify
      strandspring isolate box.toml --direction z --base-displacement 0.5
      strandspring isolate box.toml --candidate softer --report softer.html
    """
    if len(models) > 1 and (described := [path for path in models if is_system(path)]):
        raise click.UsageError(
            f"{described[0]} describes a whole system and its candidates; give it alone, and models in another command."
        )
    refuse_mixed(context, models[0], _OF_MODELS, _OF_SYSTEMS, ("mass", None))
    report = options.pop("report")
    refuse_overwriting(models, {"--output": output, "--plot": plot, "--report": report}, ".csv")
    if report is not None:
        check_report_path(report)
    levels = chosen_levels({kind: options.pop(kind) for kind in ("base_rotation", *EXCITATIONS)})
    of_system: dict[str, Any] = {name: options.pop(name) or None for name in ("directions", "at", "candidates")}
    files = {"output": ("Curves", output), "plot": ("Plot", plot)}
    if mass is None:
        if of_system["at"] is not None and "force" not in levels:
            raise click.UsageError("--at says where a force acts; give --force, too, or leave it out.")
        from ...api.vibration.system_isolation import isolate_system  # slow to import

        curve: dict[str, Any] = {name: options[name] for name in ("band", "points", "extrapolate")}
        with reporting() as progress:
            system = isolate_system(models[0], **of_system, **levels, **curve, progress=progress)
        save(system, output, plot, report)
        files["report"] = ("Report", report)
        present(
            as_json,
            lambda: {"system": system.source, **system.as_json()},
            system.brief,
            system.text_lines,
            system.said,
            **files,
        )
        return
    with reporting() as progress:
        isolation = isolated(models, mass, **levels, **options, progress=progress)
    if verify:
        with reporting() as progress:
            isolation = replace(isolation, checked=isolation.verify(progress))
    save(isolation, output, plot)
    present(as_json, isolation.as_json, isolation.brief, isolation.text_lines, isolation.said, **files)
