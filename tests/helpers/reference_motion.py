"""Reference for rigid bodies on hysteretic mounts: Newton and Euler in an inertial frame, with one tight solver.

With y the place of a centre of gravity relative to the origin of the base in axes that do not turn, R the orientation
of a body (R_0 that of the base), W the angular velocity in its own frame and a, w_0 those of the base,

    m y'' = F + m (g - R_0 a),   J W' = M - W x J W,   R' = R [W x],   R_0' = R_0 [w_0 x],

and for an axis e of a mount at P_B of the body, on the support A (P_A, angular velocity w_A),

    d = (R_A e).(P_B - P_A),   x = nominal + d/S,   f = P*r(x, omega) + c*d' + stops,
    omega' = rho*x'*{1 - [sigma*sgn(x')*sgn(omega) - sigma + 1]*|omega|^n}                       (paper eq. 11),

where -f R_A e acts on the body and f R_A e on the support, both at P_B. A second mechanism of a spring adds its
kappa_omega*FA*omega with an omega of its own, and each Maxwell branch c*s with s' = x' - s/tau.

The rate of omega is integrated as it stands: nothing of its closed form, of coordinates relative to the base or of
fictitious forces enters. The solver stops and starts anew wherever the right-hand side has a kink: where a spring
turns, where omega changes sign, at stops, at the ends of an identified range and where a load has a corner.

A body that does not move in all six degrees of freedom has its free ones projected out; the base must not turn then.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853, LSODA
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation

from strandspring import SpringParameters
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import BASE, MotionKind

FloatArray = NDArray[np.float64]

_STILL = 1e-12  # [m/s] of a spring that does not count as turned
_LOOKS = np.linspace(0.0, 1.0, 6)[1:]  # where within a step kinks are looked for


@dataclass(frozen=True)
class Course:
    """A load as a function of time, known with its antiderivative: a `Signal`, and a value for the reference."""

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


@dataclass(frozen=True, eq=False)
class ReferenceMotion:
    """Solution at K times for N bodies, A axes and Q points; places and vectors in the frame of the base."""

    time: FloatArray
    displacement: FloatArray  # of the centres of gravity from the nominal pose, (K, N, 3) [m]
    orientation: FloatArray  # of the bodies relative to the base, (K, N, 3, 3)
    stroke: FloatArray  # displacement d of the axes, (K, A) [m]
    stroke_rate: FloatArray  # (K, A) [m/s]
    omega: FloatArray  # (K, A)
    force: FloatArray  # f of the axes, (K, A) [N]
    acceleration: FloatArray  # of the points, not relative to the base, (K, Q, 3) [m/s^2]
    absorbed: FloatArray  # integral of f without the damper's force over d, (K, A) [J]
    momentum: FloatArray  # angular, about the centres of gravity, in axes that do not turn, (K, N, 3) [N m s]
    kinetic: FloatArray  # energy of the bodies relative to the origin of the base, (K, N) [J]
    kinks: int  # places where the solver started anew


@dataclass
class _Springs:
    """Paper eqs. (8)-(11) of all axes at once; outside the range FE is continued along its tangent and FA is held."""

    parameters: Sequence[SpringParameters]
    kE: FloatArray = field(init=False)
    kA: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        assert all(p.kE for p in self.parameters), "the reference has no tables of FE"
        self.kE, self.kA = (self._padded([getattr(p, name) for p in self.parameters]) for name in ("kE", "kA"))
        self.slope = self.kE[:, 1:] * np.arange(1, self.kE.shape[1])
        for name in ("kappa_omega", "rho", "sigma", "n", "displacement_offset", "x_min", "x_max"):
            setattr(self, name, np.array([getattr(p, name) for p in self.parameters]))

    @staticmethod
    def _padded(rows: Sequence[tuple[float, ...]]) -> FloatArray:
        width = max(2, *map(len, rows))
        return np.array([(*row, *[0.0] * (width - len(row))) for row in rows])

    @staticmethod
    def _horner(coefficients: FloatArray, x: FloatArray) -> FloatArray:
        total = np.zeros_like(x)
        for column in coefficients.T[::-1]:
            total = total * x + column
        return total

    def force(self, position: FloatArray, omega: FloatArray) -> FloatArray:
        x = position - self.displacement_offset
        inside = np.clip(x, self.x_min, self.x_max)
        elastic = self._horner(self.kE, inside) + self._horner(self.slope, inside) * (x - inside)
        return elastic + self.kappa_omega * omega * self._horner(self.kA, inside)

    def omega_rate(self, rate: FloatArray, direction: FloatArray, omega: FloatArray) -> FloatArray:
        weight = self.sigma * direction * np.sign(omega) - self.sigma + 1.0
        return self.rho * rate * (1.0 - weight * np.minimum(np.abs(omega), 1.0) ** self.n)


class _Equations:
    """The right-hand side, and what it is made of. The base stands behind the bodies, as number N."""

    def __init__(self, system: MountedSystem, case: LoadCase, gravity: FloatArray) -> None:
        self.system, self.case, self.gravity = system, case, gravity
        axes, mounts = system.axes, system.axis_mounts
        self.bodies, self.count = len(system.bodies), len(axes)
        self.springs = _Springs([axis.spring for axis in axes])
        self.second, self.stiffness, self.decay = _added([axis.spring for axis in axes])
        self.centers = np.array([*(body.center for body in system.bodies), (0.0, 0.0, 0.0)])
        self.on = np.array([mount.body for mount in mounts])
        self.under = np.array([self.bodies if mount.support == BASE else mount.support for mount in mounts])
        places = np.array([mount.place for mount in mounts])
        self.arm_on, self.arm_under = places - self.centers[self.on], places - self.centers[self.under]
        self.directions = np.array([axis.direction for axis in axes])
        self.nominal, self.parallel, self.series, self.damping = (
            np.array([float(getattr(axis, name)) for axis in axes])
            for name in ("nominal", "parallel", "series", "damping")
        )
        stops = [(s.low, s.high, s.stiffness) if (s := axis.stops) else (-np.inf, np.inf, 0.0) for axis in axes]
        self.low, self.high, self.stop = np.array(stops).T
        self.mass = np.array([body.mass for body in system.bodies])
        self.inertia = np.array([body.inertia for body in system.bodies])
        self.turns = any(channel.kind is ChannelKind.BASE_ANGULAR_VELOCITY for channel in case.channels)
        assert not self.turns or all(body.motion is MotionKind.SIX for body in system.bodies), "a base that turns"
        self.size = 13 * self.bodies

    def pose(self, t: float, z: FloatArray) -> _Pose:
        """A state by its parts."""
        n = self.bodies
        moving = z[: self.size].reshape(n, 13)
        R = _matrices(np.concatenate([moving[:, 6:10], z[None, self.size : self.size + 4]]))
        y, v, W = np.zeros((3, n + 1, 3))
        y[:n], v[:n], W[:n] = moving[:, :3], moving[:, 3:6], moving[:, 10:13]
        a, W[n] = self.of_base(t)
        rest = z[self.size + 4 :]
        omega, absorbed, second, *elongations = rest.reshape(-1, self.count)
        return _Pose(y, v, R, W, _turned(R, W), a, omega, absorbed, second, np.array(elongations))

    def of_base(self, t: float) -> tuple[FloatArray, FloatArray]:
        """Acceleration and angular velocity in the frame of the base."""
        found = {ChannelKind.BASE_ACCELERATION: np.zeros(3), ChannelKind.BASE_ANGULAR_VELOCITY: np.zeros(3)}
        for channel in self.case.channels:
            if channel.kind in found:
                found[channel.kind] += channel.signal.value(t) * np.array(channel.direction)
        return found[ChannelKind.BASE_ACCELERATION], found[ChannelKind.BASE_ANGULAR_VELOCITY]

    def strokes(self, pose: _Pose) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """d, d', the directions and the places P_B of all axes, in axes that do not turn."""
        y, v, w, on, under = pose.y, pose.v, pose.w, self.on, self.under
        along = _turned(pose.R[under], self.directions)
        lever = _turned(pose.R[on], self.arm_on)
        place = y[on] + lever
        from_support = place - y[under]
        apart = from_support - _turned(pose.R[under], self.arm_under)
        moving = v[on] + _cross(w[on], lever) - v[under] - _cross(w[under], from_support)
        return (along * apart).sum(axis=1), (along * moving).sum(axis=1), along, place

    def forces(self, d: FloatArray, rate: FloatArray, pose: _Pose) -> FloatArray:
        x = self.nominal + d / self.series
        force = self.springs.force(x, pose.omega) + self.second.force(x, pose.second)
        force += (self.stiffness * pose.elongation).sum(axis=0)
        past = np.maximum(x - self.high, 0.0) + np.minimum(x - self.low, 0.0)
        return self.parallel * force + self.damping * rate + self.stop * self.series * past

    def loads(self, t: float, pose: _Pose) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Forces and moments on the bodies without weight, in axes that do not turn; f and d' of the axes."""
        d, rate, along, place = self.strokes(pose)
        f = self.forces(d, rate, pose)
        force, moment = np.zeros((2, self.bodies + 1, 3))
        for sign, number in ((-1.0, self.on), (1.0, self.under)):
            pull = sign * f[:, None] * along
            np.add.at(force, number, pull)
            np.add.at(moment, number, _cross(place - pose.y[number], pull))
        for channel in self.case.channels:
            if channel.kind is ChannelKind.FORCE:
                b = channel.body
                pull = channel.signal.value(t) * pose.R[b] @ channel.direction
                force[b] += pull
                moment[b] += _cross(pose.R[b] @ (np.array(channel.place) - self.centers[b]), pull)
        return force[:-1], moment[:-1], f, rate

    def accelerations(self, t: float, pose: _Pose) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Of the bodies, relative to the origin of the base, and angular in their frames; f and d' of the axes."""
        force, moment, f, rate = self.loads(t, pose)
        linear, angular = np.empty_like(force), np.empty_like(moment)
        pull_of_base = self.gravity - pose.R[-1] @ pose.a
        for b, body in enumerate(self.system.bodies):
            n, W = np.array(body.direction), pose.W[b]
            free = force[b] / self.mass[b] + pull_of_base
            spin = pose.R[b].T @ moment[b] - _cross(W, self.inertia[b] @ W)
            if body.motion is MotionKind.SIX:
                angular[b] = np.linalg.solve(self.inertia[b], spin)
            elif body.motion is MotionKind.PLANE:
                free = free - n * (n @ free)
                angular[b] = n * (n @ spin) / (n @ self.inertia[b] @ n)
            else:
                free, angular[b] = n * (n @ free), 0.0
            linear[b] = free
        return linear, angular, f, rate

    def rate(self, t: float, z: FloatArray, directions: FloatArray) -> FloatArray:
        """d z/dt while the springs move in these directions."""
        pose, moving = self.pose(t, z), z[: self.size].reshape(self.bodies, 13)
        linear, angular, f, d_rate = self.accelerations(t, pose)
        result = np.empty_like(z)
        change = result[: self.size].reshape(self.bodies, 13)
        change[:, :3], change[:, 3:6], change[:, 10:13] = moving[:, 3:6], linear, angular
        for b in range(self.bodies):
            change[b, 6:10] = _quaternion_rate(moving[b, 6:10], pose.W[b])
        result[self.size : self.size + 4] = _quaternion_rate(z[self.size : self.size + 4], pose.W[-1])
        rest = result[self.size + 4 :].reshape(-1, self.count)
        slip_rate = d_rate / self.series
        for row, springs, omega in ((0, self.springs, pose.omega), (2, self.second, pose.second)):
            if self.system.coupled:
                rest[row] = self.coupled_rate(springs, springs.rho * slip_rate, omega)
            else:
                rest[row] = springs.omega_rate(slip_rate, directions, omega)
        rest[1] = (f - self.damping * d_rate) * d_rate
        rest[3:] = slip_rate - pose.elongation * self.decay
        return result

    def coupled_rate(self, springs: _Springs, slip: FloatArray, omega: FloatArray) -> FloatArray:
        """omega' = s - |omega|^(n - 2)*omega*[sigma*sum(|s*omega|) + (1 - sigma)*sum(s*omega)] with s = rho*x' and the
        sums over the axes of a mount: Park, Wen and Ang (1986) for n = 2 and sigma = 1/2, paper eq. 11 for one axis.
        """
        result, first = slip.copy(), 0
        for mount in self.system.mounts:
            own = slice(first, first + len(mount.axes))
            s, o, first = slip[own], omega[own], own.stop
            length = np.linalg.norm(o)
            if length > 0.0:
                sigma, n = springs.sigma[own], springs.n[own]
                result[own] -= (
                    min(length, 1.0) ** n * o / length**2 * (sigma * abs(s * o).sum() + (1.0 - sigma) * (s * o).sum())
                )
        return result

    def kinks(self, t: float, z: FloatArray) -> FloatArray:
        """What has a kink in the right-hand side where it changes sign; the first rows are d'."""
        pose = self.pose(t, z)
        d, rate, _, _ = self.strokes(pose)
        x, s = self.nominal + d / self.series, self.springs
        ends = [x - s.displacement_offset - s.x_min, x - s.displacement_offset - s.x_max]
        stops = [np.where(np.isfinite(end), x - end, 1.0) for end in (self.low, self.high)]
        return np.concatenate([rate, pose.omega, pose.second, *ends, *stops])


