"""Reversals below the resolution of a sensor, which friction does not follow.

Friction follows a displacement at most the resolution from the given one. While the motion goes on they are equal.
Behind a turning point that of friction stands until the given one is a resolution away, and then catches up until both
meet at twice the resolution.
"""

from __future__ import annotations

from typing import NamedTuple


class Resolver(NamedTuple):
    """What is remembered of the displacement; plain numbers, so that it can be serialized.

    Attributes
    ----------
    displacement, followed : float   As given last, and where friction is then [m].
    furthest : float                 Of the given displacement in the direction of motion [m].
    turn, at_turn : float            Of the last reversal: the displacement, and where friction was [m].
    direction : int                  Of motion: 0 before the first.
    has_met : bool                   Whether friction has caught up since the last reversal.
    """

    displacement: float
    followed: float
    furthest: float
    turn: float
    at_turn: float
    direction: int
    has_met: bool


def start(displacement: float, direction: int) -> Resolver:
    """At the start of a path, or where friction has caught up in this direction."""
    return Resolver(displacement, displacement, displacement, displacement, displacement, direction, True)


def resolve(at: Resolver, displacement: float, resolution: float) -> Resolver:
    """After straight motion to another displacement [m], with a resolution >= 0 [m]."""
    if resolution == 0.0:
        return start(displacement, at.direction)
    way = displacement - at.furthest
    direction = at.direction or (way > 0.0) - (way < 0.0)
    furthest, turn, at_turn, has_met = at.furthest, at.turn, at.at_turn, at.has_met
    if way * direction >= 0.0:
        furthest = displacement
    elif abs(way) >= resolution:
        turn, at_turn, direction, furthest, has_met = furthest, at.followed, -direction, displacement, False
    share = abs(furthest - turn) / resolution - 1.0
    has_met = has_met or share >= 1.0
    end = turn + 2.0 * resolution * direction
    followed = furthest if has_met else at_turn + max(share, 0.0) * (end - at_turn)
    return Resolver(displacement, followed, furthest, turn, at_turn, direction, has_met)
