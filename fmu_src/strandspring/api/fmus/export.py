"""`export`: a model as SSP parameter values, in an SSP system, in a Modelica library or as C sources."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import OptionError, StrandspringError
from ...exchange.c_sources import constant_bytes, law_path, write_c_sources
from ...exchange.modelica import LIBRARY, record_name, record_path, write_library
from ...fmu.description.ssv import parameter_values
from ...ground.arguments import flag, optional_number
from ...ground.files import refuse_unwritable, refused_in_words, write_text
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import placed, zero_sentence
from ...model.modelfile import ModelFile
from ..common.model_source import ModelSource, Progress, model_of, origin_of, unseen
from ..common.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class Exports(Result):
    """Files that were written for a model.

    Attributes
    ----------
    model : ModelFile         In the record's coordinates.
    origin : float            Displacement of the model file at which that of the export is 0 [m].
    output : Path             The folder, or the file.
    files : mapping of Path   The parameter values "ssv", the system "ssp", the record "modelica", the file "c"; None
                              if not asked for.
    """

    model: ModelFile
    origin: float
    output: Path
    files: Mapping[str, Path | None]

    def parts(self, brief: bool) -> Iterator[str]:  # noqa: ARG002 - all of it is short
        """What was written, in words."""
        name, record = self.model.name, record_name(self.model.name)
        taken = "" if record == name else f", because {name} is taken in Modelica"
        size = constant_bytes(self.model.parameters) / 1000
        said = {
            "ssv": f"SSP parameter values: {self.files['ssv']}",
            "ssp": f"SSP system: {self.files['ssp']}",
            "modelica": f"Modelica library: {self.output / LIBRARY}, record {LIBRARY}.Records.{record}{taken}",
            "c": f"C sources: {self.files['c']} and what it needs; {size:.0f} kB of constants",
        }
        if sentence := zero_sentence(self.origin):
            yield sentence
        yield from (said[kind] for kind, path in self.files.items() if path is not None)

    def content(self) -> dict[str, Any]:
        """The files."""
        return {"name": self.model.name, "zero": self.origin, **self.files}


def export_files(
    source: ModelSource, folder: str | os.PathLike[str], progress: Progress = unseen, *, ssv: bool, modelica: bool,
    c: bool, ssp_mass: float | None, zero: str | float | None, claim: Callable[[Path], None] = refuse_unwritable,
) -> Exports:  # fmt: skip
    """See `export`; before anything is written, `claim` refuses paths that must not be."""
    model, target = model_of(source), Path(folder)
    if (modelica or c) and target.suffix and not target.is_dir():
        what = f"of the library {LIBRARY}" if modelica else "of the C sources"
        raise OptionError(f"{{to[output]}} must be the folder {what}, got {{where}}.", where=target)
    if modelica and (target / "package.mo").exists():
        raise OptionError(f"{target} is a Modelica package; give the folder that holds the library {LIBRARY}.")
    files = {
        "ssv": _file(target, f"{model.name}.ssv") if ssv else None,
        "ssp": None if ssp_mass is None else _file(target, f"{model.name}.ssp"),
        "modelica": record_path(target, model.name) if modelica else None,
        "c": law_path(target, model.name) if c else None,
    }
    origin = origin_of(source, zero, model.parameters)
    for file in filter(None, files.values()):
        claim(file)
    content, _ = placed(model, origin)
    # The library first: it may be refused.
    if modelica:
        write_library(target, content, origin)
    if path := files["ssv"]:
        write_text(path, parameter_values(content))
    if (path := files["ssp"]) and ssp_mass is not None:
        from ...exchange.ssp import ShakenMassValues, write_system
        from ...fmu.native.native_fmu import build_native_fmu

        progress("Building the FMU of the system", 0, 1)
        with TemporaryFolder() as beside:
            fmu = build_native_fmu(model, beside, zero=origin)
            write_system(path, fmu, content, ShakenMassValues.suited(content, ssp_mass))
    if c:
        write_c_sources(target, content, origin)
    return Exports(model, origin, target, files)


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
    folder : path     Or the file to write, ending in .ssv or .ssp.
    ssv : bool        Write NAME.ssv, the parameter values of the model's FMU.
    modelica : bool   Write the Modelica library StrandSpring with a record of the spring, beside others.
    c : bool          Write C sources of the spring and its kernel for targets without FMI into the folder
                      strandspring_c, beside other springs.
    ssp_mass : float or None Write NAME.ssp, the native FMU below this mass [kg] on a shaking base.
    zero : "rig", "middle", float or None
        Where displacement is counted from: a displacement of the record [m]; by default as in the model's FMU.

    Returns
    -------
    list of Path   The files: NAME.ssv, NAME.ssp, the spring's record in the library and its C file, where
                   asked for.

    Raises
    ------
    StrandspringError   If nothing is asked for, an option is out of bounds, or a file cannot be written.
    BuildError          If the FMU of the system cannot be built.
    ModelError          If the model is not a physically possible spring.

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
    refuse_unwritable(Path(folder), is_folder=not Path(folder).suffix)
    made = export_files(model, folder, ssv=ssv, modelica=modelica, c=c, ssp_mass=ssp_mass, zero=zero)
    return list(filter(None, made.files.values()))


def _file(output: Path, name: str) -> Path:
    """The file `name` in the folder `output`, or `output` itself if it has the suffix of `name`."""
    suffix = Path(name).suffix
    with refused_in_words(output):
        if output.is_dir() or not (output.suffix or output.exists()):
            return output / name
    if output.suffix != suffix:
        sentence = f"{{to[output]}} must be a folder, or a file name ending in {suffix}, got {{where}}."
        raise OptionError(sentence, where=output)
    return output
