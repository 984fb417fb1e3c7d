"""Reference for the tests of systems: a plant and its springs as one set of equations for one tight ODE solver.

    M q'' + C q' + K q = load(t) - sum_j count_j*g_j*r_j(d_j, omega_j),   d_j' = g_j.q' - base_j'(t),
    omega_j' = rho*d_j'*(1 - u^n) for u = D_j*omega_j >= 0, rho*d_j'*(1 + (2 sigma - 1)*(-u)^n) otherwise,

the second line being paper eq. (22) with D_j the sign of d_j'. Nothing of the closed form of omega enters. The
right-hand side has a kink where a spring turns, so the solver is stopped there and started anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from strandspring import SpringParameters
from strandspring.core.polynomials import derivative, polynomial
from strandspring.cosimulation import Plant


@dataclass(frozen=True, eq=False)
class Reference:
    """Solution at K times, with the names and shapes of `strandspring.cosimulation.Motion`."""

    q: np.ndarray
    velocity: np.ndarray
    displacement: np.ndarray
    force: np.ndarray
    absorbed_energy: np.ndarray
    reversals: int


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Plant coordinates q, and omega and absorbed energy of each spring."""

    q: np.ndarray
    omega: np.ndarray
    energy: np.ndarray


def force_of(p: SpringParameters, displacement: float, omega: float) -> float:
    """Paper eq. (10) within the identified range [N]."""
    assert p.displacement_min <= displacement <= p.displacement_max, f"{displacement} m is outside the range"
    x = displacement - p.displacement_offset
    return float(polynomial(p.kE, x) + p.kappa_omega * omega * polynomial(p.kA, x))


def growth_of(p: SpringParameters, u: float) -> float:
    """d u/d(rho*s), paper eq. (22); where the solver tries more than saturation, that of saturation."""
    power = min(abs(u), 1.0) ** p.n
    return 1.0 - power if u >= 0.0 else 1.0 + (2.0 * p.sigma - 1.0) * power


