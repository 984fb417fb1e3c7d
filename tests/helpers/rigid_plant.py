"""The plant of an SSP system, for PythonFMU: a rigid body; forces of springs in, their displacements out.

It knows nothing of the kernel: leapfrog, with a rotation matrix that is turned about the angular velocity in the middle
of a step. It stands still at every odd call and moves by two steps at every even one, so that a tool that steps all
FMUs at once couples as one that steps them in turn: the springs follow while it stands, and their forces belong to
where it is.

BODY follows this text: mass, inertia (about the principal axes, which are those of the frame), gravity, springs (place
and direction of each), point, pulse (peak in each direction, duration), position and rotation at rest.
"""

from __future__ import annotations

import math
from typing import Any

from pythonfmu.enums import Fmi2Causality
from pythonfmu.fmi2slave import Fmi2Slave
from pythonfmu.variables import Real

Vector = list[float]
Matrix = list[Vector]


def cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def times(matrix: Matrix, a: Vector) -> Vector:
    return [sum(m * c for m, c in zip(row, a)) for row in matrix]  # noqa: B905


def transposed(matrix: Matrix) -> Matrix:
    return [list(column) for column in zip(*matrix)]  # noqa: B905


def turned(matrix: Matrix, spin: Vector, time: float) -> Matrix:
    """The matrix after a rotation by spin*time, by Rodrigues' formula."""
    rate = math.sqrt(sum(c * c for c in spin))
    if rate == 0.0:
        return matrix
    axis, angle = [c / rate for c in spin], rate * time
    columns = []
    for column in transposed(matrix):
        along = sum(a * c for a, c in zip(axis, column))  # noqa: B905
        across = cross(axis, column)
        cosine, sine = math.cos(angle), math.sin(angle)
        columns.append([cosine * column[i] + sine * across[i] + (1.0 - cosine) * along * axis[i] for i in range(3)])
    return transposed(columns)


class RigidPlant(Fmi2Slave):
    """One body above a shaken base."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.body = BODY  # noqa: F821
        self.springs = range(len(self.body["springs"]))
        self.calls = 0
        self.position, self.rotation = list(self.body["position"]), [list(row) for row in self.body["rotation"]]
        self.velocity, self.momentum = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        for k in self.springs:
            setattr(self, f"force_{k}", 0.0)
            setattr(self, f"displacement_{k}", 0.0)
        for k in self.springs:
            self.register_variable(Real(f"force_{k}", causality=Fmi2Causality.input))
        for k in self.springs:
            self.register_variable(Real(f"displacement_{k}", causality=Fmi2Causality.output))
        for name in ("sway_x", "sway_y", "sway_z"):
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        self.at_rest = self.place(self.body["point"])
        self.rest = [self.along(k) for k in self.springs]

    def place(self, place: Vector) -> Vector:
        return [x + c for x, c in zip(self.position, times(self.rotation, place))]  # noqa: B905

    def along(self, k: int) -> float:
        place, direction = self.body["springs"][k]
        return sum(e * c for e, c in zip(direction, self.place(place)))  # noqa: B905

    def spin(self, rotation: Matrix) -> Vector:
        own = times(transposed(rotation), self.momentum)
        return times(rotation, [m / j for m, j in zip(own, self.body["inertia"])])  # noqa: B905

    def base_velocity(self, time: float) -> Vector:
        peaks, duration = self.body["pulse"]
        phase = math.pi * min(max(time / duration, 0.0), 1.0)
        return [peak * duration / math.pi * (1.0 - math.cos(phase)) for peak in peaks]

    def do_step(self, _current_time: float, step_size: float) -> bool:
        self.calls += 1
        if self.calls % 2 == 0:
            self.move(2.0 * step_size, (self.calls - 2) * step_size)
        return True

    def move(self, step: float, time: float) -> None:
        force, moment = [self.body["mass"] * g for g in self.body["gravity"]], [0.0, 0.0, 0.0]
        for k in self.springs:
            place, direction = self.body["springs"][k]
            pull = [-getattr(self, f"force_{k}") * e for e in direction]
            about = cross(times(self.rotation, place), pull)
            force = [f + p for f, p in zip(force, pull)]  # noqa: B905
            moment = [m + a for m, a in zip(moment, about)]  # noqa: B905
        before, after = self.base_velocity(time - 0.5 * step), self.base_velocity(time + 0.5 * step)
        for i in range(3):
            self.velocity[i] += step * force[i] / self.body["mass"] - (after[i] - before[i])
            self.position[i] += step * self.velocity[i]
            self.momentum[i] += step * moment[i]
        middle = turned(self.rotation, self.spin(self.rotation), 0.5 * step)
        self.rotation = turned(self.rotation, self.spin(middle), step)
        for k in self.springs:
            setattr(self, f"displacement_{k}", self.along(k) - self.rest[k])
        sway = [now - then for now, then in zip(self.place(self.body["point"]), self.at_rest)]  # noqa: B905
        self.sway_x, self.sway_y, self.sway_z = sway
