"""Steady vibration by plain time integration, the reference for harmonic balance.

    m*z'' + c*z' + P*r(z/S) = L + (excitation),   omega' = rho*z'/S*(1 - u^n) or rho*z'/S*(1 + (2 sigma - 1)*(-u)^n),

with omega integrated (paper eq. 22), so that nothing of the closed form enters, and the solver started anew at each
reversal, where the right-hand side has a kink.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from strandspring.core.polynomials import polynomial
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, static_equilibrium

_PHASES = 256
_AGREE = 3  # periods in a row that must repeat


@dataclass(frozen=True)
class Shaken:
    """A steady period: first harmonic of the relative motion as a cos + b sin (a - i b) and half the stroke [m], and
    the largest acceleration of the mass, not relative to the base [m/s^2].
    """

    relative: complex
    amplitude: float
    acceleration: float
    periods: int


def shaken(
    system: IsolatedMass,
    excitation: Excitation,
    level: float,
    frequency: float,
    rtol: float = 1e-7,
    repeat: float = 1e-5,
    most: int = 2000,
) -> Shaken:
    """Integrate from rest until periods repeat within `repeat` of the motion."""
    p, m = system.spring, system.mass
    circular = 2.0 * math.pi * frequency
    strength = {
        Excitation.BASE_DISPLACEMENT: m * circular**2 * level,
        Excitation.BASE_ACCELERATION: -m * level,
        Excitation.FORCE: level,
    }[excitation]
    bend = 2.0 * p.sigma - 1.0

    def rate(t: float, state: np.ndarray, direction: float) -> list[float]:
        z, v, omega = state.tolist()
        x = z / system.series - p.displacement_offset
        force = polynomial(p.kE, x) + p.kappa_omega * omega * polynomial(p.kA, x)
        u = direction * omega
        slope = 1.0 - u**p.n if u >= 0.0 else 1.0 + bend * (-u) ** p.n
        push = system.static_load + strength * math.cos(circular * t) - system.damping * v - system.parallel * force
        return [v, push / m, p.rho * slope * v / system.series]

    def acceleration(t: float, state: np.ndarray, direction: float) -> float:
        of_base = 0.0 if excitation is Excitation.FORCE else strength * math.cos(circular * t) / m
        return abs(rate(t, state, direction)[1] - of_base)

    def turn(_: float, state: np.ndarray, direction: float) -> float:
        return float(direction * state[1])

    turn.terminal, turn.direction = True, -1  # type: ignore[attr-defined]
    state = np.array([system.series * static_equilibrium(system).displacement, 0.0, 0.0])
    direction = 1.0 if strength > 0.0 else -1.0
    period = 1.0 / frequency
    weights = np.exp(-1j * 2.0 * np.pi * np.arange(_PHASES) / _PHASES) * 2.0 / _PHASES
    last, agreed = 0.0 + 0.0j, 0
    for k in range(most):
        phases = period * np.arange(_PHASES) / _PHASES
        now, motion = 0.0, np.empty(0)
        low = high = state[0]
        largest = 0.0
        while now < period:
            piece = solve_ivp(
                rate, (now, period), state, events=turn, dense_output=True, args=(direction,), rtol=rtol, atol=1e-12,
                max_step=period / 8,
            )  # fmt: skip
            assert piece.success, piece.message
            inside = phases[(phases >= now) & (phases < piece.t[-1])]
            now, state = float(piece.t[-1]), piece.y[:, -1]
            largest = max(largest, acceleration(now, state, direction))
            if inside.size:
                states = piece.sol(inside)
                motion = np.append(motion, states[0])
                largest = max(largest, *(acceleration(t, s, direction) for t, s in zip(inside, states.T, strict=True)))
            state[2] = min(max(state[2], -1.0), 1.0)
            if piece.t_events[0].size:
                direction = -direction
            low, high = min(low, state[0]), max(high, state[0])
        relative = complex(motion @ weights)
        agreed = agreed + 1 if abs(relative - last) <= repeat * abs(relative) else 0
        last = relative
        if agreed == _AGREE:
            return Shaken(relative, 0.5 * (high - low), largest, k + 1)
    raise AssertionError(f"no steady motion at {frequency} Hz within {most} periods")
