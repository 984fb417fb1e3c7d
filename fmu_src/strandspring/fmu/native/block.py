"""One spring in the binary of a native FMU.

The binary is compiled once for all springs. It holds a block of values (core/c/fmu/fmu_block.c) that begins with a
marker; making an FMU of a spring means to overwrite the block. The same values as C source, for those who compile the
FMU's sources, are those of `values_source`.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Sequence
from typing import Any

from ...core.parameters import ARRAYS, SCALARS, SpringParameters
from ...core.variables import INPUT_RESOLUTION, start_values, variables
from ...errors import BuildError
from ...kernel.branches import added_fields
from ...kernel.path import packed
from ...kernel.structures import structures
from ...model.modelfile import ModelFile
from ..description.described_variables import start_omegas
from .macho import is_macho, with_new_hashes

# Marker: magic, size of the block, version of its layout. Then GUID, SpringParameters, omega_start, input_resolution,
# whether it is the form with states, what a spring has beside the paper's, and the variables.
_MARKER = struct.Struct("<16sII")
_MAGIC, _VERSION = b"strandspringfmu", 10

# What a variable is, in the order of SpringKind (core/c/fmu/fmu_variables.h): its name without the number.
_KINDS = (
    "displacement", "force", "stiffness", "absorbed_energy", "extrapolating", "omega", "kappa_omega", "rho", "sigma",
    "n", "displacement_offset", "displacement_min", "displacement_max", "kE", "FE_knots", "FE_forces", "kA",
    "omega_start", INPUT_RESOLUTION, "velocity", "der(absorbed_energy)", "der(omega)", "second_omega",
    "second_kappa_omega", "second_rho", "second_sigma", "second_n", "second_kA", "second_omega_start",
    "der(second_omega)", "branch_stiffness", "branch_time_constant", "branch_elongation", "der(branch_elongation)",
    "stored_energy",
)  # fmt: skip
_CAUSALITIES = ("input", "output", "local", "parameter")
_NUMBER = re.compile(r"_(\d+)")
_MOST_VARIABLES, _VARIABLE = 112, struct.Struct("<32s5B3xi4x")

# What counts the values of each array.
_COUNTS = {"kE": "elastic", "kA": "amplifier", "FE_knots": "knots", "FE_forces": "forces"}


def filled(image: bytes, model: ModelFile, guid: str, with_states: bool = False) -> bytes:
    """An image with the values of one spring in its block, and the form of its FMU.

    Raises
    ------
    BuildError   If the image does not have exactly one block of this layout.
    """
    parameters, (omega, second_omega) = model.parameters, start_omegas(model)
    values = struct.pack("<40s", guid.encode("ascii")) + packed(parameters.mechanisms[0])
    values += struct.pack("<2dq", omega, start_values(parameters)[INPUT_RESOLUTION], with_states)
    values += bytes(structures()["SpringAdded"](**added_fields(parameters))) + struct.pack("<d", second_omega)
    rows = [_VARIABLE.pack(name.encode(), *row) for name, *row in _variables(parameters, with_states)]
    values += struct.pack("<q", len(rows)) + b"".join(rows).ljust(_MOST_VARIABLES * _VARIABLE.size, b"\0")
    return with_block(image, _MAGIC, _VERSION, values)


def _variables(parameters: SpringParameters, with_states: bool) -> Iterator[tuple[Any, ...]]:
    """Of each variable: name, kind, causality, whether it is tunable, a state, and the rate of one, and its number."""
    table = variables(*parameters.counts, with_states=with_states)
    states = {variable.derivative_of for variable in table}
    for variable in table:
        name, number = variable.name, _NUMBER.search(variable.name)
        flags = (variable.variability == "tunable", name in states, variable.derivative_of is not None)
        kind, causality = _KINDS.index(_NUMBER.sub("", name)), _CAUSALITIES.index(variable.causality)
        yield name, kind, causality, *map(int, flags), int(number[1]) if number else 0


def with_block(image: bytes, magic: bytes, version: int, values: bytes) -> bytes:
    """An image with values behind the marker of its one block.

    Raises
    ------
    BuildError   If the image does not have exactly one such block of this size.
    """
    marker = _MARKER.pack(magic, _MARKER.size + len(values), version)
    if image.count(marker) != 1:
        raise BuildError(
            f"A compiled FMU must hold one block of values, found {image.count(marker)}; install strandspring again."
        )
    begin = image.index(marker) + _MARKER.size
    image = image[:begin] + values + image[begin + len(values) :]
    return with_new_hashes(image) if is_macho(image) else image


def values_source(model: ModelFile, guid: str, with_states: bool = False) -> str:
    """The text of spring_values.h."""
    parameters, (omega, second_omega) = model.parameters, start_omegas(model)
    start = start_values(parameters)
    # C11 has no empty initialisers.
    arrays = {name: values for name in ARRAYS if (values := getattr(parameters, name))}
    lists = "\n".join(f"        .{name} = {_listed(values)}," for name, values in arrays.items())
    counts = "\n".join(f"        .{_COUNTS[name]} = {len(values)}," for name, values in arrays.items())
    scalars = "\n".join(f"        .{name} = {start[name].hex()}," for name in SCALARS)
    rows = [*_variables(parameters, with_states)]
    listed = "\n".join(
        f'    {{"{name}", {", ".join(map(str, row))}, {{0}}, {number}, 0}},' for name, *row, number in rows
    )
    return f"""\
/* The start values of one spring's variables; the only source that differs from FMU to FMU. */
.guid = "{guid}",
.settings = {{
    .spring = {{
{counts}
{lists}
{scalars}
    }},
    .omega_start = {omega.hex()},
    .input_resolution = {start[INPUT_RESOLUTION].hex()},
    .has_states = {int(with_states)},
    .added = {{
{_added_source(parameters)}
    }},
    .second_omega_start = {second_omega.hex()},
}},
.count = {len(rows)},
.variables = {{
{listed}
}},
"""


def _added_source(parameters: SpringParameters) -> str:
    values = {name: value for name, value in added_fields(parameters).items() if value != ()}
    texts = {
        name: _listed(value) if isinstance(value, tuple) else value.hex() if isinstance(value, float) else str(value)
        for name, value in values.items()
    }
    return "\n".join(f"        .{name} = {text}," for name, text in texts.items())


def _listed(coefficients: Sequence[float]) -> str:
    # Hexadecimal floats give every compiler the same bits.
    return "{" + ", ".join(c.hex() for c in coefficients) + "}"
