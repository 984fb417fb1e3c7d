"""Everything unknown of a load case, drawn at once.

Each draw has an omega of +-1 at rest for every axis of a mount, springs drawn from the uncertainty of their model files
and from the scatter of mounts, and of random vibration and synthesized shocks a realisation of its own. The ends +-1
are drawn since the figures are widest there. Two draws have all springs loaded and unloaded in the sense of their
static forces. Whether the friction of the axes of one mount acts together, no record along one axis tells: it does in
every third draw, whose omega at rest has any direction in each mount.

Of K values of a figure the range is from the least to the largest, and at least from mean - k*s to mean + k*s of their
standard deviation s. For normal values k is that of the tolerance interval which holds 97.5 % of all draws on either
side with 99 % confidence; the upper end is that of their logarithms where these reach farther, as with sway across the
shock. With few mounts of one axis all combinations are run instead, if nothing else is unknown: the range is then that
of the combinations.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import nctdtrit, ndtri

from ...errors import ModelError, MountedSystemError
from ...kernel.arrays import FloatArray
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.rest import RestPose, rest
from ..bodies.simulation import CaseRun, CheckedRun, run_case, within
from ..options import DRAWS, LEAST_DRAWS
from .drawn_springs import Drawn

CONTENT, CONFIDENCE = 0.975, 0.99  # of either end of the range of a figure
_TOLERANCE, _RANDOM_TOLERANCE = 3e-3, 2e-2  # numerical error of draws, relative to the largest of its kind
_OF_STABLE = 0.5  # step of draws
_ALIKE = 0.1  # the least value over the largest, from which logarithms are taken
_LEAST_GROUPED = 3  # values of which a scatter is known
_WIDE = 3.0  # standard deviation of omega where a mount's is then shortened to a length of 1
_RANDOM_SHARE = 4  # of the draws one in so many is made of random vibration, which lasts long


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

    def is_coupled(self, system: MountedSystem, number: int) -> bool:
        """Whether the friction of the axes of each mount acts together in a draw."""
        return number % 3 == 1 and _has_across(system)

    def is_exhaustive(self, system: MountedSystem, case: LoadCase) -> bool:
        """Whether all that can be is run, and not a sample of it."""
        return self._combinations(system) <= self.draws and not (self.springs.has_any(system) or case.has_realisations)

    def count(self, system: MountedSystem, case: LoadCase | None = None) -> int:
        """How many draws there are of a load case, or of static equilibria alone."""
        if case is not None and case.is_random:
            return max(LEAST_DRAWS, self.draws // _RANDOM_SHARE)
        if self.springs.has_any(system) or (case is not None and case.has_realisations):
            return self.draws
        combinations = self._combinations(system)
        return 0 if combinations == 1 else int(min(self.draws, combinations))

    def rest(self, system: MountedSystem, number: int, weightless: bool = False) -> RestPose:
        """The static equilibrium of a draw of a drawn system."""
        if self.rest_omega is not None:
            return rest(system, self.rest_omega, weightless)
        combinations, axes = self._combinations(system), len(system.axes)
        random = np.random.default_rng((self.seed, number))
        if system.coupled:
            return rest(system, 0.0, weightless, _WIDE * random.standard_normal(axes))
        if combinations <= self.draws:
            signs = (number % int(combinations)) >> np.arange(axes) & 1
        elif number in (0, 2):
            return rest(system, 1.0 - number, weightless)
        else:
            signs = random.integers(0, 2, axes)
        return rest(system, 0.0, weightless, np.asarray(2.0 * signs - 1.0))

    def run(
        self, system: MountedSystem, case: LoadCase, step: float, number: int, ends_at_turns: bool = True
    ) -> DrawnRun:
        """A draw; `ends_at_turns` as of `run_case`.

        Raises
        ------
        ModelError           If hardly any draw of a spring is physically possible.
        MountedSystemError   If it cannot be simulated.
        """
        drawn, realisation = self.springs.system(system, self.seed, number), case.redrawn(self.seed, number)
        drawn = replace(drawn, coupled=self.is_coupled(system, number))
        start = self.rest(drawn, number, case.weightless)
        return DrawnRun(drawn, realisation, run_case(drawn, realisation, start, step, ends_at_turns))

    def poses(self, system: MountedSystem) -> list[RestPose]:
        """Static equilibria of the draws that can rest."""
        poses = []
        for number in range(self.count(system)):
            with suppress(ModelError, MountedSystemError):
                poses.append(self.rest(self.springs.system(system, self.seed, number), number))
        return poses

    def _combinations(self, system: MountedSystem) -> float:
        """Of omega at rest, and of friction that acts together or does not."""
        if self.rest_omega is not None:
            return 2 if _has_across(system) else 1
        return math.inf if _has_across(system) else 2 ** len(system.axes)


def _has_across(system: MountedSystem) -> bool:
    """Whether a mount has several axes."""
    return any(len(mount.axes) > 1 for mount in system.mounts)


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
    # As the run whose errors are those of the draws.
    ends_at_turns = coarse is nominal or not case.is_random
    runs, refusals = [], []
    for number in range(unknowns.count(system, case)):
        try:
            runs.append(unknowns.run(system, case, coarse.step, number, ends_at_turns))
        except (ModelError, MountedSystemError) as problem:
            refusals.append(problem)
    counts = Counter(problem.template for problem in refusals)
    reason = str(max(refusals, key=lambda problem: counts[problem.template], default=""))
    return Draws(tuple(runs), coarse, len(refusals), reason)


def _coarsened(system: MountedSystem, case: LoadCase, nominal: CheckedRun) -> CheckedRun:
    """The nominal run with the largest step of 2, 4, 8... times its own whose errors are within the tolerance.

    Of random vibration such steps do not end where springs turn.
    """
    chosen, tolerance = nominal, _RANDOM_TOLERANCE if case.is_random else _TOLERANCE
    while 2.0 * chosen.step <= _OF_STABLE * nominal.stable:
        try:
            longer = run_case(system, case, nominal.start, 2.0 * chosen.step, not case.is_random)
        except MountedSystemError:
            break
        changes = longer.figures.combined(nominal.figures, lambda new, old: np.abs(new - old))
        errors = changes.combined(nominal.errors, np.add)
        if not within(nominal.figures, errors, tolerance):
            break
        chosen = CheckedRun(longer.start, longer.step, longer.figures, longer.energies, errors, nominal.stable)
    return chosen


def ranges(values: FloatArray, coupled: Sequence[bool], is_exhaustive: bool) -> tuple[FloatArray, FloatArray]:
    """The range of each figure from its values in all draws, shape (K, N), each of shape (N,)."""
    low, high = values.min(axis=0), values.max(axis=0)
    if is_exhaustive or len(values) < _LEAST_GROUPED:
        return low, high
    normal = _tolerated(values, coupled)
    alike = low > _ALIKE * high
    skewed = np.exp(_tolerated(np.log(np.where(alike, values, 1.0)), coupled)[1])
    return np.minimum(low, normal[0]), np.maximum(np.maximum(high, normal[1]), np.where(alike, skewed, 0.0))


def _tolerated(values: FloatArray, coupled: Sequence[bool]) -> tuple[FloatArray, FloatArray]:
    """Ends of the tolerance intervals. Draws with coupled friction and those without have means of their own, and the
    scatter of all about these, or their own where it is larger.
    """
    groups = [group for group in (values[np.array(coupled)], values[~np.array(coupled)]) if len(group)]
    freedom = len(values) - len(groups)
    squares = [((group - group.mean(axis=0)) ** 2).sum(axis=0) for group in groups]
    ends = []
    for group, own in zip(groups, squares, strict=True):
        scatter = np.sqrt(np.maximum(own / max(len(group) - 1, 1), sum(squares) / freedom))
        reach = tolerance_factor(len(group), freedom) * scatter
        ends.append((group.mean(axis=0) - reach, group.mean(axis=0) + reach))
    return np.min(ends, axis=0)[0], np.max(ends, axis=0)[1]


def tolerance_factor(count: int, freedom: int, content: float = CONTENT) -> float:
    """k of the one-sided tolerance interval of a normal sample with a standard deviation of so many degrees of freedom
    (Owen 1963, by the noncentral t distribution).
    """
    root = math.sqrt(count)
    return float(nctdtrit(freedom, root * ndtri(content), CONFIDENCE) / root)
