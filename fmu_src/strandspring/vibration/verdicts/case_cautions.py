"""Cautions about what the figures of a load case do not hold, each a sentence with what was found."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.simulation import CaseRun
from .implausible_loads import implausible_loads
from .implausible_sizes import implausible_sizes
from .range_use import RangeUse

_LARGE_TILT = math.radians(10.0)  # from which the twist of mounts is felt, where no limit says more
_ROUNDING = 1e-9  # of a duration


class CautionKind(Enum):
    """What a caution is about; the value is how people name it."""

    OUTSIDE = "identified range"
    STOPS = "stops"
    COUPLED = "friction axes together"
    TILT = "tilt"
    SPEED = "speed"
    SPECTRUM = "spectrum"
    SETTLING = "settling"
    FALL = "fall"
    UNITS = "units"
    CATALOGUE = "catalogue"


@dataclass(frozen=True)
class Caution:
    """A caution about a load case.

    Parameters
    ----------
    kind : CautionKind
    measure : float      By which cautions of one kind are compared.
    text : str
    """

    kind: CautionKind
    measure: float
    text: str


def system_cautions(system: MountedSystem, models: Mapping[str, ModelFile]) -> tuple[str, ...]:
    """What the description of a system leaves out."""
    return (*implausible_sizes(system), *_across(system), *_shared(system), *_about_files(system, models))


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
            "Mounts act on points: their own resistance to rotation (roll, twist) is left out, which no record gives; "
            "real tilt is smaller where mounts stand close together."
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
            f"{name or 'One spring'} stands for perpendicular axes of the same mount ({_listed(sorted(mounts))}), "
            "and a model file does not say along which it was measured; check that the mount is alike along them."
        )


def _about_files(system: MountedSystem, models: Mapping[str, ModelFile]) -> Iterator[str]:
    for name in dict.fromkeys(axis.model for axis in system.axes):
        if name in models:
            yield from cautions_in_use(name, models[name])


def case_cautions(
    system: MountedSystem, case: LoadCase, runs: Sequence[CaseRun], uses: Sequence[RangeUse], tilt_limit: float | None
) -> tuple[Caution, ...]:
    """What the figures of a load case do not hold."""
    return (
        *(Caution(CautionKind.UNITS, 0.0, text) for text in implausible_loads(system, case)),
        *_outside(system, uses),
        *_stopped(system, uses),
        *_tilted(system, runs, tilt_limit),
        *_fast(system, runs),
        *_diluted(case),
        *_fallen(case),
    )


def _outside(system: MountedSystem, uses: Sequence[RangeUse]) -> Iterator[Caution]:
    outside = np.any([use.is_outside for use in uses], axis=0)
    if not outside.any():
        return
    beyond = np.max([use.beyond for use in uses], axis=0)
    worst = int(np.argmax(beyond))
    use = uses[0]
    yield Caution(
        CautionKind.OUTSIDE,
        float(beyond[worst]),
        f"{int(outside.sum())} of {outside.size} axes leave the identified range of their springs, "
        f"{system.axis_names[worst]} by {1e3 * beyond[worst]:.3g} mm beyond {1e3 * use.low[worst]:.4g} to "
        f"{1e3 * use.high[worst]:.4g} mm; there the model is continued linearly, and all figures of this case are "
        "extrapolated.",
    )


def _stopped(system: MountedSystem, uses: Sequence[RangeUse]) -> Iterator[Caution]:
    deflection = np.max([use.stop_deflection for use in uses], axis=0)
    if not deflection.any():
        return
    force = np.max([use.stop_force for use in uses], axis=0)
    worst = int(np.argmax(force))
    yield Caution(
        CautionKind.STOPS,
        float(force[worst]),
        f"{int(np.count_nonzero(deflection))} of {deflection.size} axes bottom on a stop, "
        f"{system.axis_names[worst]} by {1e3 * deflection[worst]:.3g} mm with {force[worst]:.4g} N; the stops are "
        "elastic and lossless.",
    )


def _tilted(system: MountedSystem, runs: Sequence[CaseRun], limit: float | None) -> Iterator[Caution]:
    tilt = np.max([run.figures.tilt for run in runs], axis=0)
    body = int(np.argmax(tilt))
    if tilt[body] > (_LARGE_TILT if limit is None else limit):
        than = f"the limit of {math.degrees(limit):.3g}" if limit is not None else f"{math.degrees(_LARGE_TILT):.0f}"
        yield Caution(
            CautionKind.TILT,
            float(tilt[body]),
            f"{system.bodies[body].name} tilts by {math.degrees(tilt[body]):.3g} degrees, more than {than}; the "
            "rotation itself is exact, but mounts twist at such angles, and their springs act along the axes of "
            "their supports.",
        )


def _fast(system: MountedSystem, runs: Sequence[CaseRun]) -> Iterator[Caution]:
    """The speed of the springs, which model files do not tell."""
    series = np.array([axis.series for axis in system.axes])
    rates = np.max([run.figures.rate for run in runs], axis=0) / series
    if rates.any():
        worst = int(np.argmax(rates))
        yield Caution(
            CautionKind.SPEED,
            float(rates[worst]),
            f"Springs move by up to {rates[worst]:.3g} m/s ({system.axis_names[worst]}); the model is rate "
            "independent, and model files do not tell the speed of their records: compare it, above all for rubber.",
        )


def _diluted(case: LoadCase) -> Iterator[Caution]:
    after = case.duration - case.load_end
    if case.settling > 0.0 and after > _ROUNDING * case.duration:
        yield Caution(
            CautionKind.SETTLING,
            after,
            f"Root mean squares are taken up to {case.duration:.4g} s, though the load ends at {case.load_end:.4g} "
            "s, so that they are lower than those of the vibration; leave `simulate` out.",
        )


def _fallen(case: LoadCase) -> Iterator[Caution]:
    if case.weightless:
        yield Caution(
            CautionKind.FALL,
            math.hypot(*case.velocity),
            "Sway, tilt and stroke are counted from the pose without weight, in which the fall ends.",
        )


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:4])
    return shown if len(names) <= 4 else f"{shown} and {len(names) - 4} more"
