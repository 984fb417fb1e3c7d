"""The page that the FMU of a system carries about itself."""

from __future__ import annotations

from importlib.resources import files

from jinja2 import Environment, StrictUndefined

from ...compiled.images import Unit
from ...vibration.bodies.mounted import MountedSystem
from .system_variables import SystemFmuOptions, system_start_values, system_variables


def system_page(system: MountedSystem, options: SystemFmuOptions, unit: Unit, platforms: tuple[str, ...]) -> str:
    """HTML of one file: the system, the FMU's behaviour, its variables; the same arguments give the same text."""
    template = Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=StrictUndefined
    ).from_string((files(__package__) / "assets" / "system_page.html.j2").read_text(encoding="utf-8"))
    start = system_start_values(system, options)
    return template.render(
        name=system.name or "Bodies on mounts",
        system=system,
        options=options,
        platforms=platforms,
        unit=unit,
        variables=[(variable, start.get(variable.name)) for variable in system_variables(system, options)],
    )