@dataclass(frozen=True, eq=False)
class _Pose:
    """Bodies, then the base: places, velocities, orientations, angular velocities in their frames (W) and in axes that
    do not turn (w); the base's acceleration in its frame; of the axes omega, absorbed energy, omega of the second
    mechanism and elongations of the branches, shape (3, A).
    """

    y: FloatArray
    v: FloatArray
    R: FloatArray
    W: FloatArray
    w: FloatArray
    a: FloatArray
    omega: FloatArray
    absorbed: FloatArray
    second: FloatArray
    elongation: FloatArray


def _added(springs: Sequence[SpringParameters]) -> tuple[_Springs, FloatArray, FloatArray]:
    """Second mechanisms, without force where there are none; stiffness and 1/tau of three branches, shape (3, A)."""
    seconds = _Springs([replace(spring.mechanisms[-1], kE=(0.0,)) for spring in springs])
    seconds.kappa_omega *= [spring.second is not None for spring in springs]
    branches = [[*((b.stiffness, 1.0 / b.time_constant) for b in s.branches), *[(0.0, 0.0)] * 3][:3] for s in springs]
    stiffness, decay = np.moveaxis(np.array(branches), 0, 2).swapaxes(0, 1)
    return seconds, stiffness, decay


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def _turned(R: FloatArray, vectors: FloatArray) -> FloatArray:
    return (R @ vectors[..., None])[..., 0]


