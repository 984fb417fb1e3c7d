"""A spring as C for programs that link the kernel without FMI: law and table as constants, and the kernel's sources.

The kernel stands once in the folder, and each spring has files of its own beside it, so that any number of springs can
be exported into the same folder. Their names and identifiers end in ``_law``: none is a word of C or of the kernel.
A spring with a second mechanism or branches has ``_law_first``, ``_law_second`` and ``_law_added`` instead, so that no
program takes the force of its first mechanism for the whole.
"""

from __future__ import annotations

import ctypes
import hashlib
import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from textwrap import fill, wrap

from ..core.parameters import SpringParameters
from ..fmu.description.described_variables import start_omegas
from ..ground.files import write_text
from ..kernel.branches import added_fields
from ..kernel.library import library
from ..kernel.path import packed
from ..kernel.structures import constants, structures
from ..model.coordinates import zero_sentence
from ..model.modelfile import ModelFile

FOLDER = "strandspring_c"
# What steps are compiled of; saturation_table.c, for targets that make tables, is empty otherwise.
STEP_SOURCES = ("saturation.c", "spline.c", "spring.c")
_SOURCES = (*STEP_SOURCES, "branches.c", "saturation_table.c")
_HEADER = "strandspring.h"
_EXAMPLE_OF = "mount"
_LOCAL = "spring_local.h"


def law_path(folder: Path, name: str) -> Path:
    """The C file of the spring `name` below `folder`."""
    return folder / FOLDER / f"{name}_law.c"


def constant_bytes(parameters: SpringParameters) -> int:
    """What laws and their tables take of a target's memory for constants, where a pointer has 8 bytes."""
    table, law, added = (
        ctypes.sizeof(structures(steps_only=True)[name]) for name in ("SpringTable", "SpringLaw", "SpringAdded")
    )
    return table * len(parameters.mechanisms) + (law if parameters.is_plain else 2 * law + added)


def write_c_sources(folder: Path, model: ModelFile, zero: float) -> Path:
    """Write the kernel and a spring into ``<folder>/strandspring_c``; the same model gives the same bytes.

    Parameters
    ----------
    folder : Path      Made if it does not exist.
    model : ModelFile  Its displacement is counted as by the FMU.
    zero : float       Where 0 of that lies on the record [m].

    Returns
    -------
    Path               The spring's C file.

    Raises
    ------
    StrandspringError  If the folder cannot be written, or the kernel is missing and cannot be compiled.
    """
    texts = _kernel()
    kernel = hashlib.sha256(repr(sorted(texts.items())).encode()).hexdigest()[:8]
    texts[_LOCAL] = (
        "/* Without this line, and with saturation_table.c, tables can be made here; see strandspring.h. */\n"
        f"#define SPRING_STEPS_ONLY\n\n{texts[_LOCAL]}\n"
        "/* The digest of these sources, of which a spring's table must be. */\n"
        f"#define SPRING_KERNEL 0x{kernel}\n"
    )
    name = model.name
    example = _examples(texts[_HEADER])[0 if model.parameters.is_plain else 1]
    texts[f"{name}_example.c"] = re.sub(rf"\b{_EXAMPLE_OF}_law(?=\b|_)", f"{name}_law", example)
    texts[f"{name}_law.h"] = _law_header(model, zero)
    # Last, as it is what the others are for.
    texts[f"{name}_law.c"] = _law_source(model, kernel)
    for file, text in texts.items():
        write_text(folder / FOLDER / file, text)
    return law_path(folder, name)


def _examples(header: str) -> list[str]:
    """The programs in the header's first comment: of the paper's spring, and of one that has more."""
    programs = re.findall(rf' \*     #include "{_EXAMPLE_OF}_law.h"\n.*?int main.*?\n \*     }}\n', header, re.DOTALL)
    return ["".join(f"{line[7:]}\n" for line in program.splitlines()) for program in programs]


def _kernel() -> dict[str, str]:
    """Every source of the kernel that a step needs, by name."""
    texts = {_HEADER: (files(__package__) / "assets" / _HEADER).read_text(encoding="utf-8")}
    wanted = [*_SOURCES, *_included(texts[_HEADER])]
    while wanted:
        name = wanted.pop()
        if name not in texts:
            texts[name] = (files("strandspring.core") / "c" / "spring" / name).read_text(encoding="utf-8")
            wanted += _included(texts[name])
    return dict(sorted(texts.items()))


def _included(text: str) -> list[str]:
    return re.findall(r'^#include "(\w+\.h)"', text, re.MULTILINE)


