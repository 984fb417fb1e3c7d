"""The page that the FMU of a system carries about itself."""

from __future__ import annotations

from markupsafe import Markup

from ...errors import MountedSystemError
from ...vibration.bodies.modes import modes
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import rest
from ...vibration.bodies.small_motion import SmallMotion
from ..documentation import template
from .system_sketch import sketch_svg
from .system_variables import SystemFmuOptions, system_start_values, system_variables


def system_page(system: MountedSystem, options: SystemFmuOptions, file: str, platforms: tuple[str, ...]) -> str:
    """HTML of one file: the system with a sketch and its modes, the FMU's behaviour, its variables.

    The same arguments give the same text.
    """
    start = system_start_values(system, options)
    pose = rest(system, options.omega_start)
    try:
        natural, unstable = modes(SmallMotion(system, pose.pose), omega=pose.omega), ""
    except MountedSystemError as problem:
        natural, unstable = (), str(problem)
    return template(__package__, "system_page.html.j2").render(
        name=system.name or "Bodies on mounts",
        system=system,
        # The SVG is made by ElementTree.
        sketch=Markup(sketch_svg(system)),  # noqa: S704
        modes=natural,
        unstable=unstable,
        options=options,
        platforms=platforms,
        file=file,
        variables=[(variable, start.get(variable.name)) for variable in system_variables(system, options)],
    )