def _matrices(quaternions: FloatArray) -> FloatArray:
    """Of quaternions of any length, scalar last, shape (K, 4): 1 + 2 s [q x] + 2 [q x][q x] for those of length 1."""
    unit = quaternions / np.sqrt((quaternions**2).sum(axis=1))[:, None]
    skew = np.zeros((unit.shape[0], 3, 3))
    skew[:, [2, 0, 1], [1, 2, 0]] = unit[:, :3]
    skew -= skew.transpose(0, 2, 1)
    return np.eye(3) + 2.0 * unit[:, 3, None, None] * skew + 2.0 * skew @ skew


def _quaternion_rate(q: FloatArray, W: FloatArray) -> FloatArray:
    """q*(W, 0)/2, scalar last, with W in the frame that turns."""
    x, y, z, s = q.tolist()
    a, b, c = W.tolist()
    return 0.5 * np.array([s * a + y * c - z * b, s * b + z * a - x * c, s * c + x * b - y * a, -x * a - y * b - z * c])


def start_of(system: MountedSystem, case: LoadCase, omega: FloatArray) -> FloatArray:
    """State at the beginning of a case: equilibrium with these omegas, and the case's velocity."""
    gravity = np.zeros(3) if case.weightless else np.array(system.gravity)
    equations = _Equations(system, LoadCase(case.name, case.kind, case.duration), gravity)
    n = equations.bodies

    def state(pose: FloatArray) -> FloatArray:
        moving = np.zeros((n, 13))
        moving[:, 9] = 1.0
        for b, body in enumerate(system.bodies):
            direction = np.outer(body.direction, body.direction)
            shift, turn = pose.reshape(n, 6)[b, :3], pose.reshape(n, 6)[b, 3:]
            if body.motion is not MotionKind.SIX:
                shift = (np.eye(3) - direction if body.motion is MotionKind.PLANE else direction) @ shift
                turn = direction @ turn if body.motion is MotionKind.PLANE else 0.0 * turn
            moving[b, :3] = equations.centers[b] + shift
            moving[b, 6:10] = Rotation.from_rotvec(turn).as_quat()
        of_axes = np.zeros((6, omega.size))
        of_axes[[0, 2]] = omega
        return np.concatenate([moving.ravel(), (0.0, 0.0, 0.0, 1.0), of_axes.ravel()])

    def unbalanced(pose: FloatArray) -> FloatArray:
        linear, angular, *_ = equations.accelerations(0.0, equations.pose(0.0, state(pose)))
        slack = np.zeros((n, 6))
        for b, body in enumerate(system.bodies):
            # What cannot move is held where it is.
            direction = np.outer(body.direction, body.direction)
            held = {
                MotionKind.SIX: (0.0 * direction, 0.0 * direction),
                MotionKind.PLANE: (direction, np.eye(3) - direction),
                MotionKind.AXIS: (np.eye(3) - direction, np.eye(3)),
            }[body.motion]
            for half, what in enumerate(held):
                slack[b, 3 * half : 3 * half + 3] = what @ pose.reshape(n, 6)[b, 3 * half : 3 * half + 3]
        return np.hstack([linear, angular]).ravel() + 1e3 * slack.ravel()

    found = root(unbalanced, np.zeros(6 * n), tol=1e-14)
    assert np.abs(unbalanced(found.x)).max() < 1e-7, found.message
    begin = state(found.x)
    begin[: 13 * n].reshape(n, 13)[:, 3:6] += case.velocity
    return begin


