"""The spring one step at a time, with the verbs of path-dependent materials.

`trial` gives the memory after a straight path to a displacement and leaves the one before as it was. To commit the
trial is to keep the new memory, to revert is to drop it.

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
    energy_at, energy : float   Energy absorbed [J] since the beginning up to the displacement `energy_at` [m]
                              of this stroke; what follows is integrated when asked for.
    """

    displacement: float
    omega: float
    direction: int
    start: float
    start_xi: float
    energy_at: float
    energy: float


def start(displacement: float, omega: float) -> Memory:
    """The memory at the start of a path."""
    return Memory(displacement, omega, 0, displacement, 0.0, displacement, 0.0)


def trial(law: SpringLaw, memory: Memory, displacement: float) -> Memory:
    """The memory after a straight path to `displacement` [m], finite; `memory` itself is left as it was."""
    travel = displacement - memory.displacement
    if travel == 0.0:
        return memory
    direction = 1 if travel > 0.0 else -1
    if direction != memory.direction:
        memory = _reverse(law, memory, direction)
    # Paper eq. (22) in closed form.
    xi = memory.start_xi + law.parameters.rho * abs(displacement - memory.start)
    return memory._replace(displacement=displacement, omega=direction * saturation(law.table, xi))


def force(law: SpringLaw, memory: Memory) -> float:
    """Restoring force [N] where the path ends."""
    return restoring_force(law, memory.displacement - law.parameters.displacement_offset, memory.omega)


def stiffness(law: SpringLaw, memory: Memory) -> float:
    """Tangent stiffness [N/m] in the direction of the last motion, of loading before the first one."""
    x = memory.displacement - law.parameters.displacement_offset
    return tangent_stiffness(law, x, memory.omega, memory.direction or 1)


def absorbed_energy(law: SpringLaw, memory: Memory) -> float:
    """Integral of the force over the displacement since the beginning of the path [J]."""
    p = law.parameters
    before, now = memory.energy_at - p.displacement_offset, memory.displacement - p.displacement_offset
    if before == now:
        return memory.energy
    elastic = elastic_work(law, now) - elastic_work(law, before)
    origin = memory.start - p.displacement_offset
    x_at_zero = origin - memory.direction * memory.start_xi / p.rho
    low, high = (memory.start_xi + p.rho * abs(x - origin) for x in (before, now))
    return memory.energy + elastic + hysteretic_work(law, memory.direction, x_at_zero, low, high)


def integrate(law: SpringLaw, memory: Memory) -> Memory:
    """The same memory with its energy integrated up to now, so that asking again costs little."""
    return memory._replace(energy_at=memory.displacement, energy=absorbed_energy(law, memory))


def change(before: SpringLaw, after: SpringLaw, memory: Memory) -> Memory:
    """The memory of a path that goes on with other parameters, at the same displacement and with the same omega."""
    memory = integrate(before, memory)
    old, new = before.parameters, after.parameters
    if memory.direction == 0 or (old.rho, old.sigma, old.n) == (new.rho, new.sigma, new.n):
        return memory
    return memory._replace(
        start=memory.displacement, start_xi=stroke_start(after.table, memory.direction * memory.omega)
    )


def _reverse(law: SpringLaw, memory: Memory, direction: int) -> Memory:
    """The memory at the beginning of a stroke in the other direction."""
    return integrate(law, memory)._replace(
        direction=direction,
        start=memory.displacement,
        start_xi=stroke_start(law.table, direction * memory.omega),
    )
