"""What springs, masses and bodies on springs do, by the equations alone: nothing of the package is used but its data.

One spring, paper eqs. (8)-(11): r = FE(x) + kappa_omega*omega*FA(x), x = displacement - displacement_offset. omega
depends on the travel only: with u = direction*omega and s the way since the reversal

    du/ds = rho*(1 - u^n) for u >= 0,   du/ds = rho*(1 + (2*sigma - 1)*(-u)^n) for u < 0,

so that a stroke is one initial value problem over its travel, whatever is sampled of it (`OracleSpring`); its inverse,
the travel to a value of u, is hypergeometric (`travel_to`). FE is a polynomial in x, or the not-a-knot spline through
`FE_forces` at `FE_knots`; beyond the range FE is continued along its tangent, and FA is held. A Maxwell branch moves at
constant velocity between samples, where its equation has an exact solution (`exact_maxwell`).

Masses on springs are one set of equations for one solver, stopped at each turn of a spring (`monolithic`):

    M q'' + C q' + K q = load(t) - sum_j count_j*g_j*r_j(d_j, omega_j),   d_j' = g_j.q' - base_j'(t).

Bodies move by Newton and Euler in an inertial frame (`bodies_motion`): with y the place of a centre of gravity relative
to the origin of the base in axes that do not turn, R the orientation of a body (R_0 that of the base), W the angular
velocity in its own frame and a, w_0 those of the base,

    m y'' = F + m (g - R_0 a),   J W' = M - W x J W,   R' = R [W x],   R_0' = R_0 [w_0 x],

and for an axis e of a mount at P_B of the body, on the support A (P_A, angular velocity w_A),

    d = (R_A e).(P_B - P_A),   x = nominal + d/S,   f = P*r(x, omega) + c*d' + stops,

where -f R_A e acts on the body and f R_A e on the support, both at P_B. What a body cannot do is projected out; the
base must not turn then.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import ArrayLike, NDArray

from strandspring.vibration.bodies.loads import ChannelKind, LoadCase
from strandspring.vibration.bodies.parts import BASE, MotionKind
from strandspring.vibration.one_mass.options import Excitation
from strandspring.vibration.one_mass.system import IsolatedMass, static_equilibrium

if TYPE_CHECKING:
    from strandspring import SpringParameters
    from strandspring.core.branches import MaxwellBranch
    from strandspring.cosimulation import Plant
    from strandspring.vibration.bodies.mounted import MountedSystem

FloatArray = NDArray[np.float64]
_DECAYED = 40.0  # exp(-40) is below the rounding of 1


def _solved(*problem: Any, **options: Any) -> Any:
    from scipy.integrate import solve_ivp

    run = solve_ivp(*problem, **options)
    assert run.success, run.message
    return run


# ---- one spring -----------------------------------------------------------------------------------


class OracleSpring:
    """A spring from the field `parameters` of its model file; omega errs by 1e-6 where n is small, else by 1e-8."""

    def __init__(self, parameters: Mapping[str, Any], rtol: float = 1e-9, atol: float = 1e-11) -> None:
        self.values, self.tolerances = dict(parameters), {"rtol": rtol, "atol": atol}

    def elastic(self, displacement: FloatArray) -> FloatArray:
        """FE along a path [N]."""
        from scipy.interpolate import CubicSpline

        inside, p = self._inside(displacement), self.values
        if "FE_knots" in p:
            spline = CubicSpline(p["FE_knots"], p["FE_forces"], bc_type="not-a-knot")
            force, slope = spline(inside), spline(inside, 1)
        else:
            x = inside - p["displacement_offset"]
            force, slope = polyval(x, p["kE"]), polyval(x, polyder(p["kE"]))
        return np.asarray(force + slope * (displacement - inside))

    def force_at(self, displacement: FloatArray, omega: ArrayLike) -> FloatArray:
        """Paper eq. (10) [N]."""
        amplifier = polyval(self._inside(displacement) - self.values["displacement_offset"], self.values["kA"])
        return self.elastic(displacement) + self.values["kappa_omega"] * np.asarray(omega) * amplifier

    def force(self, displacement: FloatArray, omega_start: float, time: FloatArray | None = None) -> FloatArray:
        """Force along a path that starts with this omega in each mechanism, and without force in branches [N]."""
        force = self.force_at(displacement, self.omega(displacement, omega_start))
        if second := self.values.get("second"):
            place = {name: value for name, value in self.values.items() if name.startswith("displacement_")}
            other = OracleSpring({"kE": [0.0], **place, **second}, **self.tolerances)
            force = force + other.force(displacement, omega_start)
        for branch in self.values.get("branches", ()):
            assert time is not None
            force = force + maxwell(branch["stiffness"], branch["time_constant"], displacement, time)
        return force

    def omega(self, displacement: FloatArray, omega_start: float) -> FloatArray:
        """omega at every sample [-], stroke by stroke between all changes of direction."""
        omega = np.full(displacement.size, float(omega_start))
        moving = np.flatnonzero(np.diff(displacement))
        signs = np.sign(np.diff(displacement)[moving])
        begin = 0
        for end in [*moving[:-1][signs[1:] != signs[:-1]] + 1, displacement.size - 1]:
            if end > begin:
                sign = 1.0 if displacement[end] >= displacement[begin] else -1.0
                travel = np.abs(displacement[begin : end + 1] - displacement[begin])
                omega[begin : end + 1] = sign * self._stroke(sign * omega[begin], travel)
                begin = end
        return omega

    def _stroke(self, start: float, travel: FloatArray) -> FloatArray:
        """u at these ways from a reversal; the two branches apart, since the slope of u has a cusp at 0 for n < 1."""
        n, curvature = self.values["n"], 2.0 * self.values["sigma"] - 1.0
        way, u, crossing = self.values["rho"] * travel, np.ones(travel.size), 0.0
        if start < 0.0:

            def crosses(_: float, u: FloatArray) -> float:
                return float(u[0])

            crosses.terminal = True  # type: ignore[attr-defined]
            run = self._run(lambda _, u: 1.0 + curvature * np.maximum(-u, 0.0) ** n, start, way[-1], crosses)
            crossing, start = float(run.t[-1]), 0.0
            before = way <= crossing
            u[before] = run.sol(way[before])[0]
            if before.all():
                return u
        # 1 - u falls as exp(-n*way) in the end.
        saturation = crossing + 1.0 + _DECAYED / n
        if start < 1.0:
            run = self._run(lambda _, u: 1.0 - np.clip(u, 0.0, 1.0) ** n, start, min(way[-1], saturation) - crossing)
            rising = (way >= crossing) & (way <= saturation)
            if rising.any():
                u[rising] = run.sol(way[rising] - crossing)[0]
        return u

    def _run(self, slope: Any, start: float, end: float, event: Any = None) -> Any:
        return _solved(slope, (0.0, end), [start], "DOP853", events=event, dense_output=True, **self.tolerances)

    def _inside(self, displacement: FloatArray) -> FloatArray:
        return np.clip(displacement, self.values["displacement_min"], self.values["displacement_max"])


def maxwell(stiffness: Any, tau: Any, displacement: FloatArray, time: FloatArray, numbers: Any = np) -> FloatArray:
    """dr/dt = stiffness*dx/dt - r/tau, at constant velocity between samples [N]."""
    forces = [0.0 * stiffness]
    for h, d in zip(np.diff(time).tolist(), np.diff(displacement).tolist(), strict=True):
        mean = 1.0 if h == 0.0 else -numbers.expm1(-h / tau) * tau / h
        forces.append(forces[-1] * numbers.exp(-h / tau) + stiffness * d * mean)
    return np.array(forces)


def exact_maxwell(branch: MaxwellBranch, path: FloatArray, time: FloatArray) -> FloatArray:
    """The same with 60 digits."""
    import mpmath

    with mpmath.workdps(60):
        return maxwell(mpmath.mpf(branch.stiffness), mpmath.mpf(branch.time_constant), path, time, mpmath)


def oracle_force(p: SpringParameters, path: FloatArray, time: FloatArray, starts: Sequence[float]) -> FloatArray:
    """The whole force [N]: mechanisms by an ODE solver, branches by `exact_maxwell`."""
    force = np.zeros(path.size)
    for mechanism, start in zip(p.mechanisms, starts, strict=False):
        force += OracleSpring(mechanism.as_dict(), rtol=3e-14, atol=1e-15).force(path, start)
    for branch in p.branches:
        force += exact_maxwell(branch, path, time).astype(float)
    return force


def travel_to(u: float, n: float, sigma: float) -> float:
    """rho*s from u = 0 to u, by the integral of eq. (11) in closed form."""
    import mpmath

    c, power = 1 if u >= 0 else 1 - 2 * mpmath.mpf(sigma), mpmath.mpf(n)
    return float(u * mpmath.hyp2f1(1, 1 / power, 1 + 1 / power, c * abs(u) ** power))


def rate_of_omega(p: SpringParameters, velocity: float, omega: float, direction: float = 0.0) -> float:
    """d(omega)/dt, paper eq. (11), of this direction or that of the velocity; where a solver tries more than
    saturation, that of saturation.
    """
    sign = (direction or np.sign(velocity)) * np.sign(omega)
    return float(p.rho * velocity * (1.0 - (p.sigma * sign - p.sigma + 1.0) * min(abs(omega), 1.0) ** p.n))


def spring_force(p: SpringParameters, x: float, omega: float) -> float:
    """Paper eq. (10) of a polynomial FE within the range [N]."""
    elastic, amplifier = (sum(c * x**i for i, c in enumerate(cs)) for cs in (p.kE, p.kA))
    return elastic + p.kappa_omega * omega * amplifier


# ---- masses on springs ----------------------------------------------------------------------------


class Shaken(NamedTuple):
    """A steady period: first harmonic of the relative motion as a cos + b sin (a - i b) and half the stroke [m], and
    the largest acceleration of the mass, not relative to the base [m/s^2].
    """

    relative: complex
    amplitude: float
    acceleration: float


def shaken(
    system: IsolatedMass, excitation: Excitation, level: float, frequency: float, repeat: float = 1e-6
) -> Shaken:
    """Integrate a mass on springs from rest until three periods repeat within a share of the motion."""
    p, m, circular = system.spring, system.mass, 2.0 * math.pi * frequency
    parts, branches = p.mechanisms, p.branches
    of_base = {Excitation.BASE_DISPLACEMENT: -(circular**2) * level, Excitation.BASE_ACCELERATION: level}
    base = of_base.get(excitation, 0.0)  # amplitude of its acceleration
    strength = level if excitation is Excitation.FORCE else -m * base

    mount = system.mount

    def rate(t: float, state: FloatArray) -> list[float]:
        z, v, *rest = state.tolist()
        omegas, stretches = rest[: len(parts)], rest[len(parts) :]
        x, speed = z / mount.series - p.displacement_offset, v / mount.series
        force = sum(spring_force(one, x, omega) for one, omega in zip(parts, omegas, strict=True))
        force += sum(b.stiffness * s for b, s in zip(branches, stretches, strict=True))
        push = system.static_load + strength * math.cos(circular * t) - mount.damping * v - mount.parallel * force
        of_omegas = [rate_of_omega(one, speed, omega) for one, omega in zip(parts, omegas, strict=True)]
        decays = [speed - s / b.time_constant for b, s in zip(branches, stretches, strict=True)]
        return [v, push / m, *of_omegas, *decays]

    period, count = 1.0 / frequency, 512
    times = period * np.arange(count + 1) / count
    weights, last, agreed = np.exp(-1j * circular * times[:-1]) * 2.0 / count, 0.0j, 0
    state = np.zeros(2 + len(parts) + len(branches))
    state[0] = mount.series * static_equilibrium(system).displacement
    for _ in range(2000):
        run = _solved(rate, (0.0, period), state, "LSODA", times, rtol=1e-8, atol=1e-11, max_step=period / 50)
        state = run.y[:, -1]
        relative = complex(run.y[0, :-1] @ weights)
        agreed = agreed + 1 if abs(relative - last) <= repeat * abs(relative) else 0
        last = relative
        if agreed == 3:
            found = np.array([rate(t, one)[1] for t, one in zip(times, run.y.T, strict=True)])
            acceleration = np.abs(found + base * np.cos(circular * times)).max()
            return Shaken(relative, 0.5 * float(np.ptp(run.y[0])), float(acceleration))
    raise AssertionError(f"no steady motion at {frequency} Hz")


class Reference(NamedTuple):
    """Solution at K times, with the names and shapes of `strandspring.cosimulation.Motion`."""

    q: FloatArray
    velocity: FloatArray
    displacement: FloatArray
    force: FloatArray
    absorbed_energy: FloatArray
    reversals: int


def monolithic(
    plant: Plant,
    springs: Sequence[SpringParameters],
    times: FloatArray,
    *,
    base_velocities: Sequence[Callable[[float], float]] | None = None,
    velocity: Sequence[float] | None = None,
    rtol: float = 1e-9,
) -> Reference:
    """Solve for rising `times` from the first of them, from q = 0 with omega = 0."""
    n, count = plant.coordinates, len(springs)
    velocities = [lambda _: 0.0] * count if base_velocities is None else base_velocities
    inverse = np.linalg.inv(plant.M)
    pulls, damping, stiffness = inverse @ (plant.G * plant.counts), inverse @ plant.C, inverse @ plant.K

    def slips(t: float, v: FloatArray) -> FloatArray:
        return plant.G.T @ v - [s(t) for s in velocities]

    def forces(t: float, z: FloatArray) -> FloatArray:
        displacements, omegas = plant.displacements(t, z[:n]).tolist(), z[2 * n : 2 * n + count].tolist()
        for p, x in zip(springs, displacements, strict=True):
            assert p.displacement_min <= x <= p.displacement_max, f"{x} m is outside the range"
        return np.array([spring_force(p, x - p.displacement_offset, w)
                         for p, x, w in zip(springs, displacements, omegas, strict=True)])  # fmt: skip

    def rate(t: float, z: FloatArray, directions: FloatArray) -> FloatArray:
        v, slip, force = z[n : 2 * n], slips(t, z[n : 2 * n]), forces(t, z)
        rows = zip(springs, slip.tolist(), z[2 * n : 2 * n + count].tolist(), directions.tolist(), strict=True)
        acceleration = inverse @ plant.load_at(t) - damping @ v - stiffness @ z[:n] - pulls @ force
        return np.concatenate([v, acceleration, [rate_of_omega(*row) for row in rows], force * slip])

    def turning(place: int, direction: float) -> Callable[[float, FloatArray], float]:
        def event(t: float, z: FloatArray) -> float:
            return float(direction * slips(t, z[n : 2 * n])[place])

        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        return event

    state = np.concatenate([np.zeros(n), np.zeros(n) if velocity is None else velocity, np.zeros(2 * count)])
    now, stop = float(times[0]), float(times[-1])
    # At rest, the direction of each spring is that of its motion shortly after.
    soon = now + 1e-9 * (stop - now)
    first = rate(now, state, np.ones(count))
    directions = np.sign(slips(soon, state[n : 2 * n] + (soon - now) * first[n : 2 * n]))
    directions[directions == 0.0] = 1.0
    found, reversals = [state], 0
    while len(found) < times.size:
        events = [turning(j, d) for j, d in enumerate(directions.tolist())]
        piece = _solved(
            partial(rate, directions=directions), (now, stop), state, "DOP853", dense_output=True, events=events,
            rtol=rtol, atol=1e-13,
        )  # fmt: skip
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


def loaded(plant: Plant, springs: Sequence[SpringParameters], directions: Sequence[int]) -> FloatArray:
    """q in static equilibrium of the plant if its load grows slowly from the force of the springs at q = 0, for springs
    of which each moves in one of the `directions` (+1 or -1) only; refused where one does not.
    """
    from scipy.optimize import root

    oracles = [OracleSpring(p.as_dict(), 1e-12, 1e-14) for p in springs]
    start = plant.displacements(0.0, np.zeros(plant.coordinates))

    def ways(q: FloatArray) -> FloatArray:
        return np.linspace(start, plant.displacements(0.0, q), 2)

    def missing(q: FloatArray) -> FloatArray:
        forces = [one.force(way, 0.0)[-1] for one, way in zip(oracles, ways(q).T, strict=True)]
        return plant.load_at(0.0) + plant.generalized_force(np.array(forces)) - plant.K @ q

    found = root(missing, np.zeros(plant.coordinates), tol=1e-13)
    assert np.abs(found.fun).max() < 1e-8 * np.abs(plant.load_at(0.0)).max(), found.message
    assert ((ways(found.x)[-1] - start) * directions > 0.0).all(), "a spring turns while the load grows"
    return np.asarray(found.x)


# ---- bodies on mounts -----------------------------------------------------------------------------


class Course(NamedTuple):
    """A load as a function of time, known with its antiderivative: a `Signal`, and a value for the oracle."""

    value: Callable[[float], float]
    integral: Callable[[FloatArray], FloatArray]
    corners: tuple[float, ...] = ()

    def averages(self, step: float, count: int) -> FloatArray:
        return np.diff(self.integral(step * np.arange(count + 1.0))) / step


def half_sine(peak: float, duration: float) -> Course:
    """peak*sin(pi t/duration) until `duration`, then nothing."""
    rate = math.pi / duration
    return Course(
        lambda t: peak * math.sin(rate * t) if t < duration else 0.0,
        lambda t: peak / rate * (1.0 - np.cos(rate * np.minimum(t, duration))),
        (duration,),
    )


def sine(amplitude: float, frequency: float, phase: float = 0.0) -> Course:
    """amplitude*sin(2 pi frequency t + phase)."""
    rate = 2.0 * math.pi * frequency
    return Course(
        lambda t: amplitude * math.sin(rate * t + phase), lambda t: -amplitude / rate * np.cos(rate * t + phase)
    )


class BodiesMotion(NamedTuple):
    """Solution at K times for A axes and Q points: displacements d and forces f of the axes (K, A), accelerations of
    the points in the frame of the base, but not relative to it (K, Q, 3), and energies absorbed (K, A).
    """

    stroke: FloatArray
    force: FloatArray
    acceleration: FloatArray
    absorbed: FloatArray


class _Springs:
    """Paper eqs. (8)-(11) of all axes at once, of which those of each slice act together."""

    def __init__(self, parameters: Sequence[SpringParameters], together: Sequence[slice]) -> None:
        names = ("kappa_omega", "rho", "sigma", "n", "displacement_offset", "x_min", "x_max")
        values = np.array([[getattr(p, name) for p in parameters] for name in names])
        self.kappa, self.rho, self.sigma, self.n, self.offset, self.low, self.high = values
        rows = [p.kE for p in parameters], [p.kA for p in parameters]
        self.kE, self.kA = (np.array([(*c, *[0.0] * (8 - len(c))) for c in each]).T for each in rows)
        self.together = together

    def force(self, position: FloatArray, omega: FloatArray) -> FloatArray:
        x = position - self.offset
        inside = np.clip(x, self.low, self.high)
        slope = polyval(inside, polyder(self.kE), tensor=False)
        elastic = polyval(inside, self.kE, tensor=False) + slope * (x - inside)
        return np.asarray(elastic + self.kappa * omega * polyval(inside, self.kA, tensor=False))

    def omega_rate(self, rate: FloatArray, omega: FloatArray) -> FloatArray:
        """Eq. (11); for axes that act `together` s - |omega|^(n - 2)*omega*[sigma*sum(|s*omega|) +
        (1 - sigma)*sum(s*omega)] with s = rho*x': Park, Wen and Ang (1986) for n = 2 and sigma = 1/2.
        """
        slip = self.rho * rate
        if not self.together:
            weight = self.sigma * np.sign(rate) * np.sign(omega) - self.sigma + 1.0
            return np.asarray(slip * (1.0 - weight * np.minimum(np.abs(omega), 1.0) ** self.n))
        result = slip.copy()
        for own in self.together:
            work, length = slip[own] * omega[own], max(float(np.linalg.norm(omega[own])), 1e-300)
            sums = self.sigma[own] * abs(work).sum() + (1.0 - self.sigma[own]) * work.sum()
            result[own] -= min(length, 1.0) ** self.n[own] * omega[own] / length**2 * sums
        return result


class _Equations:
    """The right-hand side, and what it is made of. The base stands behind the bodies, as number N.

    A state holds y, v, the quaternion and W of each body, the quaternion of the base, and of the axes omega, the energy
    absorbed, omega of the second mechanism and the elongations of three branches.
    """

    def __init__(self, system: MountedSystem, case: LoadCase) -> None:
        self.system, self.case, self.gravity = system, case, np.array(system.gravity)
        axes, mounts, n = system.axes, system.axis_mounts, len(system.bodies)
        springs = [axis.spring for axis in axes]
        firsts = np.cumsum([0, *(len(mount.axes) for mount in system.mounts)]).tolist()
        together = [slice(*ends) for ends in pairwise(firsts)] if system.coupled else []
        self.first = _Springs(springs, together)
        self.second = _Springs([replace(p.mechanisms[-1], kE=(0.0,)) for p in springs], together)
        self.second.kappa = self.second.kappa * [p.second is not None for p in springs]
        pairs = [[*((b.stiffness, 1.0 / b.time_constant) for b in p.branches), *[(0.0, 0.0)] * 3][:3] for p in springs]
        self.branch, self.decay = np.array(pairs).T
        self.on = np.array([mount.body for mount in mounts])
        self.under = np.array([n if mount.support == BASE else mount.support for mount in mounts])
        self.centers = np.array([*(body.center for body in system.bodies), (0.0, 0.0, 0.0)])
        places = np.array([mount.place for mount in mounts])
        self.arm_on, self.arm_under = places - self.centers[self.on], places - self.centers[self.under]
        self.directions = np.array([axis.direction for axis in axes])
        self.nominal, self.parallel, self.series, self.damping = np.array(
            [(axis.nominal, axis.parallel, axis.series, axis.damping) for axis in axes]
        ).T
        stops = [(s.low, s.high, s.stiffness) if (s := axis.stops) else (-np.inf, np.inf, 0.0) for axis in axes]
        self.low, self.high, self.stop = np.array(stops).T
        self.mass, self.inertia = (np.array([getattr(b, name) for b in system.bodies]) for name in ("mass", "inertia"))
        ways, free, none = [], np.eye(3), np.zeros((3, 3))
        for body in system.bodies:
            along = np.outer(body.direction, body.direction)
            ways.append({
                MotionKind.SIX: (free, free), MotionKind.PLANE: (free - along, along), MotionKind.AXIS: (along, none)
            }[body.motion])  # fmt: skip
        self.moves, self.turns = np.array(ways).swapaxes(0, 1)  # projections of translations and rotations
        self.mobility = np.linalg.pinv(self.turns @ self.inertia @ self.turns)

    def parts(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What moves of the bodies and of the base, shape (N + 1, 13), their orientations, and the rows of the axes."""
        from scipy.spatial.transform import Rotation

        n = self.mass.size
        moving = np.zeros((n + 1, 13))
        moving[:n], moving[n, 6:10] = z[: 13 * n].reshape(n, 13), z[13 * n : 13 * n + 4]
        return moving, Rotation.from_quat(moving[:, 6:10]).as_matrix(), z[13 * n + 4 :].reshape(6, -1)

    def solved(self, t: float, z: FloatArray) -> tuple[FloatArray, ...]:
        """Rate of the state, linear and angular accelerations, d and f, acceleration of the base in its frame."""
        moving, R, (omega, _, second, *elongations) = self.parts(z)
        base, spin = np.zeros(3), np.zeros(3)
        force, moment = np.zeros((2, *moving[:, :3].shape))
        for channel in self.case.channels:
            value = channel.signal.value(t) * np.array(channel.direction)
            if channel.kind is ChannelKind.BASE_ACCELERATION:
                base = base + value
            elif channel.kind is ChannelKind.BASE_ANGULAR_VELOCITY:
                spin = spin + value
            else:
                force[channel.body] += R[channel.body] @ value
                arm = R[channel.body] @ (np.array(channel.place) - self.centers[channel.body])
                moment[channel.body] += np.cross(arm, R[channel.body] @ value)
        y, v, W = moving[:, :3], moving[:, 3:6], moving[:, 10:13].copy()
        W[-1] = spin
        w = _turned(R, W)
        along, lever = _turned(R[self.under], self.directions), _turned(R[self.on], self.arm_on)
        place = y[self.on] + lever
        beside = place - y[self.under]
        d = (along * (beside - _turned(R[self.under], self.arm_under))).sum(axis=1)
        crossed = v[self.on] + np.cross(w[self.on], lever) - v[self.under] - np.cross(w[self.under], beside)
        rate = (along * crossed).sum(axis=1)
        x, slip = self.nominal + d / self.series, rate / self.series
        past = np.maximum(x - self.high, 0.0) + np.minimum(x - self.low, 0.0)
        springs = self.first.force(x, omega) + self.second.force(x, second) + (self.branch * elongations).sum(axis=0)
        held = self.parallel * springs + self.stop * self.series * past
        f = held + self.damping * rate
        for sign, number in ((-1.0, self.on), (1.0, self.under)):
            pull = sign * f[:, None] * along
            np.add.at(force, number, pull)
            np.add.at(moment, number, np.cross(place - y[number], pull))
        linear = _turned(self.moves, force[:-1] / self.mass[:, None] + self.gravity - R[-1] @ base)
        gyroscopic = np.cross(W[:-1], _turned(self.inertia, W[:-1]))
        angular = _turned(self.mobility, _turned(R[:-1].swapaxes(1, 2), moment[:-1]) - gyroscopic)
        # The quaternion's rate q*(W, 0)/2, scalar last.
        vectors, scalars = moving[:, 6:9], moving[:, 9:10]
        turning = 0.5 * np.hstack([scalars * W + np.cross(vectors, W), -(vectors * W).sum(axis=1, keepdims=True)])
        of_axes = [
            self.first.omega_rate(slip, omega), held * rate,
            self.second.omega_rate(slip, second), *(slip - elongations * self.decay),
        ]  # fmt: skip
        of_bodies = np.hstack([v[:-1], linear, turning[:-1], angular])
        return np.concatenate([of_bodies.ravel(), turning[-1], *of_axes]), linear, angular, d, f, base


