"""The steady motions over a band of frequencies, followed through folds by pseudo-arclength continuation.

Where a resonance leans over, one frequency has several steady motions. The curve of (z, ln Omega) itself is smooth:
it is followed by its tangent, corrected by Newton's method across it, and each wanted frequency that it passes is
solved for itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .harmonic_balance import Balance, HarmonicBalance
from .periodic import FloatArray
from .system import IsolationError, StaticPoint

_WEIGHT = 4.0  # of ln(Omega) against the relative change of the motion in the length of a step
_LONGEST = 0.4
_SHORTEST = 1e-5
_FIRST = 0.1
_EASY = 3  # corrections after which the step may grow
_CORRECTIONS = 8
_TOLERANCE = 1e-9  # of the largest term of the balance
_BEND = 0.7  # least cosine between the tangents of neighbours; a jump to another branch shows as a sharper bend
_NEAR, _ALIKE = 5.0, 0.02
_MOST_STEPS = 20_000
_RAMP = 10  # levels through which a start is approached


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """One steady motion.

    Attributes
    ----------
    omega : float                     [rad/s]
    z : ndarray, shape (2H + 1,)      Fourier coefficients of the mount's displacement [m].
    balance : Balance
    rising : bool                     Whether the curve runs towards higher frequencies here; between two folds it runs
                                      back, and such a motion is unstable.
    wanted : bool                     Whether the frequency is one of those asked for.
    """

    omega: float
    z: FloatArray
    balance: Balance
    rising: bool
    wanted: bool = False


@dataclass(frozen=True, eq=False)
class _Place:
    z: FloatArray
    log: float
    balance: Balance
    tangent: FloatArray

    @property
    def omega(self) -> float:
        return float(np.exp(self.log))

    @property
    def metric(self) -> FloatArray:
        """Weights that make the length of a step relative to the motion."""
        size = float(np.linalg.norm(self.z[1:]))
        return np.append(np.full(self.z.size, 1.0 / size), _WEIGHT)


def follow(balance: HarmonicBalance, rest: StaticPoint, frequencies: FloatArray) -> Iterator[SteadyMotion]:
    """Steady motions from the lowest to the highest frequency, in the order of the curve.

    Parameters
    ----------
    balance : HarmonicBalance
    rest : StaticPoint                  About which the motion at the lowest frequency is looked for.
    frequencies : ndarray, shape (F,)   Rising [rad/s], > 0.

    Raises
    ------
    IsolationError                      If no steady motion is found, or the curve cannot be followed.
    """
    z, found = _start(balance, rest, float(frequencies[0]))
    logs = np.log(frequencies)
    place = _placed(z, float(logs[0]), found, None)
    yield SteadyMotion(float(frequencies[0]), z, found, True, True)
    step = _FIRST
    for _ in range(_MOST_STEPS):
        if place.log >= logs[-1]:
            return
        after, corrections = _next(balance, place, step)
        if after is None:
            step *= 0.5
            if step < _SHORTEST:
                raise IsolationError(
                    f"The steady motion at a level of {balance.level:.6g} {balance.excitation.unit} could not be "
                    f"followed beyond {place.omega / (2.0 * np.pi):.6g} Hz; use a lower level or a narrower band."
                )
            continue
        yield from _passed(balance, place, after, logs)
        if after.log < logs[-1]:
            yield SteadyMotion(after.omega, after.z, after.balance, bool(after.tangent[-1] > 0.0))
        if after.log < logs[0]:
            raise IsolationError(
                f"The steady motion at a level of {balance.level:.6g} {balance.excitation.unit} turns back below the "
                "lowest frequency; begin the band lower."
            )
        place = after
        if corrections <= _EASY:
            step = min(1.5 * step, _LONGEST)
    raise IsolationError(f"The steady motion could not be followed within {_MOST_STEPS} steps; use a narrower band.")


def _start(balance: HarmonicBalance, rest: StaticPoint, omega: float) -> tuple[FloatArray, Balance]:
    """A steady motion at one frequency, if need be approached from lower levels."""
    system = balance.system
    for levels in (np.ones(1), np.geomspace(0.02, 1.0, _RAMP)):
        z = np.zeros(2 * balance.basis.harmonics + 1)
        z[0] = system.series * rest.displacement
        dynamic = rest.stiffness - system.mass * omega**2 + 1j * omega * system.damping
        # No more than resonance with a loss factor of a tenth gives.
        size = max(abs(dynamic), 0.1 * rest.stiffness)
        z[1] = levels[0] * balance.forcing(omega)[0] / size * (1.0 if dynamic.real >= 0.0 else -1.0)
        solved = None
        for level in levels:
            part = HarmonicBalance(
                system, balance.excitation, level * balance.level, balance.basis.harmonics, balance.basis.phase.size
            )
            solved = part.solve(z, omega)
            if solved is None:
                break
            z = solved[0]
        if solved is not None:
            return solved
    raise IsolationError(
        f"No steady motion was found at {omega / (2.0 * np.pi):.6g} Hz and a level of {balance.level:.6g} "
        f"{balance.excitation.unit}; use a lower level or begin at another frequency."
    )


def _placed(z: FloatArray, log: float, there: Balance, before: _Place | None) -> _Place:
    """A point of the curve with its unit tangent, turned the way the curve is followed."""
    place = _Place(z, log, there, np.zeros(z.size + 1))
    metric = place.metric
    along = np.append(np.zeros(z.size), 1.0) if before is None else before.tangent
    matrix = np.vstack([_columns(there, place.omega), along * metric**2])
    tangent = np.linalg.solve(matrix, np.append(np.zeros(z.size), 1.0))
    return _Place(z, log, there, tangent / np.linalg.norm(tangent * metric))


def _columns(balance: Balance, omega: float) -> FloatArray:
    """Jacobian by (z, ln Omega)."""
    return np.column_stack([balance.jacobian, omega * balance.by_frequency])


def _next(balance: HarmonicBalance, place: _Place, step: float) -> tuple[_Place | None, int]:
    """The point of the curve one step on, and how many corrections it took; None if there is none so near."""
    metric = place.metric
    normal = place.tangent * metric**2
    at = np.append(place.z, place.log) + step * place.tangent
    predicted = at
    for correction in range(_CORRECTIONS):
        omega = float(np.exp(at[-1]))
        if not np.any(at[1:-1]):
            break
        there = balance.at(at[:-1], omega)
        if float(np.abs(there.residual).max()) <= _TOLERANCE * there.scale and correction:
            after = _placed(at[:-1], float(at[-1]), there, place)
            aligned = float(np.sum(after.tangent * place.tangent * metric**2))
            aligned /= float(np.linalg.norm(after.tangent * metric))
            return (after if aligned > _BEND else None), correction
        matrix = np.vstack([_columns(there, omega), normal])
        try:
            at = at - np.linalg.solve(matrix, np.append(there.residual, normal @ (at - predicted)))
        except np.linalg.LinAlgError:
            break
        if not np.all(np.isfinite(at)) or np.linalg.norm((at - predicted) * metric) > 2.0 * step:
            break
    return None, _CORRECTIONS


def _passed(balance: HarmonicBalance, before: _Place, after: _Place, logs: FloatArray) -> Iterator[SteadyMotion]:
    """Steady motions at the wanted frequencies between two neighbours on the curve, in its order."""
    low, high = sorted((before.log, after.log))
    if after.log > before.log:
        between = logs[(logs > low) & (logs <= high)]
    else:
        between = logs[(logs >= low) & (logs < high)][::-1]
    for log in between:
        share = (log - before.log) / (after.log - before.log)
        guess = before.z + share * (after.z - before.z)
        solved = balance.solve(guess, float(np.exp(log)))
        # Another branch is further away than the neighbours are from each other and the curve bends between them.
        near = _NEAR * np.linalg.norm(after.z - before.z) + _ALIKE * np.linalg.norm(guess[1:])
        if solved is not None and np.linalg.norm(solved[0] - guess) <= near:
            yield SteadyMotion(float(np.exp(log)), *solved, after.log > before.log, True)
