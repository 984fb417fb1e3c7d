"""The linear mechanical system that springs are attached to, and its exact solution over a step.

With q the generalized coordinates, and for each spring j a direction g_j, its displacement and the equations of motion
are

    d_j = offset_j + g_j.q - base_j(t),
    M q'' + C q' + K q = load(t) - sum_j count_j*g_j*F_j(d_j).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from ..kernel.arrays import FloatArray
from .fmu_spring import CosimulationError


def fixed_base(_: float) -> float:
    """Displacement of a base that does not move."""
    return 0.0


@dataclass(frozen=True, eq=False)
class Attachment:
    """How a spring is attached to the plant.

    Parameters
    ----------
    direction : array_like, shape (N,)   g: derivative of the spring's displacement by q.
    offset : float                       Displacement where q and the base are zero [m].
    base : callable                      Displacement of the other end [m] at a time [s].
    count : int                          Number of equal springs with this displacement, simulated as one.
    """

    direction: ArrayLike
    offset: float = 0.0
    base: Callable[[float], float] = fixed_base
    count: int = 1


@dataclass(frozen=True, eq=False)
class Plant:
    """A linear mechanical system with springs attached.

    Parameters
    ----------
    mass : array_like, shape (N, N)        M, symmetric and positive definite.
    attachments : sequence of Attachment   One for each spring, J of them.
    load : callable or None                Generalized forces, shape (N,), at a time [s]; none by default.
    damping, stiffness : array_like or None, shape (N, N)   C and K, zero by default.

    Raises
    ------
    CosimulationError   If a shape is wrong, or the mass matrix is not positive definite.
    """

    mass: ArrayLike
    attachments: Sequence[Attachment]
    load: Callable[[float], ArrayLike] | None = None
    damping: ArrayLike | None = None
    stiffness: ArrayLike | None = None
    M: FloatArray = field(init=False)
    inverse_mass: FloatArray = field(init=False)
    C: FloatArray = field(init=False)
    K: FloatArray = field(init=False)
    G: FloatArray = field(init=False)
    counts: FloatArray = field(init=False)
    offsets: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        M = np.atleast_2d(np.asarray(self.mass, dtype=np.float64))
        size = len(M)
        matrices = {"mass": M}
        for name in ("damping", "stiffness"):
            matrix = getattr(self, name)
            matrices[name] = np.zeros_like(M) if matrix is None else np.atleast_2d(np.asarray(matrix, dtype=np.float64))
        for name, matrix in matrices.items():
            if matrix.shape != (size, size):
                raise CosimulationError(f"`{name}` must be a square matrix of {size} rows, got shape {matrix.shape}.")
            if not np.isfinite(matrix).all():
                raise CosimulationError(f"`{name}` must be finite, got {matrix.tolist()!r}.")
        if not (np.array_equal(M, M.T) and np.linalg.eigvalsh(M)[0] > 0.0):
            raise CosimulationError(f"`mass` must be symmetric and positive definite, got {M.tolist()!r}.")
        directions = [np.atleast_1d(np.asarray(spring.direction, dtype=np.float64)) for spring in self.attachments]
        for index, direction in enumerate(directions):
            if direction.shape != (size,):
                raise CosimulationError(
                    f"`direction` of attachment {index} must have {size} entries, got shape {direction.shape}."
                )
        set_field = object.__setattr__
        set_field(self, "M", M)
        set_field(self, "inverse_mass", np.linalg.inv(M))
        set_field(self, "C", matrices["damping"])
        set_field(self, "K", matrices["stiffness"])
        set_field(self, "G", np.array(directions).reshape(-1, size).T)
        set_field(self, "counts", np.array([spring.count for spring in self.attachments], dtype=np.float64))
        set_field(self, "offsets", np.array([spring.offset for spring in self.attachments], dtype=np.float64))

    @property
    def coordinates(self) -> int:
        """Number of coordinates, N."""
        return len(self.M)

    def load_at(self, time: float) -> FloatArray:
        """Generalized forces of the load, shape (N,)."""
        if self.load is None:
            return np.zeros(self.coordinates)
        return np.atleast_1d(np.asarray(self.load(time), dtype=np.float64))

    def base_displacements(self, time: float) -> FloatArray:
        """Displacements of the springs' other ends, shape (J,) [m]."""
        return np.array([spring.base(time) for spring in self.attachments])

    def displacements(self, time: float, q: FloatArray) -> FloatArray:
        """Displacements of the springs, shape (J,) [m]."""
        return self.offsets + self.G.T @ q - self.base_displacements(time)

    def generalized_force(self, forces: FloatArray) -> FloatArray:
        """Generalized forces on the plant of spring forces of shape (J,), shape (N,)."""
        return -self.G @ (self.counts * forces)

    def acceleration(self, time: float, q: FloatArray, velocity: FloatArray, forces: FloatArray) -> FloatArray:
        """q'', shape (N,), from the equations of motion."""
        total = self.load_at(time) + self.generalized_force(forces) - self.C @ velocity - self.K @ q
        return np.asarray(self.inverse_mass @ total)