def _turned(R: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray((R @ vectors[..., None])[..., 0])


def rest_of(system: MountedSystem, case: LoadCase, omega: float) -> FloatArray:
    """State in equilibrium with this omega of all axes, without what drives the case but with its velocity."""
    from scipy.optimize import root
    from scipy.spatial.transform import Rotation

    still = replace(system, gravity=(0.0, 0.0, 0.0) if case.weightless else system.gravity)
    equations = _Equations(still, replace(case, channels=()))
    n, axes = len(system.bodies), len(system.axes)

    def state(pose: FloatArray) -> FloatArray:
        shift, turn = pose.reshape(2, n, 3)
        moving, of_axes = np.zeros((n, 13)), np.zeros((6, axes))
        moving[:, :3] = equations.centers[:-1] + _turned(equations.moves, shift)
        moving[:, 6:10] = Rotation.from_rotvec(_turned(equations.turns, turn)).as_quat()
        of_axes[[0, 2]] = omega
        return np.concatenate([moving.ravel(), (0.0, 0.0, 0.0, 1.0), of_axes.ravel()])

    def unbalanced(pose: FloatArray) -> FloatArray:
        _, linear, angular, *_ = equations.solved(0.0, state(pose))
        shift, turn = pose.reshape(2, n, 3)
        held = shift - _turned(equations.moves, shift), turn - _turned(equations.turns, turn)
        return np.concatenate([linear + 1e3 * held[0], angular + 1e3 * held[1]]).ravel()

    found = root(unbalanced, np.zeros(6 * n), tol=1e-14)
    assert np.abs(found.fun).max() < 1e-7, found.message
    begin = state(found.x)
    begin[: 13 * n].reshape(n, 13)[:, 3:6] += case.velocity
    return begin


def bodies_motion(
    system: MountedSystem, case: LoadCase, times: FloatArray, omega: float = 0.0, rtol: float = 1e-9
) -> BodiesMotion:
    """Solve for rising `times` from 0 on by LSODA; the signals of the case must be of the class `Course`."""
    equations, z = _Equations(system, case), rest_of(system, case, omega)
    corners = {corner for channel in case.channels for corner in channel.signal.corners if 0.0 < corner < times[-1]}
    rows: list[FloatArray] = []
    now = 0.0
    for end in (*sorted(corners), float(times[-1])):
        asked = times[len(rows) :][times[len(rows) :] <= end]
        run = _solved(
            lambda t, z: equations.solved(t, z)[0], (now, end), z, "LSODA", np.union1d(asked, end), rtol=rtol,
            atol=1e-3 * rtol, max_step=1e-3,
        )  # fmt: skip
        rows += [*run.y.T[: asked.size]]
        now, z = end, run.y[:, -1]
    found: list[tuple[FloatArray, ...]] = []
    for t, row in zip(times.tolist(), rows, strict=True):
        moving, R, of_axes = equations.parts(row)
        _, linear, angular, d, f, base = equations.solved(t, row)
        points = []
        for b, place in ((point.body, np.array(point.place)) for point in system.points):
            W, arm = moving[b, 10:13], place - equations.centers[b]
            turning = np.cross(angular[b], arm) + np.cross(W, np.cross(W, arm))
            points.append(R[-1].T @ (linear[b] + R[b] @ turning) + base)
        found.append((d, f, np.array(points).reshape(-1, 3), of_axes[1]))
    return BodiesMotion(*(np.array(values) for values in zip(*found, strict=True)))