def reference_motion(
    system: MountedSystem,
    case: LoadCase,
    times: FloatArray,
    *,
    omega: float | Sequence[float] = 0.0,
    spin: Sequence[Sequence[float]] | None = None,
    rtol: float = 1e-10,
    method: type[DOP853] | type[LSODA] = DOP853,
) -> ReferenceMotion:
    """Solve for rising `times` from 0 on; the signals of the case must be of the class `Course`.

    Parameters
    ----------
    omega    Of all axes at the beginning, in equilibrium.
    spin     Angular velocity of each body at the beginning, in its frame [rad/s].
    """
    gravity = np.array(system.gravity)
    equations = _Equations(system, case, gravity)
    state = start_of(system, case, np.broadcast_to(np.asarray(omega, float), equations.count).copy())
    if spin is not None:
        state[: equations.size].reshape(equations.bodies, 13)[:, 10:13] = spin
    corners = {corner for channel in case.channels for corner in channel.signal.corners if 0.0 < corner < times[-1]}
    directions = np.ones(equations.count)
    rows, now, restarts = [], 0.0, 0
    for end in (*sorted(corners), float(times[-1])):
        while now < end:
            solver = method(
                lambda t, z: equations.rate(t, z, directions), now, state, end, rtol=rtol, atol=1e-13, max_step=2e-3
            )
            now, state, turned = _until_kink(equations, solver, directions, times, rows)
            restarts += turned.size > 0
            slips = turned[turned < equations.count]
            directions[slips] = -directions[slips]
    while len(rows) < times.size:
        rows.append(state)
    return _observed(equations, times, rows, restarts)


