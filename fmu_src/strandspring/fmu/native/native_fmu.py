"""The native FMU as one file: co-simulation and model exchange in one binary per platform, with its C sources.

The same model gives the same bytes, whatever the platform it is built on.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.resources import files
from pathlib import Path

from ...errors import BuildError
from ...files import replacing
from ...modelfile import ModelFile
from ..archive import common_contents, content_guid, fmu_path, installed_version, write_archive
from ..description import Backend, model_description
from .compiler import Platform, chosen_platforms, compile_binary
from .config import configuration

_STATE_AND_DERIVATIVES = {
    "needsExecutionTool": "false",
    "canNotUseMemoryManagementFunctions": "false",
    "providesDirectionalDerivative": "true",
}
_LOG_CATEGORIES = {"logAll": "Every message."}

# Includes all other sources.
_UNIT = "all.c"
_FMI_HEADERS = ("fmi2FunctionTypes.h", "fmi2Functions.h", "fmi2TypesPlatform.h")


def _nothing(_: str) -> None:
    """What `build_native_fmu` calls unless it is told something else."""


def build_native_fmu(
    model: ModelFile,
    directory: Path,
    platforms: Sequence[Platform] | None = None,
    compiled: Callable[[str], object] = _nothing,
) -> Path:
    """Write ``<directory>/<model.name>.fmu``, an FMI 2.0 FMU that runs without Python.

    Parameters
    ----------
    model : ModelFile
    directory : Path                    Made if it does not exist.
    platforms : sequence of Platform    Those it runs on; this computer's by default.
    compiled : callable                 Told the name of each platform whose binary is ready.

    Returns
    -------
    Path               The FMU.

    Raises
    ------
    StrandspringError  If ziglang is missing or fails, or the folder cannot be written to.
    """
    path = fmu_path(directory, model.name)
    contents = native_contents(model, chosen_platforms("host") if platforms is None else platforms, compiled)
    with replacing(path) as part:
        write_archive(part, contents)
    return path


def native_contents(
    model: ModelFile, platforms: Sequence[Platform], compiled: Callable[[str], object] = _nothing
) -> dict[str, bytes]:
    """Every file of the native FMU by its path inside it."""
    fixed = _fixed_sources()
    backend = Backend(
        co_simulation={
            **_STATE_AND_DERIVATIVES,
            "canInterpolateInputs": "true",
            "maxOutputDerivativeOrder": "1",
            "canRunAsynchronuously": "false",
        },
        model_exchange={**_STATE_AND_DERIVATIVES, "completedIntegratorStepNotNeeded": "false"},
        event_indicators=1,
        log_categories=_LOG_CATEGORIES,
        sources=(_UNIT,),
    )
    tool = f"strandspring {installed_version('strandspring')} with ziglang {installed_version('ziglang')}"
    # The binaries hold the GUID, so it comes from what they are made of.
    parts = [model_description(model, "", tool, backend), configuration(model, "").encode("utf-8")]
    for name, content in sorted(fixed.items()):
        parts += [name.encode(), content]
    guid = content_guid(parts)
    sources = {**fixed, "spring_config.h": configuration(model, guid).encode("utf-8")}

    def binary(platform: Platform) -> tuple[str, bytes]:
        content = compile_binary(platform, sources, _UNIT, model.name)
        compiled(platform.name)
        return f"binaries/{platform.name}/{model.name}{platform.suffix}", content

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        binaries = dict(pool.map(binary, platforms))
    return {
        **common_contents(
            model, model_description(model, guid, tool, backend), platforms=tuple(sorted(p.name for p in platforms))
        ),
        **binaries,
        **{f"sources/{name}": content for name, content in sources.items()},
        "documentation/licenses/fmi-headers.txt": _licence_of_headers(sources),
    }


def _fixed_sources() -> dict[str, bytes]:
    """The C files that are the same for every model, by name."""
    ours = [file for file in (files("strandspring") / "core" / "c").iterdir() if file.name[-2:] in (".c", ".h")]
    return {**{file.name: file.read_bytes() for file in ours}, **{name: _of_fmpy(name) for name in _FMI_HEADERS}}


def _of_fmpy(name: str) -> bytes:
    try:
        return (files("fmpy") / "c-code" / name).read_bytes()
    except OSError:
        raise BuildError(f"fmpy {installed_version('fmpy')} has no file {name}; install a newer one.") from None


def _licence_of_headers(sources: Mapping[str, bytes]) -> bytes:
    """The copyright notice and the licence, which stand in the first comment of each header of FMI."""
    found = re.search(rb"Copyright .*?(?=\s*-*\s*\*/)", sources["fmi2TypesPlatform.h"], flags=re.DOTALL)
    if found is None:
        raise BuildError(f"The headers of fmpy {installed_version('fmpy')} hold no licence; install another fmpy.")
    return found.group() + b"\n"
