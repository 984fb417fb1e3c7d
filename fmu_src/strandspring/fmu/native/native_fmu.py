"""The native FMU as one file: co-simulation and model exchange in one binary per platform, with its C sources.

The same model gives the same bytes, whatever the platform it is built on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...compiled.images import FMU, SPRING_FILES
from ...compiled.sources import sources_in_fmu
from ...errors import BuildError
from ...model.coordinates import placed
from ...model.modelfile import ModelFile
from ...model.names import LONGEST_NAME
from ..archive import common_contents, content_guid, fmu_name, fmu_path, installed_version, write_archive
from ..description.content import NO_EVENTS, Backend
from ..description.described_variables import REVERSAL_INDICATOR
from ..description.fmi3_files import BUILD_DESCRIPTION, build_description, terminals
from ..description.model_description import model_description
from ..related_files import BuildSettings, related_files, sealed, version_of
from .block import filled, values_source
from .platforms import Platform, binaries, default_platforms

_STATE_AND_DERIVATIVES = {
    "needsExecutionTool": "false",
    "canNotUseMemoryManagementFunctions": "false",
    "providesDirectionalDerivative": "true",
}
_DERIVATIVES = {"providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true"}

# Capabilities of co-simulation and of model exchange by version of FMI. On the straight paths between communication
# points event mode, early return and intermediate update would bring nothing.
_CO_SIMULATION = {
    2: {
        **_STATE_AND_DERIVATIVES,
        "canInterpolateInputs": "true",
        "maxOutputDerivativeOrder": "1",
        "canRunAsynchronuously": "false",
    },
    3: {
        **_DERIVATIVES,
        "canHandleVariableCommunicationStepSize": "true",
        "maxOutputDerivativeOrder": "1",
        **NO_EVENTS,
    },
}
_MODEL_EXCHANGE = {
    2: {**_STATE_AND_DERIVATIVES, "completedIntegratorStepNotNeeded": "false"},
    3: {**_DERIVATIVES, "needsCompletedIntegratorStep": "true", "providesEvaluateDiscreteStates": "false"},
}

# Where the C sources of a spring lie, and among them those of one spring's values.
_C = "core/c/"
_VALUES = "fmu/spring_values.h"


def build_native_fmu(
    model: ModelFile,
    directory: Path,
    platforms: Sequence[Platform] | None = None,
    zero: str | float | None = None,
    author: str = "",
    with_states: bool = False,
    fmi: int = 2,
) -> Path:
    """Write ``<directory>/<model.name>.fmu``, an FMI 2.0 FMU that runs without Python, or ``<model.name>_fmi3.fmu``.

    With states its name ends in ``_states.fmu``, and it is for model exchange alone: `omega` and `absorbed_energy` are
    continuous states, `velocity` is a second input, and there is no memory besides. It is for importers that evaluate
    an FMU as a function, as for optimal control and linearisation; to them the usual form is an elastic spring.

    Parameters
    ----------
    model : ModelFile
    directory : Path                    Made if it does not exist.
    platforms : sequence of Platform    Those it runs on; by default those whose images the installed package carries,
                                        or this computer's in a source checkout.
    zero : str, float or None           Displacement of the model file at which that of the FMU is 0 [m]; by default the
                                        rig's zero if it lies within the identified range, else the middle of the range.
    author : str                        For the model description.
    with_states : bool
    fmi : int                           Version of FMI, 2 or 3.

    Returns
    -------
    Path               The FMU.

    Raises
    ------
    StrandspringError  If an image has to be compiled and ziglang is missing or fails, or the folder cannot be written
                       to.
    """
    chosen = default_platforms() if platforms is None else platforms
    contents = native_contents(model, chosen, zero, author, with_states, fmi)
    return write_archive(fmu_path(directory, model.name, _backend_name(with_states), fmi), contents)


def native_contents(
    model: ModelFile,
    platforms: Sequence[Platform],
    zero: str | float | None = None,
    author: str = "",
    with_states: bool = False,
    fmi: int = 2,
) -> dict[str, bytes]:
    """Every file of the native FMU by its path inside it."""
    of_record = model
    model, zero = placed(model, zero)
    settings = BuildSettings(_backend_name(with_states), zero, author, fmi=fmi)
    # All forms may be linked into one program.
    name = fmu_name(model.name, settings.backend, fmi)
    if len(name) > LONGEST_NAME:
        shorter = LONGEST_NAME - len(name) + len(model.name)
        raise BuildError(f"{name} is too long for an FMU; give the model a name of at most {shorter} characters.")
    model = replace(model, name=name)
    fixed = _fixed_sources(fmi)
    listed = (SPRING_FILES[fmi].removeprefix(_C),)  # includes all other sources
    left_out = frozenset[str]()
    interfaces = {"co_simulation": None if with_states else _CO_SIMULATION[fmi], "model_exchange": _MODEL_EXCHANGE[fmi]}
    if model.parameters.branches and not with_states:
        # With branches the displacement moves at constant velocity over a step, whose size is known only at its end.
        co_simulation = _CO_SIMULATION[fmi] | ({"canInterpolateInputs": "false"} if fmi == 2 else {})
        interfaces, left_out = {"co_simulation": co_simulation}, frozenset({REVERSAL_INDICATOR})
    backend = Backend(
        **interfaces,
        sources=listed,
        author=author,
        version=version_of(of_record.to_json()),
        with_states=with_states,
        fmi=fmi,
        left_out=left_out,
    )
    tool = f"strandspring {installed_version('strandspring')}"
    # The binaries hold the GUID, so it comes from what they are made of.
    values = values_source(model, "", with_states).encode("ascii")
    guid = content_guid([model_description(model, "", tool, backend), values], fixed)
    sources = {**fixed, _VALUES: values_source(model, guid, with_states).encode("ascii")}
    of_fmi3 = {**terminals(), BUILD_DESCRIPTION: build_description(model.name, listed)}
    return sealed(
        {
            **common_contents(
                model,
                zero,
                model_description(model, guid, tool, backend),
                backend,
                platforms=tuple(sorted({folder for platform in platforms for folder in platform.folders(fmi)})),
            ),
            **related_files(of_record, settings),
            **binaries(model.name, platforms, FMU, lambda image: filled(image, model, guid, with_states), fmi),
            **{f"sources/{name}": content for name, content in sources.items()},
            **(of_fmi3 if fmi == 3 else {}),
        }
    )


def _backend_name(with_states: bool) -> str:
    return "states" if with_states else "native"


def _fixed_sources(fmi: int) -> dict[str, bytes]:
    """The C files that are the same for every model, by path."""
    return {path.removeprefix(_C): content for path, content in sources_in_fmu(SPRING_FILES[fmi], fmi).items()}
