"""FMPy's instances of FMUs: the library that it must load on this computer, and one set of names for both versions.

FMPy assumes for FMI 2.0 that every computer has an x86 processor, so the path of the library is always given to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import Array, c_double, c_uint
from pathlib import Path
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmpy.model_description import ModelDescription

from ...errors import BuildError
from ..native.platforms import host_folder


def fmi_version(description: ModelDescription) -> int:
    """The version of FMI, 2 or 3."""
    return int(description.fmiVersion[0])


def library_path(unzipped: str, model_identifier: str, fmi: int = 2) -> str:
    """The shared library of an unzipped FMU for this computer; FMPy raises if there is none.

    Raises
    ------
    BuildError   If the FMU runs on Python and lies where PythonFMU's binary would end the process: of the encoded
                 characters of a URI it decodes spaces only.
    """
    resources = Path(unzipped, "resources")
    if (resources / "slavemodule.txt").exists() and "%" in resources.as_uri().replace("%20", " "):
        raise BuildError(
            f"the binary of a Python-backed FMU cannot read the folder {unzipped}; set TMPDIR to one named by "
            "ASCII letters and digits."
        )
    return str(Path(unzipped, "binaries", str(host_folder(fmi)), f"{model_identifier}{fmpy.sharedLibraryExtension}"))


class _NamesOfFmi2:
    """Calls of FMI 3.0 under the names that FMPy gives those of FMI 2.0."""

    _start_time = 0.0

    def setupExperiment(self, startTime: float) -> None:  # noqa: N802
        """Keep the start time, which is an argument of the next call."""
        self._start_time = startTime

    def enterInitializationMode(self: Any) -> None:  # noqa: N802
        """fmi3EnterInitializationMode."""
        super().enterInitializationMode(startTime=self._start_time)  # type: ignore[misc]

    def setReal(self: Any, references: Sequence[int], values: Sequence[float]) -> None:  # noqa: N802
        """fmi3SetFloat64."""
        self.setFloat64(references, values)

    def getReal(self: Any, references: Sequence[int]) -> list[float]:  # noqa: N802
        """fmi3GetFloat64."""
        return list(self.getFloat64(references))

    def fmi2SetReal(  # noqa: N802
        self: Any, component: Any, references: Array[c_uint], count: int, values: Array[c_double]
    ) -> None:
        """fmi3SetFloat64, of scalars."""
        self.fmi3SetFloat64(component, references, count, values, count)

    def fmi2GetReal(  # noqa: N802
        self: Any, component: Any, references: Array[c_uint], count: int, values: Array[c_double]
    ) -> None:
        """fmi3GetFloat64, of scalars."""
        self.fmi3GetFloat64(component, references, count, values, count)


class _Slave3(_NamesOfFmi2, FMU3Slave):  # type: ignore[misc]
    getFMUstate = FMU3Slave.getFMUState
    setFMUstate = FMU3Slave.setFMUState
    freeFMUstate = FMU3Slave.freeFMUState


class _Model3(_NamesOfFmi2, FMU3Model):  # type: ignore[misc]
    newDiscreteStates = FMU3Model.updateDiscreteStates
    getDerivatives = FMU3Model.getContinuousStateDerivatives


# By version of FMI.
SLAVES = {2: FMU2Slave, 3: _Slave3}
MODELS = {2: FMU2Model, 3: _Model3}
