"""What springs and masses on springs do, by the equations alone: nothing of the package is used.

One spring, paper eqs. (8)-(11): r = FE(x) + kappa_omega*omega*FA(x), x = displacement - displacement_offset. omega
depends on the travel only: with u = direction*omega and s the way since the reversal

    du/ds = rho*(1 - u^n) for u >= 0,   du/ds = rho*(1 + (2*sigma - 1)*(-u)^n) for u < 0,

so that a stroke is one initial value problem over its travel, whatever is sampled of it (`OracleSpring`); its inverse,
the travel to a value of u, is hypergeometric (`travel_to`). FE is a polynomial in x, or the not-a-knot spline through
`FE_forces` at `FE_knots`; beyond the range FE is continued along its tangent, and FA is held. A Maxwell branch moves at
constant velocity between samples, where its equation has an exact solution (`exact_maxwell`).

Masses on springs are one set of equations for one solver, stopped at each turn of a spring (`monolithic`):

    M q'' + C q' + K q = load(t) - sum_j count_j*g_j*r_j(d_j, omega_j),   d_j' = g_j.q' - base_j'(t).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mpmath
import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

if TYPE_CHECKING:
    from strandspring import SpringParameters
    from strandspring.core.branches import MaxwellBranch
    from strandspring.cosimulation import Plant

FloatArray = NDArray[np.float64]
_DECAYED = 40.0  # exp(-40) is below the rounding of 1


class OracleSpring:
    """A spring from the parameters of a model file.

    Parameters
    ----------
    parameters : mapping   Field `parameters` of the file.
    rtol, atol : float     Of the solver. With these omega errs by less than 1e-6, where n is small; else by 1e-8.
    """

    def __init__(self, parameters: Mapping[str, Any], rtol: float = 1e-9, atol: float = 1e-11) -> None:
        self.values = dict(parameters)
        self.tolerances = {"rtol": rtol, "atol": atol}
        self._spline = None
        if "FE_knots" in parameters:
            self._spline = CubicSpline(parameters["FE_knots"], parameters["FE_forces"], bc_type="not-a-knot")

    @classmethod
    def load(cls, path: Path) -> OracleSpring:
        """The spring of a model file."""
        return cls(json.loads(path.read_text(encoding="utf-8"))["parameters"])

    def elastic(self, displacement: FloatArray) -> FloatArray:
        """FE along a path [N]."""
        inside, p = self._inside(displacement), self.values
        if self._spline is not None:
            force, slope = self._spline(inside), self._spline(inside, 1)
        else:
            x = inside - p["displacement_offset"]
            force, slope = polyval(x, p["kE"]), polyval(x, polyder(p["kE"]))
        return np.asarray(force + slope * (displacement - inside))

    def amplifier(self, displacement: FloatArray) -> FloatArray:
        """FA along a path [-]."""
        return np.asarray(polyval(self._inside(displacement) - self.values["displacement_offset"], self.values["kA"]))

    def force(self, displacement: FloatArray, omega_start: float, time: FloatArray | None = None) -> FloatArray:
        """Force along a path that starts with this omega in each mechanism, and without force in branches [N]."""
        hysteretic = self.values["kappa_omega"] * self.omega(displacement, omega_start)
        force = self.elastic(displacement) + hysteretic * self.amplifier(displacement)
        if second := self.values.get("second"):
            place = {name: value for name, value in self.values.items() if name.startswith("displacement_")}
            force = force + OracleSpring({"kE": [0.0], **place, **second}, **self.tolerances).force(
                displacement, omega_start
            )
        for branch in self.values.get("branches", ()):
            assert time is not None
            force = force + maxwell(branch["stiffness"], branch["time_constant"], displacement, time)
        return force

    def omega(self, displacement: FloatArray, omega_start: float) -> FloatArray:
        """omega at every sample [-], stroke by stroke between all changes of direction."""
        omega = np.full(displacement.size, float(omega_start))
        moving = np.flatnonzero(np.diff(displacement))
        signs = np.sign(np.diff(displacement)[moving])
        ends = [*moving[:-1][signs[1:] != signs[:-1]] + 1, displacement.size - 1]
        begin = 0
        for end in ends:
            if end > begin:
                sign = 1.0 if displacement[end] >= displacement[begin] else -1.0
                travel = np.abs(displacement[begin : end + 1] - displacement[begin])
                omega[begin : end + 1] = sign * self._stroke(sign * omega[begin], travel)
                begin = end
        return omega

    def _stroke(self, start: float, travel: FloatArray) -> FloatArray:
        """u at these ways from a reversal; the two branches apart, since the slope of u has a cusp at 0 for n < 1."""
        p = self.values
        n, curvature = p["n"], 2.0 * p["sigma"] - 1.0
        way = p["rho"] * travel
        u = np.ones(travel.size)
        crossing = 0.0
        if start < 0.0:

            def returning(_: float, u: FloatArray) -> FloatArray:
                return 1.0 + curvature * np.maximum(-u, 0.0) ** n

            def crosses(_: float, u: FloatArray) -> float:
                return float(u[0])

            crosses.terminal = True  # type: ignore[attr-defined]
            run = self._solved(returning, start, way[-1], crosses)
            crossing = float(run.t[-1])
            before = way <= crossing
            u[before] = run.sol(way[before])[0]
            if before.all():
                return u
            start = 0.0
        later = way >= crossing
        # 1 - u falls as exp(-n*way) in the end.
        saturation = crossing + 1.0 + _DECAYED / n
        if start < 1.0:
            run = self._solved(lambda _, u: 1.0 - np.clip(u, 0.0, 1.0) ** n, start, min(way[-1], saturation) - crossing)
            rising = later & (way <= saturation)
            if rising.any():
                u[rising] = run.sol(way[rising] - crossing)[0]
        return u

    def _solved(self, slope: Any, start: float, end: float, event: Any = None) -> Any:
        return solve_ivp(
            slope, (0.0, end), [start], method="DOP853", events=event, dense_output=True, **self.tolerances
        )

    def _inside(self, displacement: FloatArray) -> FloatArray:
        return np.clip(displacement, self.values["displacement_min"], self.values["displacement_max"])


def maxwell(stiffness: float, tau: float, displacement: FloatArray, time: FloatArray) -> FloatArray:
    """dr/dt = stiffness*dx/dt - r/tau, at constant velocity between samples [N]."""
    forces = [0.0]
    for h, d in zip(np.diff(time).tolist(), np.diff(displacement).tolist(), strict=True):
        held = np.exp(-h / tau)
        forces.append(forces[-1] * held + stiffness * d * (1.0 if h == 0.0 else -np.expm1(-h / tau) * tau / h))
    return np.array(forces)


def exact_maxwell(branch: MaxwellBranch, path: FloatArray, time: FloatArray) -> list[mpmath.mpf]:
    """The same with 60 digits."""
    with mpmath.workdps(60):
        tau, force = mpmath.mpf(branch.time_constant), mpmath.mpf(0)
        forces = [force]
        for h, d in zip(np.diff(time).tolist(), np.diff(path).tolist(), strict=True):
            mean = mpmath.mpf(1) if h == 0.0 else -tau / h * mpmath.expm1(-h / tau)
            force = force * mpmath.exp(-h / tau) + mpmath.mpf(branch.stiffness) * d * mean
            forces.append(force)
        return forces


def oracle_force(p: SpringParameters, path: FloatArray, time: FloatArray, starts: Sequence[float]) -> FloatArray:
    """The whole force [N]: mechanisms by an ODE solver, branches by `exact_maxwell`."""
    tight = {"rtol": 3e-14, "atol": 1e-15}
    force = np.zeros(path.size)
    for mechanism, start in zip(p.mechanisms, starts, strict=False):
        force += OracleSpring(mechanism.as_dict(), **tight).force(path, start)
    for branch in p.branches:
        force += np.array([float(value) for value in exact_maxwell(branch, path, time)])
    return force


def travel_to(u: float, n: float, sigma: float) -> float:
    """rho*s from u = 0 to u, by the integral of eq. (11) in closed form."""
    c = 1.0 if u >= 0.0 else 1.0 - 2.0 * sigma
    return float(u * mpmath.hyp2f1(1, 1 / mpmath.mpf(n), 1 + 1 / mpmath.mpf(n), c * abs(u) ** mpmath.mpf(n)))


def rate_of_omega(p: SpringParameters, velocity: float, omega: float) -> float:
    """d(omega)/dt, paper eq. (11); where a solver tries more than saturation, that of saturation."""
    sign = np.sign(velocity) * np.sign(omega)
    return float(p.rho * velocity * (1.0 - (p.sigma * sign - p.sigma + 1.0) * min(abs(omega), 1.0) ** p.n))


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


def _power_sum(coefficients: Sequence[float], x: float) -> float:
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * x + float(coefficient)
    return total


def force_of(p: SpringParameters, displacement: float, omega: float) -> float:
    """Paper eq. (10) within the identified range [N]."""
    assert p.displacement_min <= displacement <= p.displacement_max, f"{displacement} m is outside the range"
    x = displacement - p.displacement_offset
    return _power_sum(p.kE, x) + p.kappa_omega * omega * _power_sum(p.kA, x)


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
    rtol: float = 1e-9,
) -> Reference:
    """Solve for rising `times` from the first of them.

    Parameters
    ----------
    base_velocities   d base_j/dt; zero by default.
    equilibrium       Initial state; q = 0 with omega = 0 by default.
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
    found, reversals = [state], 0
    while len(found) < times.size:
        events = [turning(j, d) for j, d in enumerate(directions.tolist())]
        piece = solve_ivp(
            partial(rate, directions=directions), (now, stop), state, "DOP853", dense_output=True, events=events,
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
                _power_sum(polyder(p.kE), y)
                + p.kappa_omega * (w * _power_sum(polyder(p.kA), y) + _power_sum(p.kA, y) * growth[-1])
            )
        q_rate = np.linalg.solve(plant.K + plant.G * (plant.counts * tangents) @ plant.G.T, missing)
        slip = plant.G.T @ q_rate
        assert (slip * signs > 0.0).all(), "a spring turns while the load grows"
        return np.concatenate([q_rate, np.array(growth) * slip, pulls(z) * slip])

    end = solve_ivp(rate, (0.0, 1.0), start, "DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
    return Equilibrium(end[:n], end[n : n + count], end[n + count :])
