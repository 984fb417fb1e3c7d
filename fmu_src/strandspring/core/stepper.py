"""The spring one step at a time: the memory that is committed and the response to a trial displacement.

The memory keeps where the present stroke began and xi there, not omega: while the direction holds,
xi = start_xi + rho*|displacement - start|, so that cutting a stroke into any steps gives the same bits as one
step. Only a reversal needs the inverse of W.
"""

from __future__ import annotations

from typing import NamedTuple

from .law import SpringLaw
from .restoring import restoring_force, tangent_stiffness
from .saturation import saturation, stroke_start
from .work import elastic_work, hysteretic_work


class Memory(NamedTuple):
    """What the spring remembers of its path; plain numbers, so that it can be serialized.

    Attributes
    ----------
    displacement : float   Where the path ends [m].
    omega : float          Normalized hysteretic variable there [-].
    direction : int        +1 loading, -1 unloading, 0 before the first motion.
    start, start_xi : float   Displacement [m] at which the stroke began, and xi there [-].
    settled, energy : float   Energy absorbed [J] since the beginning up to the displacement `settled` [m]
                              of this stroke; the rest is integrated when asked for.
    """

    displacement: float
    omega: float
    direction: int
    start: float
    start_xi: float
    settled: float
    energy: float


def rest(displacement: float, omega: float) -> Memory:
    """The memory at the start of a path."""
    return Memory(displacement, omega, 0, displacement, 0.0, displacement, 0.0)


def advance(law: SpringLaw, memory: Memory, displacement: float) -> Memory:
    """The memory after a straight path to `displacement` [m]; `memory` itself is left as it was."""
    travel = displacement - memory.displacement
    if travel == 0.0:
        return memory
    direction = 1 if travel > 0.0 else -1
    start, start_xi, settled, energy = memory.start, memory.start_xi, memory.settled, memory.energy
    if direction != memory.direction:
        start = memory.displacement
        start_xi = stroke_start(law.table, direction * memory.omega)
        settled, energy = start, absorbed_energy(law, memory)
    # Paper eq. (22) in closed form.
    omega = direction * saturation(law.table, start_xi + law.parameters.rho * abs(displacement - start))
    return Memory(displacement, omega, direction, start, start_xi, settled, energy)


def force(law: SpringLaw, memory: Memory) -> float:
    """Restoring force [N] where the path ends."""
    x = memory.displacement - law.parameters.displacement_offset
    return float(restoring_force(law, x, memory.omega))


def stiffness(law: SpringLaw, memory: Memory) -> float:
    """Tangent stiffness [N/m] in the direction of the last motion, of loading before the first one."""
    x = memory.displacement - law.parameters.displacement_offset
    return float(tangent_stiffness(law, x, memory.omega, memory.direction or 1))


def absorbed_energy(law: SpringLaw, memory: Memory) -> float:
    """Integral of the force over the displacement since the beginning of the path [J]."""
    p = law.parameters
    before, now = memory.settled - p.displacement_offset, memory.displacement - p.displacement_offset
    if before == now:
        return memory.energy
    elastic = elastic_work(law, now) - elastic_work(law, before)
    start = memory.start - p.displacement_offset
    x_at_zero = start - memory.direction * memory.start_xi / p.rho
    low, high = (memory.start_xi + p.rho * abs(x - start) for x in (before, now))
    return float(memory.energy + elastic + hysteretic_work(law, memory.direction, x_at_zero, low, high))


def settle(law: SpringLaw, memory: Memory) -> Memory:
    """The same memory with its energy integrated up to now, so that asking again costs little."""
    return memory._replace(settled=memory.displacement, energy=absorbed_energy(law, memory))
