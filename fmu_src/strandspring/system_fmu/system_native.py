"""The FMU of a system as one file: FMI 2.0 co-simulation in one binary per platform, with its C sources.

The same system gives the same bytes, whatever the platform it is built on.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from ..compiled.images import FMI_HEADERS, SYSTEM, fmi_header
from ..fmu.archive import content_guid, installed_version, licences, write_archive
from ..fmu.description import described
from ..fmu.description_content import Backend, Content
from ..fmu.native.platforms import Platform, binaries, default_platforms
from ..fmu.papers import sealed
from ..modelfile import identifier
from ..systems.mounted import MountedSystem
from .system_block import SystemBlock, system_block
from .system_page import system_page
from .system_reference import reference_tables
from .system_variables import SystemFmuOptions, system_start_values, system_units, system_variables

_ABILITIES = {
    "needsExecutionTool": "false",
    "canNotUseMemoryManagementFunctions": "false",
    "providesDirectionalDerivative": "false",
    "canInterpolateInputs": "true",
    "maxOutputDerivativeOrder": "0",
    "canRunAsynchronuously": "false",
}
_LOG_CATEGORIES = {
    "logStatusWarning": "A spring left its identified range.",
    "logStatusError": "A value or a step was refused; the message names it.",
    "logAll": "Every message.",
}
_VALUES = "system_fmu/c/system_values.h"


def system_identifier(system: MountedSystem) -> str:
    """The name of the system's FMU."""
    return identifier(system.name or "system")


def build_system_fmu(
    system: MountedSystem, directory: Path, options: SystemFmuOptions, platforms: Sequence[Platform] | None = None
) -> Path:
    """Write ``<directory>/<name of the system>.fmu``, an FMI 2.0 FMU for co-simulation that runs without Python.

    Parameters
    ----------
    system : MountedSystem
    directory : Path                    Made if it does not exist.
    options : SystemFmuOptions
    platforms : sequence of Platform    As for the FMU of a spring.

    Returns
    -------
    Path                 The FMU.

    Raises
    ------
    MountedSystemError   If the system is too large, or cannot rest within the identified ranges of its springs.
    StrandspringError    If an image has to be compiled and ziglang is missing or fails, or the folder cannot be written
                         to.
    """
    chosen = default_platforms() if platforms is None else platforms
    return write_archive(directory / f"{system_identifier(system)}.fmu", system_contents(system, options, chosen))


def system_contents(
    system: MountedSystem, options: SystemFmuOptions, platforms: Sequence[Platform]
) -> dict[str, bytes]:
    """Every file of the FMU by its path inside it."""
    name, block, fixed = system_identifier(system), system_block(system, options), _fixed_sources()
    tool = f"strandspring {installed_version('strandspring')}"
    content = Content(
        name,
        f"{system.name or 'Rigid bodies'}: base acceleration in, motion of points and forces of mounts out",
        system_variables(system, options),
        system_units(),
        system_start_values(system, options),
        log_categories=_LOG_CATEGORIES,
        step=options.step,
    )
    backend = Backend(co_simulation=_ABILITIES, sources=(SYSTEM.file,), author=options.author, version=_version(block))
    # The binaries hold the GUID, so it comes from what they are made of.
    guid = content_guid([described(content, "", tool, backend), block.source("").encode("ascii")], fixed)
    sources = {**fixed, _VALUES: block.source(guid).encode("ascii")}
    return sealed(
        {
            "modelDescription.xml": described(content, guid, tool, backend),
            "model.png": (files("strandspring.fmu") / "assets" / "model.png").read_bytes(),
            "documentation/index.html": system_page(system, options, tuple(sorted(p.name for p in platforms))).encode(),
            **licences(()),
            **reference_tables(system, options),
            **binaries(name, platforms, SYSTEM, lambda image: block.filled(image, guid)),
            **{f"sources/{path}": text for path, text in sources.items()},
        }
    )


def _version(block: SystemBlock) -> str:
    return hashlib.sha256(block.source("").encode("ascii")).hexdigest()[:12]


def _fixed_sources() -> dict[str, bytes]:
    """The C files that are the same for every system, by path."""
    return {**SYSTEM.sources(), **{f"core/c/{name}": fmi_header(name) for name in FMI_HEADERS[SYSTEM.fmi]}}
