"""Cautions about the description of a system: what it leaves out, its model files and catalogues, overloaded mounts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...core.spline import Elastic
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ..bodies.mounted import MountedSystem
from ..bodies.parts import MountAxis
from .implausible_relations import implausible_relations
from .implausible_sizes import implausible_sizes
from .static_answer import StaticAnswer


def system_cautions(system: MountedSystem, models: Mapping[str, ModelFile]) -> tuple[str, ...]:
    """What the description of a system leaves out."""
    return (
        *implausible_sizes(system),
        *implausible_relations(system),
        *_across(system),
        *_shared(system),
        *_about_files(system, models),
        *catalogue_cautions(system),
    )


def _across(system: MountedSystem) -> Iterator[str]:
    """Mounts that have no force in some directions, or no moment."""
    few = [mount.name for mount in system.mounts if len(mount.axes) < 3]
    turning = any(body.rotations.any() for body in system.bodies)
    if few and any(
        not np.allclose(body.translations, 0.0) and np.trace(body.translations) > 1.5 for body in system.bodies
    ):
        yield (
            f"{len(few)} of {len(system.mounts)} mounts ({_listed(few)}) have fewer than three axes: across them they "
            "have neither stiffness nor friction; add axes with a shear record if the mount has."
        )
    if turning:
        yield (
            "Mounts act on points, without resistance to rotation of their own (roll, twist): real tilt is smaller "
            "where they stand close together."
        )


def _shared(system: MountedSystem) -> Iterator[str]:
    """Model files that serve perpendicular axes of one mount."""
    used: dict[str, set[str]] = {}
    for mount in system.mounts:
        for name in {axis.model for axis in mount.axes}:
            if sum(axis.model == name for axis in mount.axes) > 1:
                used.setdefault(name, set()).add(mount.name)
    for name, mounts in sorted(used.items()):
        yield (
            f"{name or 'One spring'} stands for perpendicular axes of the same mount: check that the mount is alike "
            f"along them. ({_listed(sorted(mounts))}; a model file does not say along which axis it was measured)"
        )


def _about_files(system: MountedSystem, models: Mapping[str, ModelFile]) -> Iterator[str]:
    for name in dict.fromkeys(axis.model for axis in system.axes):
        if name in models:
            yield from cautions_in_use(name, models[name])


def catalogue_cautions(system: MountedSystem) -> Iterator[str]:
    """What is not known of springs from a catalogue, one sentence for each source."""
    axes = {axis.model: axis for axis in system.axes if axis.stated_amplitude is not None}
    of_source: dict[str, list[str]] = {}
    for name, axis in axes.items():
        source, _, direction = name.rpartition(", ")
        of_source.setdefault(source, []).append(f"{direction} {_stated(axis)}")
    for source, stated in of_source.items():
        yield (
            f"No loops stand behind {source}: away from their amplitudes, speed and temperature, stiffness and damping "
            f"are assumed; keep a margin, or record loops. ({'; '.join(stated)})"
        )


def _stated(axis: MountAxis) -> str:
    amplitude, spring = axis.stated_amplitude or 0.0, axis.spring
    small = Elastic(spring).slope(axis.nominal - spring.displacement_offset) + spring.kappa_omega * spring.rho
    return (
        f"is stated at +-{1e3 * amplitude:.4g} mm, and has {1e-3 * small:.4g} N/mm in small motion and friction of "
        f"+-{spring.kappa_omega:.4g} N"
    )


def overloads(system: MountedSystem, static: StaticAnswer) -> Iterator[str]:
    """Mounts that rest under more than the rated load of their springs, whatever the omega."""
    rated = np.array([axis.parallel * axis.rated_load for axis in system.axes])
    shares = np.max([np.abs(pose.force) for pose in static.poses], axis=0) / rated
    beyond = shares > 1.0
    if beyond.any():
        worst = int(np.argmax(shares))
        yield (
            f"{int(beyond.sum())} of {int(np.isfinite(rated).sum())} axes with a rated static load rest under more, "
            f"{system.axis_names[worst]} under {shares[worst] * rated[worst]:.4g} N of {rated[worst]:.4g} N; use more "
            "or larger mounts."
        )


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:4])
    return shown if len(names) <= 4 else f"{shown} and {len(names) - 4} more"
