"""Rigid bodies on hysteretic mounts by LSODA: Newton and Euler in an inertial frame.

With y the place of a centre of gravity relative to the origin of the base in axes that do not turn, R the orientation
of a body (R_0 that of the base), W the angular velocity in its own frame and a, w_0 those of the base,

    m y'' = F + m (g - R_0 a),   J W' = M - W x J W,   R' = R [W x],   R_0' = R_0 [w_0 x],

and for an axis e of a mount at P_B of the body, on the support A (P_A, angular velocity w_A),

    d = (R_A e).(P_B - P_A),   x = nominal + d/S,   f = P*r(x, omega) + c*d' + stops,
    omega' = rho*x'*{1 - [sigma*sgn(x')*sgn(omega) - sigma + 1]*|omega|^n}                       (paper eq. 11),

where -f R_A e acts on the body and f R_A e on the support, both at P_B. A second mechanism of a spring adds its
kappa_omega*FA*omega with an omega of its own, and each Maxwell branch c*s with s' = x' - s/tau. Nothing of the closed
form of omega, of coordinates relative to the base or of fictitious forces enters. What a body cannot do is projected
out; the base must not turn then.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from strandspring import SpringParameters
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import BASE, MotionKind

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
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


@dataclass(frozen=True, eq=False)
class BodiesMotion:
    """Solution at K times for A axes and Q points: displacements d and forces f of the axes (K, A), accelerations of
    the points in the frame of the base, but not relative to it (K, Q, 3), and energies absorbed (K, A).
    """

    stroke: FloatArray
    force: FloatArray
    acceleration: FloatArray
    absorbed: FloatArray


class _Springs:
    """Paper eqs. (8)-(11) of all axes at once; outside the range FE is continued along its tangent and FA is held."""

    def __init__(self, parameters: Sequence[SpringParameters]) -> None:
        rows = {name: [getattr(p, name) for p in parameters] for name in ("kE", "kA")}
        self.kE, self.kA = (np.array([(*c, *[0.0] * (8 - len(c))) for c in each]).T for each in rows.values())
        self.kappa, self.rho, self.sigma, self.n, self.offset, self.low, self.high = (
            np.array([getattr(p, name) for p in parameters])
            for name in ("kappa_omega", "rho", "sigma", "n", "displacement_offset", "x_min", "x_max")
        )

    def force(self, position: FloatArray, omega: FloatArray) -> FloatArray:
        x = position - self.offset
        inside = np.clip(x, self.low, self.high)
        slope = polyval(inside, polyder(self.kE), tensor=False)
        elastic = polyval(inside, self.kE, tensor=False) + slope * (x - inside)
        return np.asarray(elastic + self.kappa * omega * polyval(inside, self.kA, tensor=False))

    def omega_rate(self, rate: FloatArray, omega: FloatArray, together: Sequence[slice]) -> FloatArray:
        """Eq. (11); for axes that act `together` s - |omega|^(n - 2)*omega*[sigma*sum(|s*omega|) +
        (1 - sigma)*sum(s*omega)] with s = rho*x': Park, Wen and Ang (1986) for n = 2 and sigma = 1/2.
        """
        slip = self.rho * rate
        if not together:
            weight = self.sigma * np.sign(rate) * np.sign(omega) - self.sigma + 1.0
            return np.asarray(slip * (1.0 - weight * np.minimum(np.abs(omega), 1.0) ** self.n))
        result = slip.copy()
        for own in together:
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
        self.system, self.case = system, case
        self.gravity = np.array(system.gravity)
        axes, mounts, n = system.axes, system.axis_mounts, len(system.bodies)
        springs = [axis.spring for axis in axes]
        self.first = _Springs(springs)
        self.second = _Springs([replace(p.mechanisms[-1], kE=(0.0,)) for p in springs])
        self.second.kappa = self.second.kappa * [p.second is not None for p in springs]
        branches = [
            [*((b.stiffness, 1.0 / b.time_constant) for b in p.branches), *[(0.0, 0.0)] * 3][:3] for p in springs
        ]
        self.branch, self.decay = np.array(branches).T
        firsts = np.cumsum([0, *(len(mount.axes) for mount in system.mounts)]).tolist()
        self.together = [slice(*ends) for ends in pairwise(firsts)] if system.coupled else []
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
        self.moves, self.turns = np.array([_freedom(b.motion, np.array(b.direction)) for b in system.bodies]).swapaxes(
            0, 1
        )
        self.mobility = np.linalg.pinv(self.turns @ self.inertia @ self.turns)

    def parts(self, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What moves of the bodies and of the base, shape (N + 1, 13), their orientations, and the rows of the axes."""
        n = self.mass.size
        moving = np.zeros((n + 1, 13))
        moving[:n], moving[n, 6:10] = z[: 13 * n].reshape(n, 13), z[13 * n : 13 * n + 4]
        return moving, _matrices(moving[:, 6:10]), z[13 * n + 4 :].reshape(6, -1)

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
        turning = _quaternion_rates(moving[:, 6:10], W)
        of_axes = [
            self.first.omega_rate(slip, omega, self.together), held * rate,
            self.second.omega_rate(slip, second, self.together), *(slip - elongations * self.decay),
        ]  # fmt: skip
        of_bodies = np.hstack([v[:-1], linear, turning[:-1], angular])
        return np.concatenate([of_bodies.ravel(), turning[-1], *of_axes]), linear, angular, d, f, base


def _freedom(motion: MotionKind, n: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Projections of translations and rotations."""
    one, along = np.eye(3), np.outer(n, n)
    return {
        MotionKind.SIX: (one, one), MotionKind.PLANE: (one - along, along), MotionKind.AXIS: (along, 0.0 * one)
    }[motion]  # fmt: skip


def _turned(R: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray((R @ vectors[..., None])[..., 0])


def _matrices(quaternions: FloatArray) -> FloatArray:
    """Of quaternions of any length, scalar last, shape (K, 4): 1 + 2 s [q x] + 2 [q x][q x] for those of length 1."""
    unit = quaternions / np.linalg.norm(quaternions, axis=1)[:, None]
    skew = np.cross(unit[:, None, :3], np.eye(3)).swapaxes(1, 2)
    return np.eye(3) + 2.0 * unit[:, 3, None, None] * skew + 2.0 * skew @ skew


def _quaternion_rates(q: FloatArray, W: FloatArray) -> FloatArray:
    """q*(W, 0)/2, scalar last, with W in the frame that turns."""
    vector, scalar = q[:, :3], q[:, 3:]
    return 0.5 * np.hstack([scalar * W + np.cross(vector, W), -(vector * W).sum(axis=1, keepdims=True)])


def rest_of(system: MountedSystem, case: LoadCase, omega: float) -> FloatArray:
    """State in equilibrium with this omega of all axes, without what drives the case but with its velocity."""
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
    """Solve for rising `times` from 0 on; the signals of the case must be of the class `Course`."""
    equations, z = _Equations(system, case), rest_of(system, case, omega)
    corners = {corner for channel in case.channels for corner in channel.signal.corners if 0.0 < corner < times[-1]}
    rows: list[FloatArray] = []
    now = 0.0
    for end in (*sorted(corners), float(times[-1])):
        asked = times[len(rows) :][times[len(rows) :] <= end]
        run = solve_ivp(
            lambda t, z: equations.solved(t, z)[0], (now, end), z, "LSODA", np.union1d(asked, end), rtol=rtol,
            atol=1e-3 * rtol, max_step=1e-3,
        )  # fmt: skip
        assert run.success, run.message
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