def _law_header(model: ModelFile, zero: float) -> str:
    p, name = model.parameters, model.name
    counted = zero_sentence(zero) or "Displacement is counted as in the record and in the FMU."
    said = (
        f"The spring {name}, identified from {p.displacement_min:.6g} m to {p.displacement_max:.6g} m. {counted} "
        "Constant: it may lie in flash, and any number of threads may read it."
    )
    if model.start is not None:
        omega, second_omega = start_omegas(model)
        added = "" if p.is_plain else f" and spring_added_start(0.0, {second_omega!r})"
        said += f" Its FMU begins with spring_start(0.0, {omega!r}){added}."
    if p.is_plain:
        extra, constants_of = "", {"": "SpringLaw"}
    else:
        extra = '#ifdef __cplusplus\nextern "C" {\n#endif\n#include "branches.h"\n#ifdef __cplusplus\n}\n#endif\n'
        constants_of = {"_first": "SpringLaw", "_second": "SpringLaw", "_added": "SpringAdded"}
    declared = [f"const {kind} {name}_law{suffix};\n" for suffix, kind in constants_of.items()]
    return (
        fill(said, 110, initial_indent="/* ", subsequent_indent=" * ", break_long_words=False, break_on_hyphens=False)
        + f' */\n#ifndef {name}_law_h\n#define {name}_law_h\n\n#include "{_HEADER}"\n{extra}\n'
        "#ifdef __cplusplus\n"
        + "".join(f'extern "C" {line}' for line in declared)
        + "#else\n"
        + "".join(f"extern {line}" for line in declared)
        + "#endif\n\n#endif\n"
    )


def _law_source(model: ModelFile, kernel: str) -> str:
    name, p = model.name, model.parameters
    if p.is_plain:
        constants_of = _law_constants(f"{name}_table", f"{name}_law", p)
    else:
        suffixes = ("first", "second")
        constants_of = "".join(
            _law_constants(f"{name}_{suffix}_table", f"{name}_law_{suffix}", mechanism)
            for suffix, mechanism in zip(suffixes, p.mechanisms, strict=False)
        )
        if p.second is None:
            constants_of += f"const SpringLaw {name}_law_second = {{0}};\n"
        added = structures()["SpringAdded"](**added_fields(p))
        constants_of += f"\nconst SpringAdded {name}_law_added = {_initializer(added)};\n"
    return (
        "/* Written by strandspring; exact, for hexadecimal floats give every compiler the same bits. */\n"
        f'#include "{name}_law.h"\n\n'
        f"#if SPRING_KERNEL != 0x{kernel}\n"
        '#error "This table is of other sources of the kernel; export the spring again."\n'
        f"#endif\n\n{constants_of}"
    )


def _law_constants(table_name: str, law_name: str, mechanism: SpringParameters) -> str:
    """A law and its table as C."""
    table, law = _constants(mechanism)
    return (
        f"static const SpringTable {table_name} = {_initializer(table)};\n\n"
        f"const SpringLaw {law_name} = {_initializer(law, table=f'&{table_name}')};\n"
    )


def _constants(parameters: SpringParameters) -> tuple[ctypes.Structure, ctypes.Structure]:
    """Table and law, which are zero wherever the kernel writes nothing."""
    table, law = (structures()[name]() for name in ("SpringTable", "SpringLaw"))
    held = constants()["SPRING_WITH_ENERGIES"]
    library().kernel_tabulate(ctypes.addressof(table), parameters.n, parameters.sigma, held)
    library().kernel_prepare(ctypes.addressof(law), packed(parameters), ctypes.addressof(table))
    return table, law


def _initializer(value: object, **pointers: str) -> str:
    """A value as C writes it, without what is zero."""
    if isinstance(value, ctypes.Structure):
        fields = _fields(value, pointers)
        return "{\n" + ",\n".join(f".{name} = {text}" for name, text in fields) + "}"
    if isinstance(value, ctypes.Array):
        count = next((k for k in range(len(value), 0, -1) if _is_set(value[k - 1])), 0)
        zero = "0" if issubclass(value._type_, ctypes._SimpleCData) else "{0}"
        items = [_initializer(value[k]) if _is_set(value[k]) else zero for k in range(count)]
        return "{" + "\n".join(wrap(", ".join(items), 112, break_long_words=False, break_on_hyphens=False)) + "}"
    if isinstance(value, float):
        return value.hex().replace("inf", "INFINITY")
    return str(value)


def _fields(value: ctypes.Structure, pointers: dict[str, str]) -> Iterator[tuple[str, str]]:
    for name, *_ in value._fields_:
        field = getattr(value, name)
        if name in pointers:
            yield name, pointers[name]
        elif _is_set(field):
            yield name, _initializer(field)


def _is_set(value: object) -> bool:
    """Whether a value is other than what C gives to what is not initialized."""
    if isinstance(value, float):
        return value.hex() != "0x0.0p+0"
    return any(bytes(value)) if isinstance(value, ctypes.Structure | ctypes.Array) else value != 0
