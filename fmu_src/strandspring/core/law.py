"""What the functions of force and work need of one spring, prepared once."""

from __future__ import annotations

from functools import cached_property, lru_cache

from .parameters import SpringParameters
from .pieces import Pieces, falling_pieces, rising_pieces
from .polynomials import derivative
from .saturation import Saturation
from .spline import Elastic

# They take some 15 ms to build, and the pieces as long again.
_table_of = lru_cache(maxsize=16)(Saturation)
_rising_of = lru_cache(maxsize=16)(rising_pieces)
_falling_of = lru_cache(maxsize=16)(falling_pieces)


class SpringLaw:
    """FE and FA with their derivatives, and the tables of W of one spring.

    Springs with the same n and sigma share the tables.

    Parameters
    ----------
    parameters : SpringParameters

    Attributes
    ----------
    elastic : Elastic            FE of paper eq. (9), or of a table.
    FA : tuple of float          Coefficients of paper eq. (8) by ascending powers of x.
    x_min, x_max : float         The identified range of x [m].
    """

    def __init__(self, parameters: SpringParameters) -> None:
        p = parameters
        if not p.is_plain:
            raise ValueError("`parameters` must be without a second mechanism and branches here.")
        self.parameters = p
        self.elastic = Elastic(p)
        self.FA = p.kA
        self.dFA = derivative(p.kA)
        self.x_min = p.x_min
        self.x_max = p.x_max
        self.table = _table_of(p.n, p.sigma)

    def inside(self, x: float) -> float:
        """The point of the identified range that is nearest to x [m]."""
        return min(max(x, self.x_min), self.x_max)

    @cached_property
    def rising(self) -> Pieces:
        """The branch W >= 0 for integrals of W; made where energy is first asked for."""
        return _rising_of(self.table)

    @cached_property
    def falling(self) -> Pieces:
        """The branch W < 0 for integrals of |W|."""
        return _falling_of(self.table)
