"""One system in the binary of an FMU, and as C source; the layout is that of c/system_block.h."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SCALARS, SpringParameters
from ...errors import MountedSystemError
from ...kernel.branches import added_fields
from ...kernel.structures import rows, structures
from ...vibration.bodies.loads import ChannelKind
from ...vibration.bodies.mounted import MountedSystem
from ..native.block import with_block
from .system_variables import SystemFmuOptions, base_vectors, system_start_values, system_variables

_MAGIC, _VERSION = b"strandspringsys", 2
_VALUES, _NAMES = 32768, 131072
_GUID = 40
_COLUMNS = ("kE", "kA", "FE_knots", "FE_forces")  # in the order of SpringParameters of spring.h
_COUNTS = ("springs", "added", "bodies", "mounts", "axes", "points", "channels")


@dataclass(frozen=True)
class SystemBlock:
    """What a binary holds of one system.

    Attributes
    ----------
    counts : tuple of int       Springs, what some have beside the paper's, bodies, mounts, axes, points and channels.
    values : tuple of float
    names : bytes               Of the variables, each terminated.
    """

    counts: tuple[int, ...]
    values: tuple[float, ...]
    names: bytes

    def filled(self, image: bytes, guid: str) -> bytes:
        """An image with the block of the FMU that has this GUID.

        Raises
        ------
        BuildError   If the image does not have exactly one block of this layout.
        """
        content = struct.pack(f"<{_GUID}s{len(_COUNTS)}q", guid.encode("ascii"), *self.counts)
        content += struct.pack(f"<{len(self.values)}d", *self.values).ljust(8 * _VALUES, b"\0")
        return with_block(image, _MAGIC, _VERSION, content + self.names.ljust(_NAMES, b"\0"))

    def source(self, guid: str) -> str:
        """The text of system_values.h."""
        counts = ", ".join(f".{name} = {count}" for name, count in zip(_COUNTS, self.counts, strict=True))
        return f"""\
/* The values of one system; the only source that differs from FMU to FMU. */
.guid = "{guid}",
.counts = {{{counts}}},
.values = {{
{_rows([_number(value) for value in self.values], 8)}
}},
.names = {{
{_rows([str(byte) for byte in self.names], 32)}
}},
"""


def system_block(system: MountedSystem, options: SystemFmuOptions) -> SystemBlock:
    """The block of a system.

    Raises
    ------
    MountedSystemError   If it is too large for an FMU.
    """
    of_axes, channels = [axis.spring for axis in system.axes], channel_rows_of(system, options)
    springs = list(dict.fromkeys(mechanism for spring in of_axes for mechanism in spring.mechanisms))
    added = list(dict.fromkeys(spring for spring in of_axes if not spring.is_plain))
    table = system_variables(system, options)
    parameters = [variable for variable in table if variable.causality == "parameter"]
    start = system_start_values(system, options)
    parts = system.kernel_rows
    # Numbers in place of addresses.
    parts["axes"].view(np.float64).reshape(len(of_axes), -1)[:, :3] = [
        (
            springs.index(spring.mechanisms[0]),
            springs.index(spring.mechanisms[1]) if spring.second else -1,
            -1 if spring.is_plain else added.index(spring),
        )
        for spring in of_axes
    ]
    blocks = [*(parts[name] for name in ("bodies", "mounts", "axes", "points")), channels]
    values = [
        *(start[parameter.name] for parameter in parameters),
        *(float(parameter.minimum or 0.0) for parameter in parameters),
        *(float(parameter.maximum or 0.0) for parameter in parameters),
        *(value for spring in springs for value in _of_spring(spring)),
        *(value for spring in added for value in _of_added(spring)),
        *(value for block in blocks for value in block.view(np.float64).flat),
    ]
    names = b"".join(variable.name.encode("ascii") + b"\0" for variable in table)
    counts = (len(springs), len(added), *map(len, blocks))
    if len(values) > _VALUES or len(names) > _NAMES:
        raise MountedSystemError(
            f"The system is too large for an FMU: it has {len(values)} numbers, and names of {len(names)} letters, "
            f"of which {_VALUES} and {_NAMES} are possible; use fewer mounts or fewer different springs."
        )
    return SystemBlock(counts, tuple(values), names)


def channel_rows_of(system: MountedSystem, options: SystemFmuOptions) -> NDArray[np.void]:
    """The inputs as MotionChannel of motion.h, shape (C,)."""
    base, forces = base_vectors(system), options.forces
    places = [np.subtract(force.place, system.bodies[force.body].center) for force in forces]
    return rows(
        "MotionChannel",
        len(base) + len(forces),
        direction=[*base, *(force.direction for force in forces)],
        place=[*np.zeros_like(base), *places],
        kind=[ChannelKind.BASE_ACCELERATION.value] * len(base) + [ChannelKind.FORCE.value] * len(forces),
        body=[0] * len(base) + [force.body for force in forces],
    )


def _of_spring(spring: SpringParameters) -> list[float]:
    columns = [getattr(spring, name) for name in _COLUMNS]
    scalars = [getattr(spring, name) for name in SCALARS]
    return [*(float(len(column)) for column in columns), *(value for column in columns for value in column), *scalars]


def _of_added(spring: SpringParameters) -> list[float]:
    """The fields of SpringAdded as numbers, without the unused one."""
    added = structures()["SpringAdded"](**added_fields(spring))
    return [
        *(float(count) for count in (added.mechanisms, added.amplifier, added.branches)),
        *added.kA, added.kappa_omega, added.rho, added.sigma, added.n, *added.stiffness, *added.time_constant,
    ]  # fmt: skip


def _number(value: float) -> str:
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    # Hexadecimal floats give every compiler the same bits.
    return value.hex()


def _rows(texts: Sequence[str], per_row: int) -> str:
    return ",\n".join("    " + ", ".join(texts[k : k + per_row]) for k in range(0, len(texts), per_row))
