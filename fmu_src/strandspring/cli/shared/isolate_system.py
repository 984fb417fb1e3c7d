"""`strandspring isolate SYSTEM.toml`."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import click
import numpy as np

from ...api.vibration.system_isolation import IsolatedSystem, SystemIsolation, isolate_system
from ...vibration.bodies.six_response import DIRECTIONS, SystemResponse
from .descriptions import is_system, refuse_mixed
from .mount import chosen_levels, positive
from .options import together
from .output import reporting, result, result_json, terminal_width

# What the description says, or what is about one spring.
_OF_MODELS = ("mass", "load", "parallel", "series", "damping", "zero", "verify")
_OF_SYSTEMS = ("base_rotation", "directions", "at")


class _Direction(click.types.StringParamType):
    """x, y or z with or without a sign, or three numbers with commas."""

    name = "direction"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if value.lstrip("+-") in DIRECTIONS and len(value) <= 2:
            return value
        try:
            components = tuple(float(text) for text in value.split(","))
        except ValueError:
            components = ()
        if len(components) != 3 or not all(map(math.isfinite, components)) or not any(components):
            self.fail(f"must be x, y, z, -x, -y, -z or three numbers such as 1,0,1, got {value!r}.", param, ctx)
        return components


system_options = together(
    click.option("--direction", "directions", type=_Direction(), multiple=True, metavar="x|y|z|X,Y,Z",
                 help="Of a SYSTEM.toml: direction of the excitation, or axis of the rotation; repeat for more.  "
                 "[default: x, y and z]"),
    click.option("--base-rotation", type=positive("deg"), multiple=True, metavar="DEG",
                 help="Of a SYSTEM.toml: rotation amplitude of the base about an axis through the origin [deg]; "
                 "repeat for more levels."),
    click.option("--at", metavar="POINT",
                 help="Of a SYSTEM.toml: the point or body on which --force acts.  [default: the first body]"),
)  # fmt: skip


def refuse_wrong_options(context: click.Context, paths: tuple[str, ...]) -> None:
    """Refuse options that do not apply to what is given, and a description beside something else.

    Raises
    ------
    click.UsageError   With the option.
    """
    described = [path for path in paths if is_system(path)]
    if described and len(paths) > 1:
        raise click.UsageError(
            f"{described[0]} describes a whole system and its candidates; give it alone, and models in another command."
        )
    refuse_mixed(context, paths[0], _OF_MODELS, _OF_SYSTEMS, ("mass", None))


def isolate_description(
    path: str,
    levels: dict[str, Any],
    output: str | None,
    plot: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Compute and print; arguments as the command has them."""
    rotations = options.pop("base_rotation")
    chosen = chosen_levels(levels)
    if rotations and chosen is not None:
        raise click.UsageError(
            f"--base-rotation and --{chosen[0].value.replace(' ', '-')} exclude each other; give one of them."
        )
    if options["at"] is not None and not levels["force"]:
        raise click.UsageError("--at says where a force acts; give --force, too, or leave it out.")
    if rotations:
        options["base_rotation"] = [math.radians(rotation) for rotation in rotations]
    elif chosen is not None:
        options[chosen[0].value.replace(" ", "_")] = chosen[1]
    directions = options.pop("directions") or None
    with reporting() as progress:
        found = isolate_system(path, directions=directions, **options, progress=progress)
    if output is not None:
        found.save_csv(output)
    if plot is not None:
        found.save_plot(plot)
    if as_json:
        result_json({**_json(found), "output": output, "plot": plot})
        return
    result("\n".join(found.lines(terminal_width())))
    for title, written in (("Curves", output), ("Plot", plot)):
        if written is not None:
            result(f"{title}: {written}")


def _json(found: SystemIsolation) -> dict[str, Any]:
    return {
        "system": found.source,
        "name": found.name,
        "levels_chosen": found.levels_chosen or None,
        "candidates": [_of_candidate(one) for one in found.candidates],
    }


def _of_candidate(one: IsolatedSystem) -> dict[str, Any]:
    return {
        "name": one.label,
        "rest": [
            {"body": body.name, "mass": body.mass, "displacement": moved.tolist(), "rotation": rotation.tolist()}
            for body, moved, rotation in zip(one.system.bodies, one.rest.displacements, one.rest.rotations, strict=True)
        ],
        "modes": [
            {
                "frequency": mode.frequency,
                "viscous_damping": mode.damping,
                "motion": mode.words,
                "shape": mode.shape.tolist(),
            }
            for mode in one.modes
        ],
        "responses": [_of_response(response) for response in one.responses],
    }


def _of_response(response: SystemResponse) -> dict[str, Any]:
    size, phase = np.abs(response.gain), np.degrees(np.angle(response.gain))
    columns = {
        "acceleration": response.acceleration,
        "sway": response.sway,
    }
    return {
        "excitation": response.shaking.name,
        "direction": response.shaking.direction,
        "level": response.level,
        "unit": response.shaking.unit,
        "gain_unit": response.gain_unit,
        "resonances": [asdict(resonance) for resonance in response.resonances],
        "cautions": response.cautions,
        "frequency": response.frequency.tolist(),
        "points": [
            {
                "name": point.name,
                "gain": size[:, p].tolist(),
                "phase": phase[:, p].tolist(),
                **{name: values[:, p].tolist() for name, values in columns.items()},
            }
            for p, point in enumerate(response.points)
        ],
        "base_force": np.abs(response.base_force).tolist(),
        "axes": [
            {"name": name, "lowest": response.low[:, k].tolist(), "highest": response.high[:, k].tolist()}
            for k, name in enumerate(response.axes)
        ],
        "stable": response.stable.tolist(),
        "requested": response.wanted.tolist(),
        "extrapolating": response.extrapolating.tolist(),
    }