def monolithic(
    plant: Plant,
    springs: Sequence[SpringParameters],
    times: np.ndarray,
    *,
    base_velocities: Sequence[Callable[[float], float]] | None = None,
    equilibrium: Equilibrium | None = None,
    velocity: Sequence[float] | None = None,
    breaks: Sequence[float] = (),
    rtol: float = 1e-9,
) -> Reference:
    """Solve for rising `times` from the first of them.

    Parameters
    ----------
    base_velocities   d base_j/dt; zero by default.
    equilibrium       Initial state; q = 0 with omega = 0 by default.
    breaks            Times at which the load has kinks.
    """
    n, count = plant.coordinates, len(springs)
    velocities = [lambda _: 0.0] * count if base_velocities is None else base_velocities
    inverse = np.linalg.inv(plant.M)
    pulls = inverse @ (plant.G * plant.counts)
    damping, stiffness = inverse @ plant.C, inverse @ plant.K

    def slips(t: float, v: np.ndarray) -> np.ndarray:
        return plant.G.T @ v - [s(t) for s in velocities]

    def forces(t: float, z: np.ndarray) -> np.ndarray:
        displacements = plant.displacements(t, z[:n])
        pairs = zip(springs, displacements.tolist(), z[2 * n : 2 * n + count].tolist(), strict=True)
        return np.array([force_of(p, x, w) for p, x, w in pairs])

    def rate(t: float, z: np.ndarray, directions: np.ndarray) -> np.ndarray:
        v = z[n : 2 * n]
        slip, force = slips(t, v), forces(t, z)
        growth = []
        for p, u in zip(springs, (directions * z[2 * n : 2 * n + count]).tolist(), strict=True):
            growth.append(p.rho * growth_of(p, u))
        acceleration = inverse @ plant.load_at(t) - damping @ v - stiffness @ z[:n] - pulls @ force
        return np.concatenate([v, acceleration, np.array(growth) * slip, force * slip])

    def turning(place: int, direction: float) -> Callable[[float, np.ndarray], float]:
        def event(t: float, z: np.ndarray) -> float:
            return float(direction * slips(t, z[n : 2 * n])[place])

        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        return event

    begin = equilibrium or Equilibrium(np.zeros(n), np.zeros(count), np.zeros(count))
    state = np.concatenate([begin.q, np.zeros(n) if velocity is None else velocity, begin.omega, begin.energy])
    now, stop = float(times[0]), float(times[-1])
    # In equilibrium, the direction of each spring is that of its motion shortly after.
    soon = now + 1e-9 * (stop - now)
    first = rate(now, state, np.ones(count))
    directions = np.sign(slips(soon, state[n : 2 * n] + (soon - now) * first[n : 2 * n]))
    directions[directions == 0.0] = 1.0
    ends = [*sorted(t for t in breaks if now < t < stop), stop]
    found, reversals = [state], 0
    while len(found) < times.size:
        end = next(t for t in ends if t > now)
        events = [turning(j, d) for j, d in enumerate(directions.tolist())]
        piece = solve_ivp(
            partial(rate, directions=directions), (now, end), state, "DOP853", dense_output=True, events=events,
            rtol=rtol, atol=1e-13,
        )  # fmt: skip
        assert piece.success, piece.message
        now, state = piece.t[-1], piece.y[:, -1]
        turned = np.array([hits.size > 0 for hits in piece.t_events])
        if turned.any():  # springs that move as one turn at once, and the solver stops at the first of them
            turned |= np.abs(slips(now, state[n : 2 * n])) < 1e-12
        directions = np.where(turned, -directions, directions)
        reversals += int(turned.sum())
        found += [piece.sol(t) for t in times[len(found) :] if t <= now]
    z = np.array(found)
    displacement = np.array([plant.displacements(t, row[:n]) for t, row in zip(times, z, strict=True)])
    force = np.array([forces(t, row) for t, row in zip(times, z, strict=True)])
    return Reference(z[:, :n], z[:, n : 2 * n], displacement, force, z[:, 2 * n + count :], reversals)


def loaded(plant: Plant, springs: Sequence[SpringParameters], directions: Sequence[int]) -> Equilibrium:
    """Static equilibrium of the plant if its load grows slowly from the force of the springs at q = 0.

    The equilibrium as a differential equation over the share of the load, for springs of which each moves in one of the
    `directions` (+1 or -1) only; refused where one does not.
    """
    n, count = plant.coordinates, len(springs)
    signs = np.array(directions, dtype=float)

    def pulls(z: np.ndarray) -> np.ndarray:
        displacements = plant.displacements(0.0, z[:n])
        return np.array([force_of(p, x, w) for p, x, w in zip(springs, displacements, z[n : n + count], strict=True)])

    start = np.zeros(n + 2 * count)
    missing = plant.load_at(0.0) + plant.generalized_force(pulls(start))

    def rate(_: float, z: np.ndarray) -> np.ndarray:
        tangents, growth = [], []
        for p, x, w, sign in zip(
            springs, plant.displacements(0.0, z[:n]), z[n : n + count], signs.tolist(), strict=True
        ):
            y = x - p.displacement_offset
            growth.append(p.rho * growth_of(p, sign * w))
            tangents.append(
                polynomial(derivative(p.kE), y)
                + p.kappa_omega * (w * polynomial(derivative(p.kA), y) + polynomial(p.kA, y) * growth[-1])
            )
        q_rate = np.linalg.solve(plant.K + plant.G * (plant.counts * tangents) @ plant.G.T, missing)
        slip = plant.G.T @ q_rate
        assert (slip * signs > 0.0).all(), "a spring turns while the load grows"
        return np.concatenate([q_rate, np.array(growth) * slip, pulls(z) * slip])

    end = solve_ivp(rate, (0.0, 1.0), start, "DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
    return Equilibrium(end[:n], end[n : n + count], end[n + count :])
