"""`export`: a model for other tools: SSP parameter values, an SSP system, a Modelica library or C sources."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

from ...errors import OptionError, StrandspringError
from ...exchange.c_sources import constant_bytes, law_path, write_c_sources
from ...exchange.modelica import LIBRARY, record_name, record_path, write_library
from ...fmu.description.ssv import parameter_values
from ...ground.arguments import flag, optional_number
from ...ground.files import reason_of, refuse_unwritable, write_text
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import placed, zero_sentence
from ...model.modelfile import ModelFile
from ..common.model_source import ModelSource, Progress, model_of, origin_of, unseen
from ..common.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class Exports(Result):
    """Files to be written for a model; the arguments are those of `export`."""

    source: ModelSource
    output: str | os.PathLike[str]
    ssv: bool = False
    modelica: bool = False
    c: bool = False
    ssp_mass: float | None = None
    zero: str | float | None = None

    _stated: ClassVar[Mapping[str, Any]] = {}

    @cached_property
    def model(self) -> ModelFile:
        """In the record's coordinates."""
        return model_of(self.source)

    @cached_property
    def origin(self) -> float:
        """Displacement of the model file at which that of the export is 0 [m]."""
        return origin_of(self.source, self.zero, self.model.parameters)

    @cached_property
    def files(self) -> dict[str, Path | None]:
        """The parameter values, the system, the spring's record in the Modelica library, its C file; None if not asked
        for. Raises OptionError if what is written does not go there.
        """
        name, target = self.model.name, Path(self.output)
        for what, is_asked in ((f"The Modelica library {LIBRARY} is", self.modelica), ("The C sources are", self.c)):
            if is_asked and target.suffix and not target.is_dir():
                raise OptionError(f"{what} a folder; {{to[output]}} must be a folder, got {{where}}.", where=target)
        if self.modelica and (target / "package.mo").exists():
            raise OptionError(f"{target} is a Modelica package; give the folder that holds the library {LIBRARY}.")
        return {
            "ssv": _file(target, f"{name}.ssv") if self.ssv else None,
            "ssp": None if self.ssp_mass is None else _file(target, f"{name}.ssp"),
            "modelica": record_path(target, name) if self.modelica else None,
            "c": law_path(target, name) if self.c else None,
        }

    def parts(self, brief: bool) -> Iterator[str]:  # noqa: ARG002 - all of it is short
        """What is written, in words."""
        library, record = Path(self.output) / LIBRARY, f"{LIBRARY}.Records.{record_name(self.model.name)}"
        size = constant_bytes(self.model.parameters) / 1000
        said = {
            "ssv": f"SSP parameter values: {self.files['ssv']}",
            "ssp": f"SSP system: {self.files['ssp']}",
            "modelica": f"Modelica library: {library}, record {record}",
            "c": f"C sources: {self.files['c']} and what it needs; {size:.0f} kB of constants",
        }
        if sentence := zero_sentence(self.origin):
            yield sentence
        yield from (said[kind] for kind, path in self.files.items() if path is not None)

    def content(self) -> dict[str, Any]:
        """The files."""
        return {"name": self.model.name, "zero": self.origin, **self.files}

    def refuse_unwritable(self) -> None:
        """Raise StrandspringError if a file or the folder cannot be written."""
        for path in filter(None, self.files.values()):
            refuse_unwritable(path)

    def write(self, progress: Progress = unseen) -> list[Path]:
        """Write `files`, and return them.

        Raises
        ------
        StrandspringError   If a file cannot be written, or the folder holds something else by the library's name.
        BuildError          If the FMU of the system cannot be built.
        """
        content, _ = placed(self.model, self.origin)
        # The library first: it may be refused.
        if self.modelica:
            write_library(Path(self.output), content, self.origin)
        if path := self.files["ssv"]:
            write_text(path, parameter_values(content))
        if (path := self.files["ssp"]) and self.ssp_mass is not None:
            from ...exchange.ssp import ShakenMassValues, write_system
            from ...fmu.native.native_fmu import build_native_fmu

            progress("Building the FMU of the system", 0, 1)
            with TemporaryFolder() as folder:
                fmu = build_native_fmu(self.model, folder, zero=self.origin)
                write_system(path, fmu, content, ShakenMassValues.suited(content, self.ssp_mass))
        if self.c:
            write_c_sources(Path(self.output), content, self.origin)
        return list(filter(None, self.files.values()))


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
    folder : path            Or the file to write, ending in .ssv or .ssp.
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
    exports = Exports(model, folder, ssv, modelica, c, ssp_mass, zero)
    refuse_unwritable(Path(folder), is_folder=not Path(folder).suffix)
    exports.refuse_unwritable()
    return exports.write()


def _file(output: Path, name: str) -> Path:
    """The file `name` in the folder `output`, or `output` itself if it has the suffix of `name`."""
    suffix = Path(name).suffix
    try:
        if output.is_dir() or not (output.suffix or output.exists()):
            return output / name
    except OSError as problem:
        raise StrandspringError(f"{output} cannot be written: {reason_of(problem)}; check the rights there.") from None
    if not output.suffix:
        refuse_unwritable(output, is_folder=True)
    if output.suffix != suffix:
        sentence = f"{{to[output]}} must be a folder, or a file name ending in {suffix}, got {{where}}."
        raise OptionError(sentence, where=output)
    return output
