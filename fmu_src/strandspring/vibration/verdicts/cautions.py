"""What a description leaves out: in itself, its model files and catalogues, and in the figures of a load case."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...core.spline import Elastic
from ...findings import Finding, Outcome
from ...kernel.path import PathSolver
from ...loops.loop import steady_loop
from ...model.modelfile import ModelFile
from ...model.stated_cautions import cautions_in_use
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.parts import MountAxis
from ..bodies.simulation import CaseRun
from .draws import DrawnRun
from .figures import RangeUse
from .implausible_loads import implausible_loads
from .implausible_values import implausible_values
from .static_answer import StaticAnswer

_LARGE_TILT = math.radians(10.0)  # from which the twist of mounts is felt, where no limit says more
_ROUNDING = 1e-9  # of a duration
_SWUNG = 0.5  # half the swing of omega from which an axis' friction is saturated in good part
_FAR = 2.0  # factor between amplitudes from which a swing is another than a catalogue states
_AT_REST = 1e-6  # of the stated amplitude: below, a spring does not move


def system_cautions(system: MountedSystem, models: Mapping[str, ModelFile]) -> tuple[Finding, ...]:
    """What the description of a system leaves out."""
    used = dict.fromkeys(axis.model for axis in system.axes)
    return (
        *implausible_values(system),
        *_across(system),
        *_shared(system),
        *(finding for name in used if name in models for finding in cautions_in_use(name, models[name])),
        *catalogue_cautions(system),
    )


def _across(system: MountedSystem) -> Iterator[Finding]:
    """Mounts that have no force in some directions, or no moment."""
    few = tuple(mount.name for mount in system.mounts if len(mount.axes) < 3)
    if few and any(
        not np.allclose(body.translations, 0.0) and np.trace(body.translations) > 1.5 for body in system.bodies
    ):
        yield Finding(Outcome.FEW_AXES, {"few": len(few), "of": len(system.mounts), "mounts": few})
    if any(body.rotations.any() for body in system.bodies):
        yield Finding(Outcome.NO_MOMENTS)


def _shared(system: MountedSystem) -> Iterator[Finding]:
    """Model files that serve perpendicular axes of one mount."""
    used: dict[str, set[str]] = {}
    for mount in system.mounts:
        for name in {axis.model for axis in mount.axes}:
            if sum(axis.model == name for axis in mount.axes) > 1:
                used.setdefault(name, set()).add(mount.name)
    for name, mounts in sorted(used.items()):
        yield Finding(Outcome.SHARED_MODEL, {"model": name or "One spring", "mounts": tuple(sorted(mounts))})


def catalogue_cautions(system: MountedSystem) -> Iterator[Finding]:
    """What is not known of each spring from a catalogue."""
    for axis in {axis.model: axis for axis in system.axes if axis.stated_amplitude is not None}.values():
        (source, direction), spring = axis.stated, axis.spring
        small = Elastic(spring).slope(axis.nominal - spring.displacement_offset) + spring.kappa_omega * spring.rho
        numbers = {"amplitude": axis.stated_amplitude, "stiffness": float(small), "friction": spring.kappa_omega}
        yield Finding(Outcome.CATALOGUE, {"source": source, "direction": direction, **numbers})


def overloads(system: MountedSystem, static: StaticAnswer) -> Iterator[Finding]:
    """Mounts that rest under more than the rated load of their springs, whatever the omega."""
    rated = np.array([axis.parallel * axis.rated_load for axis in system.axes])
    shares = np.max([np.abs(pose.force) for pose in static.poses], axis=0) / rated
    beyond = shares > 1.0
    if beyond.any():
        worst = int(np.argmax(shares))
        numbers = {"force": float(shares[worst] * rated[worst]), "rated": float(rated[worst])}
        numbers |= {"axes": int(beyond.sum()), "of": int(np.isfinite(rated).sum())}
        yield Finding(Outcome.OVERLOADED, {"axis": system.axis_names[worst], **numbers})


def case_cautions(
    system: MountedSystem,
    case: LoadCase,
    nominal: CaseRun,
    draws: Sequence[DrawnRun],
    uses: Sequence[RangeUse],
    tilt_limit: float | None,
) -> tuple[Finding, ...]:
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
        *implausible_loads(system, case),
        *_outside(system, uses),
        *_stopped(system, uses),
        *_tilted(system, runs, tilt_limit),
        *_fast(system, runs),
        *_diluted(case),
        *_fallen(case),
        *_coupled(system, nominal, draws),
        *_swings_apart(system, uses),
    )


def _outside(system: MountedSystem, uses: Sequence[RangeUse]) -> Iterator[Finding]:
    outside = np.any([use.is_outside for use in uses], axis=0)
    if not outside.any():
        return
    beyond = np.max([use.beyond for use in uses], axis=0)
    worst = int(np.argmax(beyond))
    use = uses[0]
    numbers = {"beyond": float(beyond[worst]), "range": ((float(use.low[worst]), float(use.high[worst])),)}
    axes = {"axes": int(outside.sum()), "of": outside.size, "axis": system.axis_names[worst]}
    yield Finding(Outcome.RANGE_LEFT, {**axes, **numbers})


def _stopped(system: MountedSystem, uses: Sequence[RangeUse]) -> Iterator[Finding]:
    deflection = np.max([use.stop_deflection for use in uses], axis=0)
    if not deflection.any():
        return
    force = np.max([use.stop_force for use in uses], axis=0)
    worst = int(np.argmax(force))
    numbers = {"deflection": float(deflection[worst]), "force": float(force[worst])}
    numbers |= {"axes": int(np.count_nonzero(deflection)), "of": deflection.size}
    yield Finding(Outcome.STOPS, {"axis": system.axis_names[worst], **numbers})


def _tilted(system: MountedSystem, runs: Sequence[CaseRun], limit: float | None) -> Iterator[Finding]:
    tilt = np.max([run.figures.tilt for run in runs], axis=0)
    body = int(np.argmax(tilt))
    least = _LARGE_TILT if limit is None else limit
    if tilt[body] > least:
        yield Finding(Outcome.TILT, {"body": system.bodies[body].name, "tilt": float(tilt[body]), "limit": least})


def _fast(system: MountedSystem, runs: Sequence[CaseRun]) -> Iterator[Finding]:
    """The speed of the springs, which model files do not tell."""
    series = np.array([axis.series for axis in system.axes])
    rates = np.max([run.figures.rate for run in runs], axis=0) / series
    if rates.any():
        worst = int(np.argmax(rates))
        yield Finding(Outcome.SPRING_SPEED, {"axis": system.axis_names[worst], "speed": float(rates[worst])})


def _diluted(case: LoadCase) -> Iterator[Finding]:
    after = case.duration - case.load_end
    if case.settling > 0.0 and after > _ROUNDING * case.duration:
        yield Finding(Outcome.DILUTED, {"end": case.duration, "load_end": case.load_end, "after": after})


def _fallen(case: LoadCase) -> Iterator[Finding]:
    if case.weightless:
        yield Finding(Outcome.FALL, {"speed": math.hypot(*case.velocity)})


def _coupled(system: MountedSystem, nominal: CaseRun, draws: Sequence[DrawnRun]) -> Iterator[Finding]:
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
    numbers = {"mounts": len(together), "of": len(system.mounts)}
    changes = {name: _change(coupled, uncoupled, name) for name in ("acceleration", "sway")}
    largest, name = max(together)
    yield Finding(Outcome.SLIDING_TOGETHER, {"mount": name, "swing": largest, **numbers, **changes})


def _change(coupled: Sequence[CaseRun], uncoupled: Sequence[CaseRun], name: str) -> float:
    """Of the largest figure of all points, the mean of the runs."""
    largest, before = (
        float(np.mean([getattr(run.figures, name).max(initial=0.0) for run in runs])) for runs in (coupled, uncoupled)
    )
    return largest / before - 1.0 if before > 0.0 else 0.0


def _swings_apart(system: MountedSystem, uses: Sequence[RangeUse]) -> Iterator[Finding]:
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
    numbers = {"swing": 0.5 * (high - low), "stated": axis.stated_amplitude or 0.0, "factor": math.exp(measure)}
    numbers |= {"stiffness": figures.secant_stiffness, "loss_factor": figures.loss_factor}
    axes = len({name for _, name, *_ in apart})
    yield Finding(Outcome.SWING_APART, {"axes": axes, "axis": worst, **numbers})
