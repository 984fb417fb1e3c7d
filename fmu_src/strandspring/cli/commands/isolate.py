"""`strandspring isolate`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, fields
from typing import Any

import click

from ...api.vibration.isolation import CheckedMotion, IsolatedModel, Isolation, verification_lines
from ...api.vibration.isolation import isolate as isolated
from ..shared.isolate_system import isolate_description, refuse_wrong_options, system_options
from ..shared.mount import EXCITATIONS, chosen_levels, curve_options, level_options, mount_options, positive
from ..shared.output import reporting, result, result_json, terminal_width
from ..shared.paths import PLOT_FILE, refuse_overwriting
from ..shared.zero import zero_option


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
@system_options
@curve_options(points=200)
@click.option("-o", "--output", metavar="OUT.csv", help="Write all points of the curves to this file.")
@click.option("--plot", type=PLOT_FILE, metavar="FILE.png", help="Plot the curves of all models (.png, .svg or .pdf).")
@click.option(
    "--verify",
    is_flag=True,
    help="Build the FMU, co-simulate it at three frequencies of each level from the computed motion, and compare after "
    "20 periods.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of text.")
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

    Of a SYSTEM.toml, which describes rigid bodies on mounts, compute it in all degrees of freedom for small rotations,
    with the natural modes, for all its candidates. That may take minutes; fewer directions, levels and points
    take less.

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
    """
    refuse_wrong_options(context, models)
    levels = {kind: options.pop(kind) for kind in EXCITATIONS}
    refuse_overwriting(models, {"--output": output, "--plot": plot}, ".csv")
    of_system = {name: options.pop(name) for name in ("base_rotation", "directions", "at")}
    if mass is None:
        of_curve = {name: options[name] for name in ("band", "points", "extrapolate")}
        isolate_description(models[0], levels, output, plot, as_json, **of_system, **of_curve)
        return
    chosen = chosen_levels(levels)
    given: dict[str, Any] = {} if chosen is None else {chosen[0].value.replace(" ", "_"): chosen[1]}
    with reporting() as progress:
        found = isolated(models, mass, **given, **options, progress=progress)
    checked: tuple[CheckedMotion, ...] = ()
    if verify:
        with reporting() as progress:
            checked = found.verify(progress)
    if output is not None:
        found.save_csv(output)
    if plot is not None:
        found.save_plot(plot)
    if as_json:
        result_json(_json(found, checked, output, plot))
        return
    result("\n".join(found.lines(terminal_width())))
    if checked:
        result("\n".join(verification_lines(checked)))
    for title, written in (("Curves", output), ("Plot", plot)):
        if written is not None:
            result(f"{title}: {written}")


def _json(found: Isolation, checked: Sequence[CheckedMotion], output: str | None, plot: str | None) -> dict[str, Any]:
    """The content for one model, or a list of them in `models`."""
    each = [_of_model(found, one, checked) for one in found.models]
    content = each[0] if len(each) == 1 else {"levels_chosen": found.levels_chosen or None, "models": each}
    return {**content, "cautions": found.cautions, "output": output, "plot": plot}


def _of_model(found: Isolation, one: IsolatedModel, checked: Sequence[CheckedMotion]) -> dict[str, Any]:
    described = {f.name: getattr(one.system, f.name) for f in fields(one.system) if f.name != "spring"}
    return {
        "model": one.source,
        "zero": one.zero,
        "system": {**described, "load": one.system.static_load},
        "rest": asdict(one.equilibrium),
        "excitation": found.excitation.value,
        "levels": [
            {
                "level": response.level,
                "unit": response.excitation.unit,
                "resonance": asdict(response.resonance),
                "extrapolating": response.extrapolating,
                "points": [asdict(point) for point in response.points],
                "verification": [
                    {**asdict(of.check), "agrees": of.agrees} for of in checked if of.response is response
                ],
            }
            for response in one.responses
        ],
    }
