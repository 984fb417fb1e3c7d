"""The Modelica library `StrandSpring`: components and examples once, and a record of parameters for each spring.

The folder ``assets/StrandSpring`` is the library without its springs. A spring is one file in ``Records``, so that any
number of springs can be exported into the same folder.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from .._version import __version__
from ..core.parameters import OF_MECHANISM, SCALARS, SpringParameters
from ..core.spline import Elastic
from ..errors import StrandspringError
from ..fmu.description.described_variables import start_omegas
from ..ground.files import read_text, reason_of, write_text
from ..model.coordinates import zero_sentence
from ..model.modelfile import ModelFile

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable  # not in Python 3.10

LIBRARY = "StrandSpring"
# What every library holds, for the examples: a stranded wire spring that carries about 5 kg.
EXAMPLE = ModelFile(
    "StrandedWireMount",
    SpringParameters(
        kE=(50.0, 2.0e4, 1.0e5, 2.0e7), kA=(1.0, 10.0, 100.0), kappa_omega=15.0, rho=400.0, sigma=1.0, n=0.5,
        displacement_offset=0.0, displacement_min=-0.03, displacement_max=0.03,
    ),
    "Stranded wire spring of the examples, with plausible parameters that were not measured",
)  # fmt: skip

_BASE = "SpringData"
_HEADER = f"within ;\npackage {LIBRARY} "
_MAXIMUM_BYTES = 1_000_000
# Keywords of Modelica 3.6, its predefined types and functions, and the names that Records uses itself.
_RESERVED = f"""
    algorithm and annotation block break class connect connector constant constrainedby der discrete each else elseif
    elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
    impure in initial inner input loop model not operator or outer output package parameter partial protected public
    pure record redeclare replaceable return stream then true type when while within
    AssertionLevel Boolean Clock Complex Connections ExternalObject Integer Modelica Real StateSelect String fill size
    time {LIBRARY}
""".split()
# The files beside the springs, where file names ignore case.
_FILES = {"package", _BASE.lower(), EXAMPLE.name.lower()}
_STRING_ESCAPES = str.maketrans({"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t"})


def record_name(name: str) -> str:
    """Name of the record of the model `name`: the same, after an underscore if it is reserved.

    No model's name begins with an underscore, so different models have different records.
    """
    return f"_{name}" if name in _RESERVED or name.lower() in _FILES else name


def record_path(folder: Path, name: str) -> Path:
    """File of the record of the model `name` in the library below `folder`."""
    return folder / LIBRARY / "Records" / f"{record_name(name)}.mo"


def write_library(folder: Path, model: ModelFile, zero: float) -> Path:
    """Write ``<folder>/StrandSpring`` with a record of the model, beside the records that it holds already.

    Parameters
    ----------
    folder : Path      Made if it does not exist.
    model : ModelFile  Its displacement is counted as by the FMU.
    zero : float       Where 0 of that lies on the record [m].

    Returns
    -------
    Path               The library.

    Raises
    ------
    StrandspringError  If the folder holds something else by that name, or another record whose name differs in upper
                       and lower case only, or cannot be written.
    """
    library, record = folder / LIBRARY, record_path(folder, model.name)
    _check_library(library)
    for other in _records(library):
        if other != record.stem and other.lower() == record.stem.lower():
            raise StrandspringError(
                f"{record} would take the place of {other}.mo where file names ignore case; rename one of the models, "
                f"or export to another folder."
            )
    # The file by which the library is known comes first, so that an export that was interrupted can be repeated.
    for path, text in sorted(_fixed_files(), key=lambda file: file[0] != "package.mo"):
        write_text(library / path, text)
    write_text(record.with_name(f"{EXAMPLE.name}.mo"), record_text(EXAMPLE, EXAMPLE.name, ""))
    counted = zero_sentence(zero) or "Displacement is counted as in the record and in the FMU."
    write_text(record, record_text(model, record.stem, counted))
    springs = sorted(set(_records(library)) - {_BASE, EXAMPLE.name})
    write_text(record.with_name("package.order"), "\n".join([_BASE, EXAMPLE.name, *springs, ""]))
    return library


def record_text(model: ModelFile, name: str, counted: str) -> str:
    """The record `name` with a model's parameters; `counted` says where 0 of the displacement lies."""
    spring = model.parameters
    elastic = Elastic(spring)
    arrays = {
        "kE": spring.kE,
        "FE_knots": spring.FE_knots,
        "FE_forces": spring.FE_forces,
        "FE_slopes": [elastic.slope(knot - spring.displacement_offset) for knot in spring.FE_knots],
        "kA": spring.kA,
        "second_kA": spring.second.kA if spring.second else (0.0,),
        "branch_stiffness": [branch.stiffness for branch in spring.branches],
        "branch_time_constant": [branch.time_constant for branch in spring.branches],
    }
    values = [_array(array, numbers) for array, numbers in arrays.items()]
    values += [f"    {scalar}={getattr(spring, scalar)!r}" for scalar in SCALARS]
    values.append(f"    omega_start={start_omegas(model)[0]!r}")
    if spring.second:
        values.append(f"    second_omega_start={start_omegas(model)[1]!r}")
        values += [f"    second_{name}={getattr(spring.second, name)!r}" for name in OF_MECHANISM if name != "kA"]
    title = model.description or "Hysteretic spring identified from measurement"
    paragraphs = [f"<p>\n{_string(escape(text))}\n</p>\n" for text in (model.description, counted) if text]
    return (
        f"within {LIBRARY}.Records;\n"
        f'record {name} "{_string(title)}"\n'
        f"  extends {LIBRARY}.Records.{_BASE}(\n" + ",\n".join(values) + ");\n"
        f'  annotation (Documentation(info="<html>\n{"".join(paragraphs)}</html>"));\n'
        f"end {name};\n"
    )


