"""`export`: a model for other tools: SSP parameter values, an SSP system, a Modelica library or C sources."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

from ...errors import StrandspringError
from ...exchange.c_sources import law_path, write_c_sources
from ...exchange.modelica import LIBRARY, record_path, write_library
from ...fmu.description.ssv import parameter_values
from ...ground.arguments import flag, optional_number
from ...ground.files import refuse_unwritable, write_text
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import placed
from ...model.modelfile import ModelFile
from ..common.model_source import ModelSource, model_of, origin_of
from ..common.progress import Progress, unseen


@dataclass(frozen=True)
class Exports:
    """Files to be written for a model.

    Parameters
    ----------
    model : ModelFile        In the record's coordinates.
    zero : float             Displacement of the model file at which that of the export is 0 [m].
    ssv : Path or None       File of SSP parameter values.
    ssp : Path or None       File of an SSP system.
    ssp_mass : float or None Mass in the system [kg].
    modelica : Path or None  Folder for the Modelica library.
    c : Path or None         Folder for the C sources.
    """

    model: ModelFile
    zero: float
    ssv: Path | None = None
    ssp: Path | None = None
    ssp_mass: float | None = None
    modelica: Path | None = None
    c: Path | None = None

    @property
    def files(self) -> dict[str, Path | None]:
        """The parameter values, the system, the spring's record in the Modelica library, its C file; None if not asked
        for.
        """
        name = self.model.name
        return {
            "ssv": self.ssv,
            "ssp": self.ssp,
            "modelica": None if self.modelica is None else record_path(self.modelica, name),
            "c": None if self.c is None else law_path(self.c, name),
        }

    def refuse_unwritable(self) -> None:
        """Raise StrandspringError if a file or the folder cannot be written."""
        for path in self.files.values():
            if path is not None:
                refuse_unwritable(path)

    def write(self, progress: Progress = unseen) -> list[Path]:
        """Write `files`, and return them.

        Raises
        ------
        StrandspringError   If a file cannot be written, or the folder holds something else by the library's name.
        BuildError          If the FMU of the system cannot be built.
        """
        content, _ = placed(self.model, self.zero)
        # The library first: it may be refused.
        if self.modelica is not None:
            write_library(self.modelica, content, self.zero)
        if self.ssv is not None:
            write_text(self.ssv, parameter_values(content))
        if self.ssp is not None and self.ssp_mass is not None:
            from ...exchange.ssp import ShakenMassValues, write_system
            from ...fmu.native.native_fmu import build_native_fmu

            progress("Building the FMU of the system", 0, 1)
            with TemporaryFolder() as folder:
                fmu = build_native_fmu(self.model, folder, zero=self.zero)
                write_system(self.ssp, fmu, content, ShakenMassValues.suited(content, self.ssp_mass))
        if self.c is not None:
            write_c_sources(self.c, content, self.zero)
        return [path for path in self.files.values() if path is not None]


def export(
    model: ModelSource,
    folder: str | os.PathLike[str] = "dist",
    *,
    ssv: bool = False,
    modelica: bool = False,
    c: bool = False,
    ssp_mass: float | None = None,
    zero: str | float | None = None,
) -> list[Path]:
    """Write a model as SSP parameter values, in an SSP system, into a Modelica library, or as C sources.

    Parameters
    ----------
    model : Spring, or path of a model file or FMU
    folder : path
    ssv : bool               Write NAME.ssv, the parameter values of the model's FMU.
    modelica : bool          Write the Modelica library StrandSpring with a record of the spring, beside others.
    c : bool                 Write C sources of the spring and its kernel for targets without FMI into the folder
                             strandspring_c, beside other springs.
    ssp_mass : float or None Write NAME.ssp, the native FMU below this mass [kg] on a shaking base.
    zero : "rig", "middle", float or None
        Where displacement is counted from: a displacement of the record [m]; by default as in the model's FMU.

    Returns
    -------
    list of Path             The files: NAME.ssv, NAME.ssp, the spring's record in the library and its C file, where
                             asked for.

    Raises
    ------
    StrandspringError        If nothing is asked for, an option is out of bounds, or a file cannot be written.
    ModelError               If the model is not a physically possible spring.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, export
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> with TemporaryDirectory() as folder:
    ...     print([path.name for path in export(spring, folder, ssv=True, modelica=True)])
    ['mount.ssv', 'mount.mo']
    """
    ssv, modelica, c = flag("ssv", ssv), flag("modelica", modelica), flag("c", c)
    if not (ssv or modelica or c or ssp_mass is not None):
        raise StrandspringError("Nothing to write; give `ssv`, `modelica`, `c` or `ssp_mass`.")
    ssp_mass = optional_number("ssp_mass", ssp_mass, "kg")
    if ssp_mass is not None and not (math.isfinite(ssp_mass) and ssp_mass > 0.0):
        raise StrandspringError(f"`ssp_mass` must be finite and > 0 [kg], got {ssp_mass!r}.")
    folder = Path(folder)
    content = model_of(model)
    if modelica:
        refuse_package(folder)
    exports = Exports(
        content,
        origin_of(model, zero, content.parameters),
        ssv=folder / f"{content.name}.ssv" if ssv else None,
        ssp=None if ssp_mass is None else folder / f"{content.name}.ssp",
        ssp_mass=ssp_mass,
        modelica=folder if modelica else None,
        c=folder if c else None,
    )
    refuse_unwritable(folder, is_folder=True)
    exports.refuse_unwritable()
    return exports.write()


def refuse_package(folder: Path) -> None:
    """Refuse a folder that is a Modelica package itself; raises StrandspringError."""
    if (folder / "package.mo").exists():
        raise StrandspringError(f"{folder} is a Modelica package; give the folder that holds the library {LIBRARY}.")
