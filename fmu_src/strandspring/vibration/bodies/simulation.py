"""A load case on a system in time: the run is repeated with half the step, and the difference bounds its error.

The method is of second order (motion.h), so that a third of the change from step h to h/2 is the error of the finer
run where the term in h^2 rules. The printed error is the whole change: a bound, which also holds for a figure whose
term in h^2 happens to cancel in part, and for a peak at a corner of its course, whose error depends on where the steps
fall. The step is halved until a third of the changes of acceleration, sway, tilt and stroke is within the tolerance, or
a run takes a million steps.

Of random vibration no two realisations are alike within per cents: errors of half a per cent are let pass.

Where corners of a record lie within steps, because its samples are uneven or `step` does not divide their interval, the
forces of dampers and what follows from them err in the first order, by chance more or less at each step: the printed
error may be much too small (seen: 0.003 % of the largest acceleration for 0.6 %).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...errors import MountedSystemError
from ...kernel.motion import Histories, MotionFigures
from ..signals.shock_spectra import SHARE_ERROR
from .loads import ChannelKind, LoadCase, channel_rows
from .mounted import MountedSystem
from .parts import MotionKind
from .rest import RestPose, rest
from .run_figures import Energies, RunFigures
from .small_motion import SmallMotion

TOLERANCE = 1e-3  # of a figure, relative to the largest of its kind
_RANDOM_TOLERANCE = 5e-3  # of one realisation of random vibration, of which no two are alike within per cents
MOST_STEPS = 100_000_000
# A step that is found is halved until a run takes so many steps, or so many times those of the first: errors of what
# hits a stop fall by no rule, and are then as large as is said.
_MOST_FOUND, _MOST_TIMES = 1_000_000, 16
_OF_STABLE, _RANDOM_OF_STABLE, _OF_SHORTEST, _LEAST_STEPS = 0.25, 0.5, 0.1, 50.0  # the first step tried
_SMALL_TILT = 1e-3  # [rad], below which tilt asks for no shorter steps
_MOST_ROWS = 2_000_000  # of histories, of which spectra are taken
_LARGEST_RESIDUAL = 0.01  # of the energy balance, relative to what was exchanged


@dataclass(frozen=True, eq=False)
class CaseRun:
    """A load case from one static equilibrium with one step.

    Attributes
    ----------
    start : RestPose
    step : float               [s].
    figures : RunFigures
    energies : Energies
    """

    start: RestPose
    step: float
    figures: RunFigures
    energies: Energies


@dataclass(frozen=True, eq=False)
class CheckedRun(CaseRun):
    """A run that was repeated with half the step.

    Attributes
    ----------
    errors : RunFigures        Bounds of the numerical errors of the figures.
    stable : float             The largest stable step [s].
    """

    errors: RunFigures
    stable: float


def simulate_case(
    system: MountedSystem,
    case: LoadCase,
    share: float = 0.0,
    step: float | None = None,
) -> CheckedRun:
    """Simulate a load case from rest.

    Parameters
    ----------
    system : MountedSystem
    case : LoadCase
    share : float            Of saturation at rest, see `rest`.
    step : float or None     Of the coarser of two runs [s]; if None, found so that the errors are within the tolerance.

    Raises
    ------
    MountedSystemError       If the bodies cannot rest or follow the base, the step is too long, or the motion diverges.
    """
    _check_case(system, case)
    start = rest(system, share, case.weightless)
    stable = SmallMotion(system, start.pose).stable_step()
    h, tolerance = _first_step(case, stable, step), _RANDOM_TOLERANCE if case.is_random else TOLERANCE
    coarse, most = _run_with_step(system, case, start, h), max(_MOST_FOUND, _MOST_TIMES * case.steps(h))
    while True:
        h *= 0.5
        fine = _run_with_step(system, case, start, h)
        changes = fine.figures.combined(coarse.figures, lambda new, old: np.abs(new - old))
        is_shortest = step is not None or 2 * case.steps(h) > min(most, MOST_STEPS)
        if is_shortest or within(fine.figures, changes, 3.0 * tolerance):
            break
        coarse = fine
    check_balance(case, fine.energies, h)
    return CheckedRun(start, h, fine.figures, fine.energies, _bounds(fine.figures, changes), stable)


def run_case(
    system: MountedSystem, case: LoadCase, start: RestPose, step: float, ends_at_turns: bool = True
) -> CaseRun:
    """One run of a load case with a given step, which ends early where springs turn unless it is not to.

    Raises
    ------
    MountedSystemError       If the motion diverges, or its energy balance is off.
    """
    run = _run_with_step(system, case, start, step, ends_at_turns)
    check_balance(case, run.energies, step)
    return run


def _run_with_step(
    system: MountedSystem, case: LoadCase, start: RestPose, step: float, ends_at_turns: bool = True
) -> CaseRun:
    stride = 1 if case.allowed else None
    if stride and case.steps(step) > _MOST_ROWS:
        raise MountedSystemError(
            f"{case.name}: its shock response spectra would take {case.steps(step):,} steps of {step:.3g} s, more than "
            f"{_MOST_ROWS:,}; shorten the case, or leave out the limit `srs`."
        )
    figures, histories = _motion(system, case, start, step, stride, ends_at_turns)
    numbers = {point.name: number for number, point in enumerate(system.points)}
    before, after = histories.acceleration, histories.after_jump
    spectra = [allowed.share(before[:, numbers[at]], after[:, numbers[at]], step) for at, allowed in case.allowed]
    of_run = RunFigures.from_motion_figures(figures, spectra)
    return CaseRun(start, step, of_run, Energies.from_motion_figures(figures))


def _check_case(system: MountedSystem, case: LoadCase) -> None:
    """Refuse a base that turns where a body cannot: its axis or plane is fixed to the base."""
    for channel in case.channels:
        if channel.kind is not ChannelKind.BASE_ANGULAR_VELOCITY:
            continue
        for body in system.bodies:
            along = abs(float(np.dot(body.direction, channel.direction)))
            if body.motion is MotionKind.AXIS or (body.motion is MotionKind.PLANE and along < 1.0 - 1e-9):
                raise MountedSystemError(
                    f"{case.name}: the base turns, and {body.name} moves in its {body.motion.value} only; give "
                    "it all six degrees of freedom, or leave the turning out."
                )


def _first_step(case: LoadCase, stable: float, step: float | None) -> float:
    """The step to begin with [s]: the given one, or one that divides a tenth of the shortest pulse.

    Of a record that tenth is the interval between samples, whose corners then lie on steps. Steps of random vibration
    follow the motion of the bodies: averages over steps keep what moves them.

    Raises
    ------
    MountedSystemError   If the given one is not stable, longer than the shortest pulse, or would take too many steps.
    """
    shortest = min((channel.signal.shortest for channel in case.channels), default=math.inf)
    if step is None and case.is_random:
        step = min(_RANDOM_OF_STABLE * stable, case.duration / _LEAST_STEPS)
    elif step is None:
        step = min(_OF_STABLE * stable, _OF_SHORTEST * shortest, case.duration / _LEAST_STEPS)
        whole = _OF_SHORTEST * shortest if math.isfinite(shortest) else case.duration
        step = whole / math.ceil(whole / step)
    elif step > stable:
        raise MountedSystemError(
            f"`step` is {step:g} s, and the integration is stable up to {stable:.4g} s with these springs; "
            "take at most that."
        )
    elif step > shortest and not case.is_random:
        raise MountedSystemError(
            f"`step` is {step:g} s, longer than the shortest pulse of {case.name}, {shortest:.4g} s; take at most a "
            "tenth of it."
        )
    count = 2 * case.steps(step)
    if count > MOST_STEPS:
        raise MountedSystemError(
            f"{case.name} would take {count:.3g} steps of {0.5 * step:.3g} s, more than {MOST_STEPS:g}; shorten it, or "
            "give a longer `step`."
        )
    return step


def _bounds(figures: RunFigures, changes: RunFigures) -> RunFigures:
    """Errors of which none is below half the largest relative change of acceleration, sway and tilt, times its figure.

    A figure may change little by chance, tilt above all.
    """
    largest = 0.0
    for name, least in (("acceleration", 0.0), ("sway", 0.0), ("tilt", _SMALL_TILT)):
        value = getattr(figures, name).max(initial=least)
        if value > 0.0:
            largest = max(largest, float(getattr(changes, name).max(initial=0.0) / value))
    floored = {
        name: np.maximum(getattr(changes, name), 0.5 * largest * getattr(figures, name))
        for name in ("acceleration", "sway", "sway_components", "tilt", "force")
    }
    spectra = changes.spectra + SHARE_ERROR * figures.spectra
    return replace(changes, **floored, spectra=spectra)


def check_balance(case: LoadCase, energies: Energies, step: float) -> None:
    """Refuse a run whose energy balance is off.

    Raises
    ------
    MountedSystemError   With what to do.
    """
    if energies.relative_residual > _LARGEST_RESIDUAL:
        raise MountedSystemError(
            f"{case.name}: the energy balance is off by {100.0 * energies.relative_residual:.2g} % with steps of "
            f"{step:.3g} s; give a shorter `step`."
        )


def run_with_histories(system: MountedSystem, case: LoadCase, start: RestPose, step: float, rows: int) -> Histories:
    """Histories of a run with a given step, of at most so many rows and one.

    Raises
    ------
    MountedSystemError   If the motion diverges.
    """
    return _motion(system, case, start, step, math.ceil(case.steps(step) / rows))[1]


def _motion(
    system: MountedSystem,
    case: LoadCase,
    start: RestPose,
    step: float,
    stride: int | None = None,
    ends_at_turns: bool = True,
) -> tuple[MotionFigures, Histories]:
    """Figures of a run, and its histories at every `stride`-th step; see `MotionSolver.run`."""
    count = case.steps(step)
    figures, histories = system.solver.run(
        channel_rows(case.channels, system.bodies), case.averages(step, count), step, np.array(system.gravity),
        start.coordinates, start.omega, np.array(case.velocity), min(int(case.settling / step), count - 1), stride,
        ends_at_turns,
    )  # fmt: skip
    if figures.steps < count:
        raise MountedSystemError(
            f"{case.name}: the motion diverges {figures.steps * step:.4g} s after its beginning, with steps of "
            f"{step:.3g} s; a spring whose force falls beyond its identified range may not stop the bodies: give stops "
            "or a shorter `step`."
        )
    return figures, histories


def within(figures: RunFigures, errors: RunFigures, tolerance: float) -> bool:
    """Whether errors of acceleration, sway, tilt and stroke are within a share of the largest of their kind."""
    stroke = figures.displacement_high - figures.displacement_low
    strokes = np.maximum(errors.displacement_low, errors.displacement_high)
    pairs = (
        (figures.acceleration, errors.acceleration, 0.0),
        (figures.sway, errors.sway, 0.0),
        (figures.tilt, errors.tilt, _SMALL_TILT),
        (stroke, strokes, 0.0),
    )
    return all(error.max(initial=0.0) <= tolerance * value.max(initial=least) for value, error, least in pairs)