def _check_library(library: Path) -> None:
    """Refuse a folder that is not a library of ours."""
    package = library / "package.mo"
    try:
        is_new = not library.exists() or (library.is_dir() and not any(library.iterdir()))
    except OSError as problem:
        raise StrandspringError(f"{library} cannot be written: {reason_of(problem)}; check the rights there.") from None
    if is_new:
        return
    if not package.is_file() or not read_text(
        package, _MAXIMUM_BYTES, "a Modelica package", StrandspringError
    ).startswith(_HEADER):
        raise StrandspringError(
            f"{library} exists and is not a library that strandspring has written; export to another folder."
        )


def _records(library: Path) -> list[str]:
    """Names of the records in a library, whoever wrote them."""
    names = [path.stem for path in (library / "Records").glob("*.mo") if path.name != "package.mo"]
    return [name for name in names if re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII)]


def _fixed_files() -> Iterator[tuple[str, str]]:
    """Path and text of every file that is the same for all springs."""

    def below(folder: Traversable, prefix: str) -> Iterator[tuple[str, str]]:
        for entry in folder.iterdir():
            if entry.is_dir():
                yield from below(entry, f"{prefix}{entry.name}/")
            else:
                yield f"{prefix}{entry.name}", entry.read_text(encoding="utf-8").replace("@version@", __version__)

    return below(files(__package__) / "assets" / LIBRARY, "")


def _array(name: str, values: Sequence[float]) -> str:
    """Modification of an array of the record."""
    if not values:
        return f"    {name}=fill(0.0, 0)"
    lines = wrap(", ".join(map(repr, values)), 112, break_long_words=False, break_on_hyphens=False)
    begin = f"    {name}={{" if len(lines) == 1 else f"    {name}={{\n      "
    return begin + "\n      ".join(lines) + "}"


def _string(text: str) -> str:
    """Text with the escapes of a Modelica string."""
    return text.translate(_STRING_ESCAPES)
