"""A whole spring one step at a time: one or two friction mechanisms and Maxwell branches, with the verbs of `stepper`.

The elongation s of a branch's spring changes by ds/dt = dx/dt - s/tau. Over a step of duration h in which x moves by d
at constant velocity, with q = h/tau,

    s after = rest*s + mean*d,   rest = e^-q,   mean = (1 - e^-q)/q,

and its force c*s does the work c*d*(mean*s + ramp*d), ramp = (q - 1 + e^-q)/q^2. A jump is a step with h = 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from . import resolution, stepper
from .law import SpringLaw
from .parameters import SpringParameters
from .resolution import Resolver
from .stepper import Memory

_SMALL_DECAY, _TERMS = 0.34, 14  # of q, below which the series of ramp has so many terms


class WholeMemory(NamedTuple):
    """What a whole spring remembers of its path.

    Attributes
    ----------
    mechanisms : tuple of Memory     Of one or two, all where friction is.
    elongations : tuple of float     Of the branches' springs [m].
    work : float                     Absorbed by the branches since the beginning [J].
    at : Resolver                    Where the path ends and, with a resolution of the input, the friction.
    """

    mechanisms: tuple[Memory, ...]
    elongations: tuple[float, ...]
    work: float
    at: Resolver


class WholeLaw:
    """The laws of the mechanisms of a spring, and its branches.

    Parameters
    ----------
    parameters : SpringParameters
    """

    def __init__(self, parameters: SpringParameters) -> None:
        self.mechanisms = tuple(map(SpringLaw, parameters.mechanisms))
        self.branches = parameters.branches


def start(displacement: float, omegas: Sequence[float], branches: int) -> WholeMemory:
    """The memory at the start of a path, with an omega for each mechanism; the branches have no force."""
    mechanisms = tuple(stepper.start(displacement, omega) for omega in omegas)
    return WholeMemory(mechanisms, (0.0,) * branches, 0.0, resolution.start(displacement, 0))


def trial(
    law: WholeLaw, memory: WholeMemory, displacement: float, duration: float = 0.0, input_resolution: float = 0.0
) -> WholeMemory:
    """The memory after a straight path to `displacement` [m] in a duration [s]; `memory` is left as it was.

    Friction follows no reversals below a resolution of the input [m].
    """
    travel, work, elongations = displacement - memory.at.displacement, memory.work, []
    at = resolution.resolve(memory.at, displacement, input_resolution)
    for branch, before in zip(law.branches, memory.elongations, strict=True):
        rest, mean, ramp = _decay(duration / branch.time_constant)
        elongations.append(rest * before + mean * travel)
        work += branch.stiffness * travel * (mean * before + ramp * travel)
    pairs = zip(law.mechanisms, memory.mechanisms, strict=True)
    return WholeMemory(tuple(stepper.trial(*pair, at.followed) for pair in pairs), tuple(elongations), work, at)


def force(law: WholeLaw, memory: WholeMemory) -> float:
    """Restoring force [N] where the path ends."""
    of_mechanisms = sum(map(stepper.force, law.mechanisms, _shown(memory)))
    return of_mechanisms + sum(
        branch.stiffness * elongation for branch, elongation in zip(law.branches, memory.elongations, strict=True)
    )


def stiffness(law: WholeLaw, memory: WholeMemory) -> float:
    """Tangent stiffness against sudden motion [N/m] in the direction of the last one, of loading before the first."""
    of_mechanisms = sum(map(stepper.stiffness, law.mechanisms, _shown(memory)))
    return of_mechanisms + sum(branch.stiffness for branch in law.branches)


def absorbed_energy(law: WholeLaw, memory: WholeMemory) -> float:
    """Integral of the force over the displacement since the beginning of the path [J]."""
    return sum(map(stepper.absorbed_energy, law.mechanisms, memory.mechanisms)) + memory.work


def stored_energy(law: WholeLaw, memory: WholeMemory) -> float:
    """The part of it that the branches' springs hold [J]."""
    pairs = zip(law.branches, memory.elongations, strict=True)
    return sum(0.5 * branch.stiffness * elongation * elongation for branch, elongation in pairs)


def integrate(law: WholeLaw, memory: WholeMemory) -> WholeMemory:
    """The same memory with its energy integrated up to now, so that asking again costs little."""
    return memory._replace(mechanisms=tuple(map(stepper.integrate, law.mechanisms, memory.mechanisms)))


def change(before: WholeLaw, after: WholeLaw, memory: WholeMemory) -> WholeMemory:
    """The memory of a path that goes on with other parameters: displacement, omega and elongations stay."""
    changed = map(stepper.change, before.mechanisms, after.mechanisms, memory.mechanisms)
    return memory._replace(mechanisms=tuple(changed))


def caught_up(law: WholeLaw, memory: WholeMemory) -> WholeMemory:
    """The memory after friction has gone to where the path is."""
    memory = trial(law, memory, memory.at.displacement)
    return memory._replace(at=resolution.start(memory.at.displacement, memory.mechanisms[0].direction))


def _shown(memory: WholeMemory) -> list[Memory]:
    """The mechanisms where the path is, with the omega that they have where friction is."""
    return [of_one._replace(displacement=memory.at.displacement) for of_one in memory.mechanisms]


@lru_cache(maxsize=16)  # most hosts take steps of one size
def _decay(q: float) -> tuple[float, float, float]:
    """rest, mean and ramp for q >= 0."""
    if q > _SMALL_DECAY:
        rest = math.exp(-q)
        mean = (1.0 - rest) / q
        return rest, mean, (1.0 - mean) / q
    ramp = 0.0
    for k in range(_TERMS + 1, 1, -1):
        ramp = 1.0 / math.factorial(k) - q * ramp
    mean = 1.0 - q * ramp
    return 1.0 - q * mean, mean, ramp
