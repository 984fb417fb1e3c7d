"""The Python-backed FMU as one file: description, documentation, licences, the slave, and the binaries of pythonfmu.

pythonfmu's builder runs the slave in this process, and writes dates, a random GUID and no units; here its parts are put
together with the model description of all our FMUs. The same model gives the same bytes, and nothing but the FMU itself
is written.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from ..core.facade import INSIDE_FMU
from ..errors import BuildError
from ..model.coordinates import placed
from ..model.modelfile import ModelFile
from .archive import common_contents, content_guid, fmu_path, installed_version, write_archive
from .description.content import Backend
from .description.described_variables import start_omegas
from .description.model_description import model_description
from .native.platforms import PYTHON_PLATFORMS
from .related_files import BuildSettings, related_files, sealed, version_of

# The rest of pythonfmu, and with it half its import time, serves to build FMUs.
_PYTHONFMU_SOURCES = (
    "_version.py", "default_experiment.py", "enums.py", "fmi2slave.py", "logmsg.py", "variables.py"
)  # fmt: skip

_SLAVE_MODULE = '''\
"""The slave of the FMU {name}, written by strandspring."""

from <package>.core.parameters import SpringParameters
from <package>.core.slave import SpringSlave


class Spring(SpringSlave):
    fmu_guid = "<guid>"
    identified = SpringParameters(**{parameters!r})
    omegas = {omegas!r}

    def __init__(self, **options):  # a class without methods would leave this module one reference short
        super().__init__(**options)
'''
# For each instance the binary puts the folder first on Python's path, imports the module and executes it once more.
_END_OF_MODULE = """

import atexit
import ctypes
import os
import pathlib
import sys

if globals() is locals() and sys.platform == "linux":  # imported
    # The binary frees its state twice where the process ends: the C++ runtime destroys the pointer to it, and then the
    # destructor of the library assigns to that pointer. Where Python ends first, it is freed once.
    for binary in pathlib.Path(__file__).parents[1].glob("binaries/linux64/*.so"):
        atexit.register(ctypes.CDLL(str(binary)).finalizePythonInterpreter)
if os.path.isfile(os.path.join(sys.path[0], __name__ + ".py")):
    del sys.path[0]  # or it would stay there
"""


def build_python_fmu(
    model: ModelFile,
    directory: Path,
    zero: str | float | None = None,
    needs_execution_tool: bool = False,
    author: str = "",
) -> Path:
    """Write ``<directory>/<model.name>_python.fmu``, an FMI 2.0 co-simulation FMU that runs on Python.

    It runs on `PYTHON_PLATFORMS`, in hosts that run on Python or have loaded its shared library.

    Parameters
    ----------
    model : ModelFile
    directory : Path                    Made if it does not exist.
    zero : str, float or None           Displacement of the model file at which that of the FMU is 0 [m]; by default the
                                        rig's zero if it lies within the identified range, else the middle of the range.
    needs_execution_tool : bool         Whether the model description says that the simulator's computer needs a tool,
                                        here Python. Importers such as PyFMI refuse such FMUs. By default it does not:
                                        the FMU holds the model, and Python is to it what a library is.
    author : str                        For the model description.

    Returns
    -------
    Path                   The FMU.

    Raises
    ------
    StrandspringError  If a file of pythonfmu is missing, or the folder cannot be written to.
    """
    contents = fmu_contents(model, zero, needs_execution_tool, author)
    return write_archive(fmu_path(directory, model.name, "python"), contents)


def fmu_contents(
    model: ModelFile, zero: str | float | None = None, needs_execution_tool: bool = False, author: str = ""
) -> dict[str, bytes]:
    """Every file of the Python-backed FMU by its path inside it."""
    of_record = model
    model, zero = placed(model, zero)
    tool = f"strandspring {installed_version('strandspring')} with PythonFMU {installed_version('pythonfmu')}"
    backend = _backend(needs_execution_tool, author, version_of(of_record.to_json()))
    parameters = {"kE": (), **model.parameters.as_dict()}
    slave = _SLAVE_MODULE.format(name=model.name, parameters=parameters, omegas=start_omegas(model))
    # Without a GUID yet, the description holds the table, start values, name, texts and versions.
    guid, contents = slave_contents(model.name, slave, model_description(model, "", tool, backend))
    common = common_contents(model, zero, model_description(model, guid, tool, backend), backend, ("pythonfmu",))
    settings = BuildSettings("python", zero, author, needs_execution_tool)
    return sealed({**common, **related_files(of_record, settings), **contents})


def slave_contents(name: str, slave: str, description: bytes) -> tuple[str, dict[str, bytes]]:
    """GUID of an FMU that runs on Python, and its binaries and code by path inside it.

    Parameters
    ----------
    name : str             Model identifier.
    slave : str            Module with one class derived from Fmi2Slave, which defines a method; <package> and <guid> in
                           it stand for the name under which the FMU brings `strandspring.core` and pythonfmu, and for
                           the GUID.
    description : bytes    Model description without a GUID.
    """
    sources = _sources()
    slave += _END_OF_MODULE
    binaries = {
        f"binaries/{folder}/{name}{Path(file).suffix}": _of_pythonfmu(f"resources/binaries/{folder}/{file}")
        for folder, file in PYTHON_PLATFORMS.items()
    }
    guid = content_guid([description, slave.encode("utf-8")], {**sources, **binaries})
    # Python keeps modules by name, so each FMU brings all of its code under a name of its own.
    package = "strandspring_" + guid.strip("{}").replace("-", "")[:12]
    module = slave.replace("<package>", package).replace("<guid>", guid)
    return guid, {
        **binaries,
        **{f"resources/{package}/{path}": content for path, content in sources.items()},
        f"resources/{package}_slave.py": module.encode("utf-8"),
        "resources/slavemodule.txt": f"{package}_slave".encode(),
    }


def _backend(needs_execution_tool: bool, author: str, version: str) -> Backend:
    return Backend(
        {
            "needsExecutionTool": "true" if needs_execution_tool else "false",
            "canInterpolateInputs": "false",
            "maxOutputDerivativeOrder": "0",
            "canRunAsynchronuously": "false",
            "canNotUseMemoryManagementFunctions": "true",
            "providesDirectionalDerivative": "false",
        },
        author=author,
        version=version,
    )


def _sources() -> dict[str, bytes]:
    """The package that an FMU runs, by path inside the package."""
    ours = [file for file in (files("strandspring") / "core").iterdir() if file.name.endswith(".py")]
    sources = {"__init__.py": b"", "pythonfmu/__init__.py": b""}
    sources |= {f"core/{file.name}": file.read_bytes() for file in ours}
    sources |= {f"pythonfmu/{name}": _of_pythonfmu(name) for name in _PYTHONFMU_SOURCES}
    return {**sources, "core/facade.py": INSIDE_FMU.encode()}


def _of_pythonfmu(name: str) -> bytes:
    try:
        return (files("pythonfmu") / name).read_bytes()
    except OSError:
        raise BuildError(
            f"pythonfmu {installed_version('pythonfmu')} has no file {name}; install pythonfmu 0.7."
        ) from None
