"""The figures that knowledge is judged by: energies and stiffnesses of loops, and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...model.joint import HYSTERETIC_UNITS, NORMAL_95, names_of
from .blocks import Range
from .forces import force_along
from .knowledge import Knowledge
from .motion import POINTS, Leg, Motion, Pace

_SETTLING = 12  # cycles before a loop is steady
_LEAST = 0.05  # stiffness that counts as none, share of that of the largest loop
_VISCOUS = 2.5  # power of the amplitude with which energies fall at most
_MINOR = (0.6, -0.6)  # centres
_SMALL, _RATE = 0.3, 0.6  # amplitudes of minor loops, and at other rates
_AMPLITUDES = (1.0, 0.6, _SMALL, 0.1)
# Half of the 95 % interval with which a figure is known well enough, share of its value.
_WANTED, _SMALLEST, _PARAMETERS = 0.05, 0.1, 0.1
ENERGY, STIFFNESS, PARAMETER = "energy", "stiffness", "parameter"


@dataclass(frozen=True)
class Figure:
    """A figure, and how far it should be known.

    Attributes
    ----------
    quantity : str   "energy", "stiffness" or "parameter".
    of : str         The loops, or the name of the parameter.
    wanted : float   Half of the 95 % interval, share of the value.
    """

    quantity: str
    of: str
    wanted: float

    @property
    def name(self) -> str:
        """In words."""
        return self.of if self.quantity == PARAMETER else f"{self.quantity}, {self.of}"


@dataclass(frozen=True, eq=False)
class _Tested:
    name: str
    share: float  # amplitude, of half the range
    motion: Motion


@dataclass(frozen=True, eq=False)
class Loops:
    """Test loops and the figures of them.

    Parameters
    ----------
    span : Range
    pace : Pace
    period : float           Of the largest loop [s].
    speeds : tuple of float  Further velocities over that of the other loops.
    spring : SpringParameters   Any spring of the class.
    """

    span: Range
    pace: Pace
    period: float
    speeds: tuple[float, ...]
    spring: SpringParameters

    @cached_property
    def _parameters(self) -> dict[str, int]:
        """Where the parameters that are positive stand among the spring's own, the first mechanism's first."""
        places = {name[3:]: k for k, name in enumerate(names_of(self.spring)) if name.startswith("ln ")}
        return {name: places[name] for name in HYSTERETIC_UNITS} | places

    @cached_property
    def _tested(self) -> list[_Tested]:
        """The loops, each with its motion, at the end of which it is steady."""
        wanted = [(f"{100.0 * share:.0f} % loops", share, 0.0, 1.0) for share in _AMPLITUDES]
        wanted += [
            (f"{100.0 * _SMALL:.0f} % loops at {100.0 * centre:+.0f} %", _SMALL, centre, 1.0) for centre in _MINOR
        ]
        wanted += [(f"{100.0 * _RATE:.0f} % loops, {pace_of(speed)}", _RATE, 0.0, speed) for speed in self.speeds]
        return [_Tested(name, share, self._motion(share, centre, speed)) for name, share, centre, speed in wanted]

    def _motion(self, share: float, centre: float, speed: float) -> Motion:
        low, high = (self.span.at(centre + side * share) for side in (-1.0, 1.0))
        turns = [self.span.middle, *[high, low] * _SETTLING, high]
        legs: list[Leg] = [self.pace.times(speed).leg(*pair) for pair in pairwise(turns)]
        return Motion.along(legs, self.pace.limits.step)

    @cached_property
    def figures(self) -> tuple[Figure, ...]:
        """All figures: energies of the loops, their stiffnesses, and the parameters of the hysteresis."""
        return (
            *(Figure(ENERGY, tested.name, _SMALLEST if tested.share < _SMALL else _WANTED) for tested in self._tested),
            *(Figure(STIFFNESS, tested.name, _WANTED) for tested in self._tested),
            *(Figure(PARAMETER, name, _PARAMETERS) for name in self._parameters),
        )

    def gradients(self, spring: SpringParameters) -> tuple[FloatArray, FloatArray]:
        """Relative derivatives of the figures of loops by all coefficients, and of the parameters by the own ones.

        An energy counts at least as that which a viscous force would have at the amplitude, and a stiffness as a
        small share of that of the largest loop.
        """
        energies, stiffnesses = [], []
        largest = None
        for tested in self._tested:
            force = force_along(spring, tested.motion, self.span, self.period)
            last = slice(-2 * POINTS - 1, None)
            columns = np.column_stack([force.value, force.own, force.wider])[last]
            energy = np.asarray(np.trapezoid(columns, tested.motion.displacement[last], axis=0))
            # The last point is the upper end, and the lower one a leg before.
            stiffness = (columns[-1] - columns[-POINTS - 1]) / (2.0 * tested.share * self.span.half)
            if largest is None:
                largest = abs(energy[0]), abs(stiffness[0])
            energies.append(energy[1:] / max(abs(energy[0]), largest[0] * tested.share**_VISCOUS))
            stiffnesses.append(stiffness[1:] / max(abs(stiffness[0]), _LEAST * largest[1]))
        return np.array(energies + stiffnesses), np.eye(force.own.shape[1])[list(self._parameters.values())]

    def intervals(self, known: Sequence[Knowledge], gradients: Sequence[tuple[FloatArray, FloatArray]]) -> FloatArray:
        """Half of the 95 % interval of each figure over its value, rms over the springs, shape (F,)."""
        squares = [
            np.concatenate(knowledge.deviations(*derivatives)) ** 2
            for knowledge, derivatives in zip(known, gradients, strict=True)
        ]
        return np.asarray(NORMAL_95 * np.sqrt(np.mean(squares, axis=0)))


def pace_of(speed: float) -> str:
    """Whether loops at a velocity over that of others are slow or fast."""
    return "fast" if speed > 1.0 else "slow"