def _until_kink(
    equations: _Equations, solver: DOP853 | LSODA, directions: FloatArray, times: FloatArray, rows: list[FloatArray]
) -> tuple[float, FloatArray, NDArray[np.intp]]:
    """Run to the next kink or the end; samples passed are appended to `rows`."""
    axes = equations.count
    before = equations.kinks(solver.t, solver.y)
    # A spring moves in its direction from where it turned, and what is zero there counts with the sign it takes next.
    before[:axes] = np.where(np.abs(before[:axes]) <= _STILL, directions, before[:axes])
    wrong = np.flatnonzero(before[:axes] * directions < 0.0)
    if wrong.size:
        return solver.t, solver.y, wrong
    signs = np.concatenate([directions, np.sign(before[axes:])])
    signs[axes : 3 * axes] *= np.abs(before[axes : 3 * axes]) > 1e-14
    signs[3 * axes :] *= np.abs(before[3 * axes :]) > 1e-15
    while solver.status == "running":
        message = solver.step()
        assert solver.status != "failed", message
        dense, begin = solver.dense_output(), solver.t_old
        earlier = begin
        for share in _LOOKS:
            t = begin + share * (solver.t - begin)
            values = equations.kinks(t, dense(t))
            values[:axes][np.abs(values[:axes]) <= _STILL] = 0.0
            crossed = np.flatnonzero(signs * values < 0.0)
            if crossed.size:
                return _at_kink(equations, dense, earlier, t, crossed, signs, times, rows)
            signs = np.where(signs == 0.0, np.sign(values), signs)
            earlier = t
        _sample(dense, solver.t, times, rows)
    return solver.t, solver.y, np.empty(0, np.intp)


