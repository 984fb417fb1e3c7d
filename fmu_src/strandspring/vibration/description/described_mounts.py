"""The axes of mount types in SYSTEM.toml, rotated as mounts are, and where their springs are under a preload."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from ...core.parameters import SpringParameters
from ...core.spline import Elastic
from ...errors import MountedSystemError
from ...ground.quoting import printable
from ...kernel.arrays import FloatArray
from ...model.modelfile import ModelFile
from ..bodies.parts import MountAxis, Stops, Vector
from .catalogue_table import catalogue_spring
from .system_tables import AxisTable, MountTypeTable, StopsTable, SystemTable
from .table_types import located

_CELLS = 400  # of the range in which a crossing is looked for
_MOST_KEPT = 2000

Models = Mapping[str, ModelFile]


def rotated_axes(
    name: str,
    turn: tuple[float, ...],
    *,
    table: SystemTable,
    models: Models,
    known: dict[tuple[str, tuple[float, ...]], tuple[MountAxis, ...]],
) -> tuple[MountAxis, ...]:
    """The axes of a mount type, rotated by a rotation vector [rad], () for none."""
    if (name, turn) not in known:
        if not turn:
            known[name, turn] = _unrotated(name, table.mount_type[name], models)
        else:
            rotation = Rotation.from_rotvec(turn)
            known[name, turn] = tuple(
                replace(axis, direction=_vector(rotation.apply(axis.direction)))
                for axis in rotated_axes(name, (), table=table, models=models, known=known)
            )
    return known[name, turn]


def _unrotated(name: str, table: MountTypeTable, models: Models) -> tuple[MountAxis, ...]:
    axes = []
    for k, axis in enumerate(table.axes):
        with located("mount_type", name, "axes", k):
            axes.append(_axis(axis, name, models))
    directions = np.array([axis.direction for axis in axes])
    if np.abs(directions @ directions.T - np.eye(len(axes))).max() > 1e-6:
        raise MountedSystemError(
            f"mount_type.{name}.axes: must be perpendicular to each other; they belong to one frame, which `rotate` "
            "turns as a whole."
        )
    return tuple(axes)


def _axis(table: AxisTable, type_name: str, models: Models) -> MountAxis:
    spring, source, stated = _spring(table, type_name, models)
    if table.nominal is not None and table.preload is not None:
        raise MountedSystemError("must have either `preload` or `nominal`, got both; leave one out.")
    if table.nominal is not None:
        nominal = table.nominal
    else:
        nominal = displacement_at(spring, table.preload or 0.0, table.preload is not None)
    return MountAxis(
        spring,
        table.direction.vector,
        nominal,
        table.parallel,
        table.series,
        table.damping,
        None if table.stops is None else _stops(table.stops, nominal),
        source,
        math.inf if table.rated_load is None else table.rated_load,
        None if table.catalogue is None else table.catalogue.amplitude,
        table.name or "",
        stated,
    )


def _spring(table: AxisTable, type_name: str, models: Models) -> tuple[SpringParameters, str, tuple[str, str]]:
    """The spring of an axis, where it comes from, and `MountAxis.stated`."""
    if (table.model is None) == (table.catalogue is None):
        raise MountedSystemError(
            "must have either `model`, a model file, or `catalogue`, what a vendor states; give one of them."
        )
    if table.catalogue is None:
        return models[table.model or ""].parameters, table.model or "", ("", "")
    with located("catalogue"):
        spring = catalogue_spring(table.catalogue)
    stated = f"catalogue values of {printable(table.catalogue.source) or type_name}", table.direction.text
    return spring, ", ".join(stated), stated


def _stops(table: StopsTable, nominal: float) -> Stops:
    if table.low is None and table.high is None:
        raise MountedSystemError("`stops` must have `low` or `high`; give one, or leave the stops out.")
    low = -math.inf if table.low is None else table.low
    high = math.inf if table.high is None else table.high
    if not low <= nominal <= high:
        raise MountedSystemError(
            f"the nominal displacement of {1e3 * nominal:.6g} mm must be between the stops, "
            f"{1e3 * low:.6g} and {1e3 * high:.6g} mm, displacements of one spring as its model counts; correct "
            "them."
        )
    return Stops(low, high, table.stiffness)


def _vector(values: FloatArray) -> Vector:
    length = math.hypot(*values.tolist())
    x, y, z = (component / length for component in values.tolist())
    return x, y, z


@lru_cache(maxsize=_MOST_KEPT)
def displacement_at(spring: SpringParameters, preload: float, is_given: bool = True) -> float:
    """Displacement at which the elastic force is the preload, with omega = 0 [m].

    Where there are several, it is the lowest at which the force rises.

    Parameters
    ----------
    spring : SpringParameters
    preload : float            Of one spring [N].
    is_given : bool            Whether somebody asked for it, for the message.

    Raises
    ------
    MountedSystemError         If there is none within the identified range; the message names neither file nor field.
    """
    elastic = Elastic(spring)
    places = np.linspace(spring.displacement_min, spring.displacement_max, _CELLS + 1)
    places[-1] = spring.displacement_max

    def excess(displacement: float) -> float:
        return elastic.force(displacement - spring.displacement_offset) - preload

    forces = np.array([excess(place) for place in places.tolist()])
    rising = np.flatnonzero((forces[:-1] <= 0.0) & (forces[1:] >= 0.0))
    cells = rising if rising.size else np.flatnonzero((forces[:-1] >= 0.0) & (forces[1:] <= 0.0))
    if cells.size:
        low, high = places[cells[0]], places[cells[0] + 1]
        return float(brentq(excess, low, high, xtol=1e-15 * max(1e-3, abs(low), abs(high)), rtol=8.9e-16))
    least, largest = forces.min() + preload, forces.max() + preload
    what = f"a preload of {preload:.6g} N is" if is_given else "without `preload` a spring begins at 0 N, which is"
    raise MountedSystemError(
        f"{what} outside the elastic forces of its identified range, {least:.6g} to {largest:.6g} N; give `preload` "
        "within them (of one spring), or `nominal`, the displacement of one spring."
    )
