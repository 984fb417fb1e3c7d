"""One spring in the binary of a native FMU.

The binary is compiled once for all springs. It holds a block of values (core/c/fmu/fmu_block.c) that begins with a
marker; making an FMU of a spring means to overwrite the block. The same values as C source, for those who compile the
FMU's sources, are those of `values_source`.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from ...core.parameters import ARRAYS, SCALARS, SpringParameters
from ...core.variables import INPUT_RESOLUTION, start_values
from ...errors import BuildError
from ...kernel.branches import added_fields
from ...kernel.path import packed
from ...kernel.structures import structures
from ...model.modelfile import ModelFile
from ..description.described_variables import start_omegas
from .macho import is_macho, with_new_hashes

# Marker: magic, size of the block, version of its layout. Then GUID, SpringParameters, omega_start, input_resolution,
# and whether it is the form with states.
_MARKER = struct.Struct("<16sII")
_MAGIC, _VERSION = b"strandspringfmu", 9

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
    return with_block(image, _MAGIC, _VERSION, values)


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