def one_mass(
    mass: float,
    load: Callable[[float], float] | float = 0.0,
    base: Callable[[float], float] = fixed_base,
    *,
    offset: float = 0.0,
    damping: float = 0.0,
    parallel: int = 1,
    series: int = 1,
) -> Plant:
    """One mass on a mount of equal springs: m*q'' + c*q' + P*F(offset + (q - base)/S) = load.

    Parameters
    ----------
    mass : float                 [kg].
    load : callable or float     [N], in the positive direction of the spring force.
    base : callable              Displacement of the base [m].
    offset : float               Displacement of each spring where q and the base are zero [m].
    damping : float              Viscous, between the mass and the frame of q [N s/m].
    parallel, series : int       P parallel rows of S springs each.

    Raises
    ------
    CosimulationError            If the mass is not positive, or a number of springs is below 1.
    """
    for name, count in (("parallel", parallel), ("series", series)):
        if count < 1:
            raise CosimulationError(f"`{name}` must be >= 1, got {count!r}.")
    load_at = load if callable(load) else lambda _, constant=load: constant
    spring = Attachment([1.0 / series], offset, lambda t: base(t) / series, parallel * series)
    return Plant([[mass]], [spring], lambda t: [load_at(t)], [[damping]])


class LinearFlow:
    """Exact solution over a step of the plant without springs, for generalized forces quadratic in time.

    Parameters
    ----------
    plant : Plant
    step : float   [s].
    """

    def __init__(self, plant: Plant, step: float) -> None:
        n = plant.coordinates
        # x = [q, q'], and u with its derivatives by s = tau/step: x' = A x + B u, u' = u_1 + 2 u_2 s, u'' = 2 u_2.
        block = np.zeros((5 * n, 5 * n))
        block[:n, n : 2 * n] = step * np.eye(n)
        block[n : 2 * n, :n] = -step * plant.inverse_mass @ plant.K
        block[n : 2 * n, n : 2 * n] = -step * plant.inverse_mass @ plant.C
        block[n : 2 * n, 2 * n : 3 * n] = step * plant.inverse_mass
        block[2 * n : 3 * n, 3 * n : 4 * n] = np.eye(n)
        block[3 * n : 4 * n, 4 * n :] = np.eye(n)
        self._map = expm(block)[: 2 * n]
        self._size = n

    def advance(self, q: FloatArray, velocity: FloatArray, generalized: FloatArray) -> tuple[FloatArray, FloatArray]:
        """q and q' at the end of the step, for forces u_0 + u_1*s + u_2*s^2 of shape (3, N), 0 <= s <= 1."""
        constant, linear, quadratic = generalized
        end = self._map @ np.concatenate([q, velocity, constant, linear, 2.0 * quadratic])
        return end[: self._size], end[self._size :]


def quadratic_load(plant: Plant, time: float, step: float) -> FloatArray:
    """Load over a step as u_0 + u_1*s + u_2*s^2 through its values at both ends and the middle, shape (3, N)."""
    begin, middle, end = (plant.load_at(time + share * step) for share in (0.0, 0.5, 1.0))
    return np.array([begin, 4.0 * middle - 3.0 * begin - end, 2.0 * (begin + end) - 4.0 * middle])
