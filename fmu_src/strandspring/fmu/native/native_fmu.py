"""The native FMU as one file: co-simulation and model exchange in one binary per platform, with its C sources.

The same model gives the same bytes, whatever the platform it is built on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...compiled.images import FMI_HEADERS, FMU, fmi_header
from ...coordinates import placed
from ...modelfile import ModelFile
from ..archive import common_contents, content_guid, fmu_path, installed_version, write_archive
from ..description import Backend, model_description
from ..papers import BuildSettings, model_version, papers, sealed
from .block import filled, values_source
from .platforms import Platform, binaries, default_platforms

_STATE_AND_DERIVATIVES = {
    "needsExecutionTool": "false",
    "canNotUseMemoryManagementFunctions": "false",
    "providesDirectionalDerivative": "true",
}

# Includes all other sources.
_UNIT = "all.c"


def build_native_fmu(
    model: ModelFile,
    directory: Path,
    platforms: Sequence[Platform] | None = None,
    zero: float | None = None,
    author: str = "",
    with_states: bool = False,
) -> Path:
    """Write ``<directory>/<model.name>.fmu``, an FMI 2.0 FMU that runs without Python.

    With states it is ``<model.name>_states.fmu``, for model exchange alone: `omega` and `absorbed_energy` are
    continuous states, `velocity` is a second input, and there is no memory besides. It is for importers that evaluate
    an FMU as a function, as for optimal control and linearisation; to them the usual form is an elastic spring.

    Parameters
    ----------
    model : ModelFile
    directory : Path                    Made if it does not exist.
    platforms : sequence of Platform    Those it runs on; by default those whose images the installed package carries,
                                        or this computer's in a source checkout.
    zero : float or None                Displacement of the model file at which that of the FMU is 0 [m]; by default the
                                        rig's zero if it lies within the identified range, else the middle of the range.
    author : str                        For the model description.
    with_states : bool

    Returns
    -------
    Path               The FMU.

    Raises
    ------
    StrandspringError  If an image has to be compiled and ziglang is missing or fails, or the folder cannot be written
                       to.
    """
    chosen = default_platforms() if platforms is None else platforms
    contents = native_contents(model, chosen, zero, author, with_states)
    return write_archive(fmu_path(directory, model.name, "states" if with_states else "native"), contents)


def native_contents(
    model: ModelFile,
    platforms: Sequence[Platform],
    zero: float | None = None,
    author: str = "",
    with_states: bool = False,
) -> dict[str, bytes]:
    """Every file of the native FMU by its path inside it."""
    of_record = model
    model, zero = placed(model, zero)
    if with_states:
        # Both forms may be linked into one program.
        model = replace(model, name=f"{model.name}_states")
    fixed = _fixed_sources()
    backend = Backend(
        co_simulation=None
        if with_states
        else {
            **_STATE_AND_DERIVATIVES,
            "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "1",
            "canRunAsynchronuously": "false",
        },
        model_exchange={**_STATE_AND_DERIVATIVES, "completedIntegratorStepNotNeeded": "false"},
        sources=(_UNIT,),
        author=author,
        version=model_version(of_record),
        with_states=with_states,
    )
    tool = f"strandspring {installed_version('strandspring')}"
    spring = model.parameters
    # The binaries hold the GUID, so it comes from what they are made of.
    values = values_source(spring, "", with_states).encode("ascii")
    guid = content_guid([model_description(model, "", tool, backend), values], fixed)
    sources = {**fixed, "spring_values.h": values_source(spring, guid, with_states).encode("ascii")}
    settings = BuildSettings("states" if with_states else "native", zero, author)
    return sealed(
        {
            **common_contents(
                model,
                zero,
                model_description(model, guid, tool, backend),
                platforms=tuple(sorted(p.name for p in platforms)),
                with_states=with_states,
            ),
            **papers(of_record, settings),
            **binaries(model.name, platforms, FMU, lambda image: filled(image, spring, guid, with_states)),
            **{f"sources/{name}": content for name, content in sources.items()},
        }
    )


def _fixed_sources() -> dict[str, bytes]:
    """The C files that are the same for every model, by name."""
    ours = {Path(path).name: content for path, content in FMU.sources().items()}
    return {**ours, **{name: fmi_header(name) for name in FMI_HEADERS}}
