"""The page that the FMU of a system carries about itself."""

from __future__ import annotations

from ...compiled.images import CompiledUnit
from ...vibration.bodies.mounted import MountedSystem
from ..documentation import template
from .system_variables import SystemFmuOptions, system_start_values, system_variables


def system_page(
    system: MountedSystem, options: SystemFmuOptions, unit: CompiledUnit, platforms: tuple[str, ...]
) -> str:
    """HTML of one file: the system, the FMU's behaviour, its variables; the same arguments give the same text."""
    start = system_start_values(system, options)
    return template(__package__, "system_page.html.j2").render(
        name=system.name or "Bodies on mounts",
        system=system,
        options=options,
        platforms=platforms,
        unit=unit,
        variables=[(variable, start.get(variable.name)) for variable in system_variables(system, options)],
    )
