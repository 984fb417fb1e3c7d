"""Everything unknown of a load case, drawn at once.

Each draw has an omega of +-1 at rest for every axis of a mount, springs drawn from the uncertainty of their model files
and from the scatter of mounts, and of random vibration a realisation of its own. The ends +-1 are drawn since the
figures are widest there. The first two draws have all springs loaded and unloaded in the sense of their static forces.

Of K values of a figure the range is from the least to the largest, and at least from mean - k*s to mean + k*s of their
standard deviation s. For normal values k is that of the tolerance interval which holds 95 % of all draws on either side
with 99 % confidence; the extremes cover values that are skewed. With few axes all combinations are run instead, if
nothing else is unknown: the range is then that of the combinations.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from ...errors import ModelError, MountedSystemError
from ...kernel.arrays import FloatArray
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.rest import RestPose, rest
from ..bodies.simulation import CaseRun, CheckedRun, run_case, within
from ..bodies.solving import solver
from ..bodies.stable_step import largest_stable_step
from .drawn_springs import Drawn

DRAWS, LEAST_DRAWS = 48, 16
CONTENT, CONFIDENCE = 0.95, 0.99  # of the range of a figure
_TOLERANCE = 3e-3  # numerical error of draws, relative to the largest of its kind
_OF_STABLE = 0.5  # step of draws
_RANDOM_SHARE = 3  # of the draws one in so many is made of random vibration, which lasts long


@dataclass(frozen=True, eq=False)
class DrawnRun:
    """A draw that was simulated, with its system and its load case."""

    system: MountedSystem
    case: LoadCase
    run: CaseRun


@dataclass(frozen=True)
class Unknowns:
    """What is drawn.

    Parameters
    ----------
    springs : Drawn
    draws, seed : int
    rest_omega : float or None   Of all springs at rest, in the sense of their static force; None if unknown.
    """

    springs: Drawn = field(default_factory=lambda: Drawn({}, ()))
    draws: int = DRAWS
    seed: int = 0
    rest_omega: float | None = None

    @property
    def share(self) -> float:
        """Of saturation at rest in the nominal run."""
        return self.rest_omega or 0.0

    def is_exhaustive(self, system: MountedSystem, case: LoadCase) -> bool:
        """Whether all that can be is run, and not a sample of it."""
        return self._combinations(system) <= self.draws and not (self.springs.has_any(system) or case.is_random)

    def count(self, system: MountedSystem, case: LoadCase | None = None) -> int:
        """How many draws there are of a load case, or of static equilibria alone."""
        if case is not None and case.is_random:
            return max(LEAST_DRAWS, self.draws // _RANDOM_SHARE)
        if self.springs.has_any(system):
            return self.draws
        return 0 if self.rest_omega is not None else min(self.draws, self._combinations(system))

    def rest(self, system: MountedSystem, number: int, weightless: bool = False) -> RestPose:
        """The static equilibrium of a draw of a drawn system."""
        kernel = solver(system)
        if self.rest_omega is not None:
            return rest(system, self.rest_omega, weightless, kernel)
        combinations = self._combinations(system)
        if combinations <= self.draws:
            signs = (number % combinations) >> np.arange(kernel.axes) & 1
        elif number < 2:
            return rest(system, 1.0 - 2.0 * number, weightless, kernel)
        else:
            signs = np.random.default_rng((self.seed, number)).integers(0, 2, kernel.axes)
        return rest(system, 0.0, weightless, kernel, np.asarray(2.0 * signs - 1.0))

    def run(self, system: MountedSystem, case: LoadCase, step: float, number: int) -> DrawnRun:
        """A draw.

        Raises
        ------
        ModelError           If hardly any draw of a spring is physically possible.
        MountedSystemError   If it cannot be simulated.
        """
        drawn, realisation = self.springs.system(system, self.seed, number), case.redrawn(number)
        start = self.rest(drawn, number, case.weightless)
        return DrawnRun(drawn, realisation, run_case(drawn, realisation, start, step))

    def poses(self, system: MountedSystem) -> list[RestPose]:
        """Static equilibria of the draws that can rest."""
        poses = []
        for number in range(self.count(system)):
            with suppress(ModelError, MountedSystemError):
                poses.append(self.rest(self.springs.system(system, self.seed, number), number))
        return poses

    def _combinations(self, system: MountedSystem) -> int:
        """Of omega at rest."""
        return 2 ** sum(1 for _ in system.axes()) if self.rest_omega is None else 1


@dataclass(frozen=True, eq=False)
class Draws:
    """The draws of a load case.

    Attributes
    ----------
    runs : tuple of DrawnRun
    nominal : CheckedRun       The nominal run with the step of the draws, and its numerical errors.
    refused : int              Draws that could not be simulated.
    reason : str               Why, most often.
    """

    runs: tuple[DrawnRun, ...]
    nominal: CheckedRun
    refused: int
    reason: str

    @property
    def count(self) -> int:
        """How many were asked for."""
        return len(self.runs) + self.refused


def drawn_case(system: MountedSystem, case: LoadCase, nominal: CheckedRun, unknowns: Unknowns, given: bool) -> Draws:
    """All draws of a load case.

    Parameters
    ----------
    system : MountedSystem
    case : LoadCase
    nominal : CheckedRun
    unknowns : Unknowns
    given : bool             Whether the step of the nominal run was asked for; it is that of the draws then.
    """
    coarse = nominal if given else _coarsened(system, case, nominal)
    runs, refusals = [], []
    for number in range(unknowns.count(system, case)):
        try:
            runs.append(unknowns.run(system, case, coarse.step, number))
        except (ModelError, MountedSystemError) as problem:
            refusals.append(str(problem))
    reason = Counter(refusals).most_common(1)[0][0] if refusals else ""
    return Draws(tuple(runs), coarse, len(refusals), reason)


def _coarsened(system: MountedSystem, case: LoadCase, nominal: CheckedRun) -> CheckedRun:
    """The nominal run with the largest step of 2, 4, 8... times its own whose errors are within the tolerance."""
    chosen, stable = nominal, largest_stable_step(system, nominal.start.pose)
    while 2.0 * chosen.step <= _OF_STABLE * stable:
        try:
            longer = run_case(system, case, nominal.start, 2.0 * chosen.step)
        except MountedSystemError:
            break
        changes = longer.figures.combined(nominal.figures, lambda new, old: np.abs(new - old))
        errors = changes.combined(nominal.errors, np.add)
        if not within(nominal.figures, errors, _TOLERANCE):
            break
        chosen = CheckedRun(longer.start, longer.step, longer.figures, longer.energies, errors)
    return chosen


def ranges(values: FloatArray, is_exhaustive: bool) -> tuple[FloatArray, FloatArray]:
    """The range of each figure from its values in all draws, shape (K, N), each of shape (N,)."""
    low, high = values.min(axis=0), values.max(axis=0)
    if is_exhaustive or len(values) < 2:
        return low, high
    reach = tolerance_factor(len(values)) * values.std(axis=0, ddof=1)
    mean = values.mean(axis=0)
    return np.minimum(low, mean - reach), np.maximum(high, mean + reach)


def tolerance_factor(count: int) -> float:
    """k of the one-sided tolerance interval of a normal sample (Owen 1963, by the noncentral t distribution)."""
    from scipy.stats import nct, norm  # the start of programs that draw nothing does not wait for it

    root = math.sqrt(count)
    return float(nct.ppf(CONFIDENCE, count - 1, root * norm.ppf(CONTENT)) / root)


def shares_beyond(values: FloatArray, limits: Sequence[float | None]) -> list[float | None]:
    """Of each figure the share of its values beyond its limit; None where there is none."""
    return [
        None if limit is None or not len(values) else float(np.mean(of_figure > limit))
        for of_figure, limit in zip(values.T, limits, strict=True)
    ]
