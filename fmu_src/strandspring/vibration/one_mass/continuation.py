"""The steady motions over a band of frequencies, followed through folds.

From one wanted frequency to the next the motion is predicted along its tangent and solved at the new frequency. Where a
resonance leans over, one frequency has several steady motions and that fails; the curve of (z, ln Omega) itself is
smooth, and is followed there by pseudo-arclength: predicted along its tangent, corrected by Newton's method across it.
Spikes narrower than the band's spacing, such as superharmonic resonances without damping, are passed over, and so are
closed curves beside the one followed, on which a step may land.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...core.parameters import LARGEST_DISPLACEMENT
from ...errors import IsolationError
from ...kernel.arrays import FloatArray
from ...kernel.balance import Balance, BalancedMotion, BalancedSystem

# Across a spike that cannot be followed
_PARTS = 32  # of the way to the next wanted frequency, where the other side is looked for
_SPIKE = 10  # wanted frequencies over which it may reach
_CHANGE = 0.6  # most of the first harmonic by which it may differ on the other side
# Along the curve
_WEIGHT = 4.0  # of ln(Omega) against the relative change of the motion in the length of a step
_LONGEST = 0.4
_SHORTEST = 1e-5
_FIRST = 0.05
_EASY = 3  # corrections after which the step may grow
_CORRECTIONS = 8
_TOLERANCE = 1e-9  # of the largest term of the balance
_BEND = 0.7  # least cosine between the tangents of neighbours; a jump to another branch shows as a sharper bend
# Another branch is further away than the neighbours are from each other and the curve bends between them.
_NEAR, _ALIKE = 5.0, 0.02
_MOST_STEPS = 5_000
_RECENT = 10  # steps whose neighbourhood is no sign of a closed curve

_RAMP = 10  # levels through which a start is approached
_REFINEMENTS = 6  # halvings of the frequencies' spacing about a peak
_FLAT = 2e-6  # of the largest value, by which its neighbours may differ before that is refined
_CURVED = 0.004  # of ln(measure) between a point and the chord of its neighbours, above which points are added
_SWEPT = 50  # frequencies between two reports of progress


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """One steady motion.

    Attributes
    ----------
    log : float               ln of Omega in rad/s.
    motion : BalancedMotion
    rising : bool             Whether the curve runs towards higher frequencies here; between two folds it runs back,
                              and such a motion is unstable.
    wanted : bool             Whether the frequency is one of those asked for.
    """

    log: float
    motion: BalancedMotion
    rising: bool = True
    wanted: bool = False

    @property
    def omega(self) -> float:
        """Omega [rad/s]."""
        return float(np.exp(self.log))

    @property
    def z(self) -> FloatArray:
        """Fourier coefficients, shape (D*N,) [m]."""
        return self.motion.z


def follow(
    balance: BalancedSystem, linear: Callable[[float], FloatArray], frequencies: FloatArray
) -> Iterator[SteadyMotion]:
    """Steady motions from the lowest to the highest frequency, in the order of the curve.

    The curve may end after a motion in which a spring goes beyond the limits of its axis.

    Parameters
    ----------
    balance : BalancedSystem
    linear : callable                   Motion of the linearized system at an Omega; the first is looked for about it.
    frequencies : ndarray, shape (F,)   Rising [rad/s], > 0.

    Raises
    ------
    IsolationError                      If no steady motion is found, or the curve cannot be followed.
    """
    logs = np.log(frequencies)
    here = _start(balance, linear, float(logs[0]))
    crossed = -np.inf  # the wanted frequency before which a spike was crossed last
    yield here
    while (after := logs[logs > here.log]).size:
        reached = balance.sweep(here.log, here.z, after[:_SWEPT])
        for log, motion in zip(after.tolist(), reached, strict=False):
            here = SteadyMotion(log, motion, wanted=True)
            yield here
        passed, after = len(reached), after[len(reached) :]
        if not after.size or balance.is_beyond(here.motion):
            return
        if passed == _SWEPT:
            continue
        try:
            # All or nothing: what leads up a spike that cannot be followed is no part of the curve.
            motions = list(_along(balance, here, logs, float(after[0])))
        except _LostError as lost:
            # Once to between two wanted frequencies: by parts of what remains, it would never get to the second.
            motions = _across(balance, here, after, lost.reached, 0 if after[0] == crossed else _PARTS)
            if not motions:
                raise
            crossed = float(after[0])
        yield from motions
        here = motions[-1]
        if any(balance.is_beyond(motion.motion) for motion in motions):
            return


def refine_peak(
    balance: BalancedSystem, motions: list[SteadyMotion], measure: Callable[[list[SteadyMotion]], FloatArray]
) -> list[SteadyMotion]:
    """The motions with more of them about the largest value of a measure, unless the curve ends or folds there.

    Parameters
    ----------
    balance : BalancedSystem
    motions : list of SteadyMotion   In the order of the curve.
    measure : callable               Gives its values at motions.
    """
    measured = list(zip(motions, measure(motions).tolist(), strict=True))
    for _ in range(_REFINEMENTS):
        top = max(range(len(measured)), key=lambda k: measured[k][1])
        if not 0 < top < len(measured) - 1:
            break
        around, values = zip(*measured[top - 1 : top + 2], strict=True)
        if min(values) >= (1.0 - _FLAT) * values[1]:
            break
        if not (all(motion.rising for motion in around) and around[0].log < around[1].log < around[2].log):
            break
        # The later pair first, so that the earlier one keeps its place.
        for k in (1, 0):
            middle = _between(balance, around[k], around[k + 1], 0.5 * (around[k].log + around[k + 1].log))
            if middle is not None:
                measured.insert(top + k, (middle, float(measure([middle])[0])))
    return [motion for motion, _ in measured]


def refine_superharmonics(
    balance: BalancedSystem,
    motions: list[SteadyMotion],
    measure: Callable[[list[SteadyMotion]], FloatArray],
    below: float,
) -> list[SteadyMotion]:
    """The motions with more of them where a measure bends sharply, as amplitudes do at superharmonic resonances.

    Parameters
    ----------
    balance : BalancedSystem
    motions : list of SteadyMotion   In the order of the curve.
    measure : callable               Gives its values at motions.
    below : float                    Of the frequencies at which motions are added [rad/s].
    """
    refined = list(motions)
    for _ in range(_REFINEMENTS):
        logs = np.array([motion.log for motion in refined])
        rising = np.array([motion.rising for motion in refined]) & (logs < np.log(below))
        with np.errstate(divide="ignore", invalid="ignore"):
            sizes = np.log(measure(refined))
            share = (logs[1:-1] - logs[:-2]) / (logs[2:] - logs[:-2])
            bend = np.abs(sizes[1:-1] - sizes[:-2] - share * (sizes[2:] - sizes[:-2]))
        curved = (bend > _CURVED) & rising[:-2] & rising[1:-1] & rising[2:] & (share > 0.0) & (share < 1.0)
        before = np.flatnonzero(np.append(curved, False) | np.insert(curved, 0, False))
        # From the end, so that what comes before keeps its place.
        for k in before[::-1].tolist():
            here, following = refined[k], refined[k + 1]
            middle = _between(balance, here, following, 0.5 * (here.log + following.log))
            if middle is not None:
                refined.insert(k + 1, middle)
        if len(refined) == logs.size:
            break
    return refined


def _start(balance: BalancedSystem, linear: Callable[[float], FloatArray], log: float) -> SteadyMotion:
    """A steady motion at one frequency, if need be approached from lower levels."""
    omega = float(np.exp(log))
    for levels in (np.ones(1), np.geomspace(0.02, 1.0, _RAMP)):
        z = linear(omega)
        balance.about_mean(z)[...] *= levels[0]
        motion = None
        for level in levels:
            motion = balance.at_share(level).solve(z, omega)
            if motion is None:
                break
            z = motion.z
        if motion is not None:
            return SteadyMotion(log, motion, wanted=True)
    raise IsolationError(
        f"No steady motion was found at {_described(balance, log)}; use a lower level or begin at another frequency."
    )


def _described(balance: BalancedSystem, log: float) -> str:
    """Frequency and level for messages."""
    return f"{np.exp(log) / (2.0 * np.pi):.6g} Hz and a level of {balance.level_text}"


class _LostError(IsolationError):
    """A curve that cannot be followed further; `reached` is the highest ln(Omega) on it."""

    def __init__(self, message: str, reached: float) -> None:
        super().__init__(message)
        self.reached = reached


def _across(
    balance: BalancedSystem, here: SteadyMotion, after: FloatArray, reached: float, parts: int
) -> list[SteadyMotion]:
    """The motion beyond a spike, at the first frequency above it where the first harmonic is alike.

    It is looked for at so many parts of the way to the next wanted frequency, and then at the wanted ones.
    """
    order = np.tile(balance.basis.order, balance.degrees)
    first = order == 1.0
    plain = np.where(order <= 1.0, here.z, 0.0)
    logs = np.concatenate([np.linspace(here.log, after[0], parts, endpoint=False), after[:_SPIKE]])
    for log in logs[logs > max(here.log, reached)].tolist():
        motion = balance.solve(plain, float(np.exp(log)))
        if motion is not None and np.linalg.norm((motion.z - plain)[first]) <= _CHANGE * np.linalg.norm(plain[first]):
            return [SteadyMotion(log, motion, wanted=log in after)]
    return []


def _along(balance: BalancedSystem, here: SteadyMotion, logs: FloatArray, target: float) -> Iterator[SteadyMotion]:
    """Motions along the curve until it has risen past the target, those at wanted frequencies among them."""
    place = _Place.from_motion(here, balance, balance.at(here.z, here.omega))
    track = _Track(place)
    step = _FIRST
    for _ in range(_MOST_STEPS):
        after, corrections = _next(balance, place, step)
        if after is None:
            step *= 0.5
            if step < _SHORTEST:
                break
            continue
        if track.is_closed_by(after, step):
            break
        yield from _passed(balance, place.motion, after.motion, logs)
        yield after.motion
        if after.motion.log < logs[0]:
            raise IsolationError(
                f"The steady motion turns back at {_described(balance, float(logs[0]))}; begin the band lower."
            )
        place = after
        track.append(place)
        if place.motion.log >= target and place.motion.rising:
            return
        if corrections <= _EASY:
            step = min(1.5 * step, _LONGEST)
    raise _LostError(
        f"The steady motion could not be followed beyond {_described(balance, place.motion.log)}; use a lower level or "
        "a narrower band.",
        track.highest,
    )


@dataclass(frozen=True, eq=False)
class _Place:
    """A point of the curve with its tangent, of unit length in the metric, turned the way the curve is followed.

    The metric's weights make the length of a step relative to the motion.
    """

    motion: SteadyMotion
    tangent: FloatArray
    metric: FloatArray

    @classmethod
    def from_motion(
        cls, motion: SteadyMotion, balance: BalancedSystem, there: Balance, before: _Place | None = None
    ) -> _Place:
        size = float(np.linalg.norm(balance.about_mean(motion.z)))
        metric = np.append(np.full(motion.z.size, 1.0 / size), _WEIGHT)
        along = np.append(np.zeros(motion.z.size), 1.0) if before is None else before.tangent
        matrix = np.vstack([_columns(there, motion.omega), along * metric**2])
        tangent = np.linalg.solve(matrix, np.append(np.zeros(motion.z.size), 1.0))
        return cls(replace(motion, rising=bool(tangent[-1] > 0.0)), tangent / np.linalg.norm(tangent * metric), metric)

    @property
    def coordinates(self) -> FloatArray:
        """(z, ln Omega)."""
        return np.append(self.motion.z, self.motion.log)


class _Track:
    """The places passed so far, in arrays, since each new one is compared with all of them.

    Parameters
    ----------
    first : _Place
    """

    def __init__(self, first: _Place) -> None:
        self._coordinates = np.empty((_MOST_STEPS + 1, first.tangent.size))
        self._tangents = np.empty_like(self._coordinates)
        self._count = 0
        self.append(first)

    def append(self, place: _Place) -> None:
        """Add the place that comes next."""
        self._coordinates[self._count], self._tangents[self._count] = place.coordinates, place.tangent
        self._count += 1

    @property
    def highest(self) -> float:
        """The highest ln(Omega)."""
        return float(self._coordinates[: self._count, -1].max())

    def is_closed_by(self, place: _Place, distance: float) -> bool:
        """Whether the curve runs at a place the way it has run before: it is closed."""
        before = max(self._count - _RECENT, 0)
        metric = place.metric
        gaps = (self._coordinates[:before] - place.coordinates) * metric
        near = np.linalg.norm(gaps, axis=1) < 0.5 * distance
        return bool(np.any((self._tangents[:before][near] * place.tangent * metric**2).sum(axis=1) > _BEND))


def _columns(balance: Balance, omega: float) -> FloatArray:
    """Jacobian by (z, ln Omega)."""
    return np.column_stack([balance.jacobian, omega * balance.by_frequency])


def _next(balance: BalancedSystem, place: _Place, step: float) -> tuple[_Place | None, int]:
    """The point of the curve one step on, and how many corrections it took; None if there is none so near."""
    metric = place.metric
    normal = place.tangent * metric**2
    at = np.append(place.motion.z, place.motion.log) + step * place.tangent
    predicted = at
    for correction in range(_CORRECTIONS):
        z, log = at[:-1], float(at[-1])
        omega = float(np.exp(log))
        try:
            there = balance.at(z, omega)
            if correction and float(np.abs(there.residual).max()) <= _TOLERANCE * there.scale:
                after = _Place.from_motion(SteadyMotion(log, there.motion), balance, there, place)
                aligned = float(np.sum(after.tangent * place.tangent * metric**2))
                aligned /= float(np.linalg.norm(after.tangent * metric))
                return (after if aligned > _BEND else None), correction
            matrix = np.vstack([_columns(there, omega), normal])
            at = at - np.linalg.solve(matrix, np.append(there.residual, normal @ (at - predicted)))
        except ValueError:
            # No motion, or a singular matrix.
            break
        if not np.all(np.abs(at) < LARGEST_DISPLACEMENT) or np.linalg.norm((at - predicted) * metric) > 2.0 * step:
            break
    return None, _CORRECTIONS


def _passed(
    balance: BalancedSystem, before: SteadyMotion, after: SteadyMotion, logs: FloatArray
) -> Iterator[SteadyMotion]:
    """Steady motions at the wanted frequencies between two neighbours on the curve, in its order."""
    rising = after.log > before.log
    low, high = sorted((before.log, after.log))
    between = logs[(logs > low) & (logs < high)]
    for log in between if rising else between[::-1]:
        motion = _between(balance, before, after, float(log))
        if motion is not None:
            yield replace(motion, rising=rising, wanted=True)


def _between(balance: BalancedSystem, before: SteadyMotion, after: SteadyMotion, log: float) -> SteadyMotion | None:
    """The motion at a frequency between those of two neighbours on the curve."""
    share = (log - before.log) / (after.log - before.log)
    guess = before.z + share * (after.z - before.z)
    motion = balance.solve(guess, float(np.exp(log)))
    near = _NEAR * np.linalg.norm(after.z - before.z) + _ALIKE * np.linalg.norm(balance.about_mean(guess))
    if motion is None or np.linalg.norm(motion.z - guess) > near:
        return None
    return SteadyMotion(log, motion)
