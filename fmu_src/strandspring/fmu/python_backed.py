"""The Python-backed FMU as one file: description, documentation, licences, binaries of pythonfmu and the slave.

The same model gives the same bytes, and nothing but the FMU itself is written.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from ..coordinates import placed
from ..core.facade import INSIDE_FMU
from ..errors import BuildError
from ..modelfile import ModelFile
from .archive import common_contents, content_guid, fmu_path, installed_version, write_archive
from .description import Backend, model_description

_BACKEND = Backend(
    {
        # The binary runs on the Python of the host.
        "needsExecutionTool": "true",
        "canInterpolateInputs": "false",
        "maxOutputDerivativeOrder": "0",
        "canRunAsynchronuously": "false",
        "canNotUseMemoryManagementFunctions": "true",
        "providesDirectionalDerivative": "false",
    }
)

# The rest of pythonfmu, and with it half its import time, serves to build FMUs.
_PYTHONFMU_SOURCES = (
    "_version.py", "default_experiment.py", "enums.py", "fmi2slave.py", "logmsg.py", "variables.py"
)  # fmt: skip
_BINARIES = ("linux64/libpythonfmu-export.so", "win64/pythonfmu-export.dll")

_SLAVE_MODULE = '''\
"""The slave of the FMU {name}, written by strandspring."""

from {package}.core.slave import SpringSlave, keep_module
from {package}.core.parameters import SpringParameters


class Spring(SpringSlave):
    fmu_guid = "{guid}"
    identified = {parameters!r}


# pythonfmu runs this file once more for each instance, in this module's namespace but with its own locals.
if locals() is not globals():
    keep_module(globals())
'''


def build_fmu(model: ModelFile, directory: Path, zero: float | None = None) -> Path:
    """Write ``<directory>/<model.name>_python.fmu``, an FMI 2.0 co-simulation FMU that runs on Python.

    Parameters
    ----------
    model : ModelFile
    directory : Path       Made if it does not exist.
    zero : float or None   Displacement of the model file at which that of the FMU is 0 [m]; by default the rig's zero
                           if it lies within the identified range, else the middle of the range.

    Returns
    -------
    Path                   The FMU.

    Raises
    ------
    StrandspringError  If a file of pythonfmu is missing, or the folder cannot be written to.
    """
    return write_archive(fmu_path(directory, model.name, "python"), fmu_contents(model, zero))


def fmu_contents(model: ModelFile, zero: float | None = None) -> dict[str, bytes]:
    """Every file of the Python-backed FMU by its path inside it."""
    model, zero = placed(model, zero)
    tool = f"strandspring {installed_version('strandspring')} with PythonFMU {installed_version('pythonfmu')}"
    sources = _sources()
    binaries = _binaries(model.name)
    # Without a GUID yet, the description holds the table, start values, name, texts and versions.
    guid = content_guid([model_description(model, "", tool, _BACKEND)], {**sources, **binaries})
    # Python keeps modules by name, so each FMU brings all of its code under a name of its own.
    package = "strandspring_" + guid.strip("{}").replace("-", "")[:12]
    slave = _SLAVE_MODULE.format(name=model.name, package=package, guid=guid, parameters=model.parameters)
    return {
        **common_contents(model, zero, model_description(model, guid, tool, _BACKEND), ("pythonfmu",)),
        **binaries,
        **{f"resources/{package}/{name}": content for name, content in sources.items()},
        f"resources/{package}_slave.py": slave.encode("utf-8"),
        "resources/slavemodule.txt": f"{package}_slave".encode(),
    }


def _sources() -> dict[str, bytes]:
    """The package that an FMU runs, by path inside the package."""
    ours = [file for file in (files("strandspring") / "core").iterdir() if file.name.endswith(".py")]
    sources = {"__init__.py": b"", "pythonfmu/__init__.py": b""}
    sources |= {f"core/{file.name}": file.read_bytes() for file in ours}
    sources |= {f"pythonfmu/{name}": _of_pythonfmu(name) for name in _PYTHONFMU_SOURCES}
    return {**sources, "core/facade.py": INSIDE_FMU.encode()}


def _binaries(name: str) -> dict[str, bytes]:
    binaries = {}
    for binary in _BINARIES:
        path = Path(binary)
        binaries[f"binaries/{path.parent}/{name}{path.suffix}"] = _of_pythonfmu(f"resources/binaries/{binary}")
    return binaries


def _of_pythonfmu(name: str) -> bytes:
    try:
        return (files("pythonfmu") / name).read_bytes()
    except OSError:
        raise BuildError(
            f"pythonfmu {installed_version('pythonfmu')} has no file {name}; install pythonfmu 0.7."
        ) from None
