"""Cautions about what the figures of a load case do not hold, each a sentence with what was found."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ...kernel.path import PathSolver
from ...loops.loop import steady_loop
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.parts import MountAxis
from ..bodies.simulation import CaseRun
from .draws import DrawnRun
from .figures import RangeUse
from .implausible_loads import implausible_loads
from .implausible_relations import implausible_relations

_LARGE_TILT = math.radians(10.0)  # from which the twist of mounts is felt, where no limit says more
_ROUNDING = 1e-9  # of a duration
_SWUNG = 0.5  # half the swing of omega from which an axis' friction is saturated in good part
_FAR = 2.0  # factor between amplitudes from which a swing is another than a catalogue states
_AT_REST = 1e-6  # of the stated amplitude: below, a spring does not move


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
    RELATION = "relation"
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


def case_cautions(
    system: MountedSystem,
    case: LoadCase,
    nominal: CaseRun,
    draws: Sequence[DrawnRun],
    uses: Sequence[RangeUse],
    tilt_limit: float | None,
) -> tuple[Caution, ...]:
    """What the figures of a load case do not hold.

    Parameters
    ----------
    system : MountedSystem
    case : LoadCase
    nominal : CaseRun
    draws : sequence of DrawnRun
    uses : sequence of RangeUse   Of all these runs.
    tilt_limit : float or None    [rad].
    """
    runs = (nominal, *(draw.run for draw in draws))
    return (
        *(Caution(CautionKind.UNITS, 0.0, text) for text in implausible_loads(system, case)),
        *(Caution(CautionKind.RELATION, 0.0, text) for text in implausible_relations(system, case)),
        *_outside(system, uses),
        *_stopped(system, uses),
        *_tilted(system, runs, tilt_limit),
        *_fast(system, runs),
        *_diluted(case),
        *_fallen(case),
        *_coupled(system, nominal, draws),
        *_swings_apart(system, uses),
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
        f"{int(outside.sum())} of {outside.size} axes leave the identified range of their springs: all figures of this "
        f"case are extrapolated. ({system.axis_names[worst]} by {1e3 * beyond[worst]:.3g} mm beyond "
        f"{1e3 * use.low[worst]:.4g} to {1e3 * use.high[worst]:.4g} mm, where the model is continued linearly)",
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
            f"{system.bodies[body].name} tilts by {math.degrees(tilt[body]):.3g} degrees, more than {than}: mounts "
            "twist at such angles, which is left out. (The rotation itself is exact; springs act along the axes of "
            "their supports)",
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
            f"Springs move by up to {rates[worst]:.3g} m/s: compare the speed of their records, above all for rubber. "
            f"({system.axis_names[worst]}; the model is rate independent, and model files do not tell that speed)",
        )


def _diluted(case: LoadCase) -> Iterator[Caution]:
    after = case.duration - case.load_end
    if case.settling > 0.0 and after > _ROUNDING * case.duration:
        yield Caution(
            CautionKind.SETTLING,
            after,
            f"Root mean squares are taken up to {case.duration:.4g} s, though the load ends at {case.load_end:.4g} "
            "s: they are too low; leave `simulate` out.",
        )


def _fallen(case: LoadCase) -> Iterator[Caution]:
    if case.weightless:
        yield Caution(
            CautionKind.FALL,
            math.hypot(*case.velocity),
            "Sway, tilt and stroke are counted from the pose without weight, in which the fall ends.",
        )


def _coupled(system: MountedSystem, nominal: CaseRun, draws: Sequence[DrawnRun]) -> Iterator[Caution]:
    """A caution if several axes of a mount slide at once: by how much coupled friction changes the largest figures."""
    swing = 0.5 * (nominal.figures.omega_high - nominal.figures.omega_low)
    together = []
    for mount, axes in zip(system.mounts, system.axis_slices, strict=True):
        swings = sorted(swing[axes].tolist(), reverse=True)
        if len(swings) > 1 and swings[1] >= _SWUNG:
            together.append((swings[1], mount.name))
    coupled = [draw.run for draw in draws if draw.system.coupled]
    if not together or not coupled:
        return
    uncoupled = [draw.run for draw in draws if not draw.system.coupled]
    changes = [
        f"{name} by {100.0 * (_largest(coupled, name) / _largest(uncoupled, name) - 1.0):+.2g} %"
        for name in ("acceleration", "sway")
        if _largest(uncoupled, name) > 0.0
    ]
    largest, name = max(together)
    yield Caution(
        CautionKind.COUPLED,
        largest,
        f"In {len(together)} of {len(system.mounts)} mounts several axes slide at once; the ranges hold friction that "
        f"acts together, and alone. ({name}: omega of the second axis swings by +-{largest:.2g} of saturation; records "
        "do not tell which; in a third of the draws it acts together, which changes "
        f"{' and '.join(changes)} on average)",
    )


def _largest(runs: Sequence[CaseRun], name: str) -> float:
    """Of all points, the mean of the runs."""
    return float(np.mean([getattr(run.figures, name).max(initial=0.0) for run in runs]))


def _swings_apart(system: MountedSystem, uses: Sequence[RangeUse]) -> Iterator[Caution]:
    """Springs from a catalogue that swing by far more or less than the amplitude at which it states them."""
    apart: list[tuple[float, str, MountAxis, float, float]] = []
    for number, (axis, name) in enumerate(zip(system.axes, system.axis_names, strict=True)):
        if axis.stated_amplitude is None:
            continue
        for use in uses:
            low, high = float(use.lowest[number]), float(use.highest[number])
            ratio = 0.5 * (high - low) / axis.stated_amplitude
            if ratio > _AT_REST and not 1.0 / _FAR <= ratio <= _FAR:
                apart.append((abs(math.log(ratio)), name, axis, low, high))
    if not apart:
        return
    measure, worst, axis, low, high = max(apart, key=lambda entry: entry[0])
    figures = steady_loop(PathSolver(axis.spring), low, high).figures
    yield Caution(
        CautionKind.CATALOGUE,
        measure,
        f"{len({name for _, name, *_ in apart})} axes of mounts with catalogue values swing by less than half or more "
        f"than twice the amplitude of these. ({worst} by +-{5e2 * (high - low):.3g} mm instead of "
        f"+-{1e3 * (axis.stated_amplitude or 0.0):.3g} mm, where a stiffness of {1e-3 * figures.secant_stiffness:.4g} "
        f"N/mm and a loss factor of {figures.loss_factor:.2g} are assumed)",
    )