def _at_kink(
    equations: _Equations, dense: Callable[[float], FloatArray], earlier: float, later: float,
    crossed: NDArray[np.intp], signs: FloatArray, times: FloatArray, rows: list[FloatArray],
) -> tuple[float, FloatArray, NDArray[np.intp]]:  # fmt: skip
    def place(k: int) -> float:
        if signs[k] * equations.kinks(earlier, dense(earlier))[k] <= 0.0:
            return earlier
        return float(brentq(lambda t: equations.kinks(t, dense(t))[k], earlier, later, xtol=1e-16, rtol=1e-14))

    found = np.array([place(int(k)) for k in crossed])
    t = float(found.min())
    _sample(dense, t, times, rows)
    state = dense(t)
    # Symmetric mounts turn together.
    at_once = crossed[found <= t + 1e-13]
    axes = equations.count
    omegas = at_once[(at_once >= axes) & (at_once < 3 * axes)] - axes
    state[equations.size + 4 + omegas + np.where(omegas >= axes, axes, 0)] = 0.0
    return t, state, at_once


def _sample(dense: Callable[[float], FloatArray], until: float, times: FloatArray, rows: list[FloatArray]) -> None:
    while len(rows) < times.size and times[len(rows)] <= until:
        rows.append(dense(times[len(rows)]))


def _observed(equations: _Equations, times: FloatArray, rows: Sequence[FloatArray], restarts: int) -> ReferenceMotion:
    found: dict[str, list[FloatArray]] = {
        name: []
        for name in (
            "displacement", "orientation", "stroke", "stroke_rate", "omega", "force", "acceleration", "absorbed",
            "momentum", "kinetic",
        )
    }  # fmt: skip
    system, n = equations.system, equations.bodies
    for t, z in zip(times.tolist(), rows, strict=True):
        pose = equations.pose(t, z)
        linear, angular, f, rate = equations.accelerations(t, pose)
        R, W, base = pose.R[:n], pose.W[:n], pose.R[-1]
        points = []
        for point in system.points:
            b = point.body
            arm = np.array(point.place) - equations.centers[b]
            turning = _cross(angular[b], arm) + _cross(W[b], _cross(W[b], arm))
            points.append(base.T @ (linear[b] + R[b] @ turning) + pose.a)
        momentum = _turned(equations.inertia, W)
        found["displacement"].append(pose.y[:n] @ base - equations.centers[:n])
        found["orientation"].append(base.T @ R)
        found["stroke"].append(equations.strokes(pose)[0])
        found["stroke_rate"].append(rate)
        found["omega"].append(pose.omega)
        found["force"].append(f)
        found["acceleration"].append(np.array(points).reshape(-1, 3))
        found["absorbed"].append(pose.absorbed)
        found["momentum"].append(_turned(R, momentum))
        found["kinetic"].append(0.5 * equations.mass * (pose.v[:n] ** 2).sum(axis=1) + 0.5 * (W * momentum).sum(axis=1))
    return ReferenceMotion(times, kinks=restarts, **{name: np.array(values) for name, values in found.items()})
