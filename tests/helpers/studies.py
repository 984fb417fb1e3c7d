"""A study of cheap runs for the tests, and what counts them."""

from __future__ import annotations

from collections.abc import Callable

from strandspring.campaigns.studies.definition import Study
from strandspring.model.spread import Spread
from strandspring.vibration.one_mass.system import Excitation
from synthetic import spring_of

SPRING = spring_of(1.0, 1.0)
ERRORS = {
    "kappa_omega": 0.04 * SPRING.kappa_omega,
    "rho": 0.1 * SPRING.rho,
    "sigma": 0.08 * SPRING.sigma,
    "n": 0.06 * SPRING.n,
}
CORRELATION = {"kappa_omega,rho": -0.6, "rho,n": 0.3, "sigma,n": 0.7}
UNCERTAINTY = {**ERRORS, "correlation": CORRELATION}
SPREAD = Spread.of(SPRING, UNCERTAINTY)
# Runs of some 10 ms each below resonance; the last mass is more than the spring can carry.
CHEAP = Study(
    SPRING,
    Excitation.BASE_DISPLACEMENT,
    masses=(4.0, 5.0, 400.0),
    levels=(1e-4,),
    draws=20,
    seed=7,
    spread=SPREAD,
    band=(2.0, 2.5),
    points=2,
)
COMMAND = [
    "study", "mount.json", "--mass", "4", "--mass", "5", "--mass", "400", "--base-displacement", "0.1",
    "--draws", "20", "--seed", "7", "--band", "2", "2.5", "--points", "2", "--zero", "rig",
]  # fmt: skip


class Counter:
    """How many runs were finished at first and in the end; does something once so many are."""

    def __init__(self, after: int = 0, act: Callable[[], object] | None = None) -> None:
        self.first: int | None = None
        self.last = 0
        self._after, self._act = after, act

    def __call__(self, runs: int) -> None:
        self.first = runs if self.first is None else self.first
        self.last = runs
        if self._act is not None and runs >= self._after:
            act, self._act = self._act, None
            act()
