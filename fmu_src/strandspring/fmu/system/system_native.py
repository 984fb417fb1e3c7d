"""The FMU of a system as one file: co-simulation in one binary per platform, with its C sources.

The same system gives the same bytes, whatever the platform it is built on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ...compiled.images import SYSTEM, SYSTEM_FILES
from ...compiled.sources import sources_in_fmu
from ...model.names import LONGEST_NAME, identifier
from ...vibration.bodies.mounted import MountedSystem
from ..archive import content_guid, installed_version, licences, write_archive
from ..description.content import NO_EVENTS, Backend, DescriptionContent
from ..description.described_variables import scalar_variables
from ..description.fmi3_files import BUILD_DESCRIPTION, build_description
from ..description.icons import icon
from ..description.model_description import described
from ..native.platforms import Platform, binaries, default_platforms
from ..related_files import sealed, version_of, with_manifest
from .system_block import system_block
from .system_files import SOURCE
from .system_page import system_page
from .system_reference import reference_experiment
from .system_variables import SystemFmuOptions, system_start_values, system_units, system_variables

# Capabilities by version of FMI.
_ABILITIES = {
    2: {
        "needsExecutionTool": "false",
        "canNotUseMemoryManagementFunctions": "false",
        "providesDirectionalDerivative": "false",
        "canInterpolateInputs": "true",
        "maxOutputDerivativeOrder": "0",
        "canRunAsynchronuously": "false",
    },
    3: {"canHandleVariableCommunicationStepSize": "true", "maxOutputDerivativeOrder": "0", **NO_EVENTS},
}
_LOG_CATEGORIES = {
    "logStatusWarning": "A spring left its identified range.",
    "logStatusError": "A value or a step was refused; the message names it.",
    "logAll": "Every message.",
}
_VALUES = "fmu/system/c/system_values.h"


def system_identifier(system: MountedSystem, fmi: int = 2) -> str:
    """The name of the system's FMU."""
    ending = "" if fmi == 2 else f"_fmi{fmi}"
    return identifier(system.name or "system")[: LONGEST_NAME - len(ending)] + ending


def build_system_fmu(
    system: MountedSystem,
    directory: Path,
    options: SystemFmuOptions,
    platforms: Sequence[Platform] | None = None,
    description: Mapping[str, bytes] | None = None,
) -> Path:
    """Write ``<directory>/<name of the system>.fmu``, an FMU for co-simulation that runs without Python.

    That of FMI 3.0 is ``<directory>/<name of the system>_fmi3.fmu``.

    Parameters
    ----------
    system : MountedSystem
    directory : Path                    Made if it does not exist.
    options : SystemFmuOptions
    platforms : sequence of Platform    As for the FMU of a spring.
    description : mapping or None       What the system was described by, see `system_files`; None for a system that was
                                        made in Python.

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
    name = system_identifier(system, options.fmi)
    return write_archive(directory / f"{name}.fmu", system_contents(system, options, chosen, description))


def system_contents(
    system: MountedSystem,
    options: SystemFmuOptions,
    platforms: Sequence[Platform],
    description: Mapping[str, bytes] | None = None,
) -> dict[str, bytes]:
    """Every file of the FMU by its path inside it."""
    fmi, block = options.fmi, system_block(system, options)
    name, file = system_identifier(system, fmi), SYSTEM_FILES[fmi]
    fixed = sources_in_fmu(file, fmi)
    table = system_variables(system, options)
    tool = f"strandspring {installed_version('strandspring')}"
    content = DescriptionContent(
        name,
        f"{system.name or 'Rigid bodies'}: base acceleration in, motion of points and forces of mounts out",
        scalar_variables(table) if fmi == 3 else table,
        system_units(),
        system_start_values(system, options),
        log_categories=_LOG_CATEGORIES,
        step=options.step,
    )
    backend = Backend(
        co_simulation=_ABILITIES[fmi],
        sources=(file,),
        author=options.author,
        version=version_of(block.source("")),
        fmi=fmi,
    )
    # The binaries hold the GUID, so it comes from what they are made of.
    guid = content_guid([described(content, "", tool, backend), block.source("").encode("ascii")], fixed)
    sources = {**fixed, _VALUES: block.source(guid).encode("ascii")}
    return sealed(
        {
            "modelDescription.xml": described(content, guid, tool, backend),
            **icon(fmi, "system"),
            "documentation/index.html": system_page(
                system, options, file, tuple(sorted({folder for p in platforms for folder in p.folders(fmi)}))
            ).encode(),
            **licences((), fmi),
            **with_manifest(reference_experiment(system, options), SOURCE if description else None),
            **(description or {}),
            **binaries(name, platforms, SYSTEM, lambda image: block.filled(image, guid), fmi),
            **{f"sources/{path}": text for path, text in sources.items()},
            **({BUILD_DESCRIPTION: build_description(name, backend.sources)} if fmi == 3 else {}),
        }
    )
