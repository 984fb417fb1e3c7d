"""The refined method: least squares from the better of the two-stage and the scan's result, with standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any, ClassVar

from .bootstrap import bootstrap
from .linearised import Linearised
from .loops import POINTS_PER_STROKE, join
from .method import Fitted, Method
from .noise import force_noise
from .outcomes import IdentificationError, Outcome
from .polynomials import Basis
from .posterior import posterior
from .prediction_interval import PredictionBand, prediction_interval
from .projection import RHO_BOUNDS, Refinement
from .refinement import Samples, refine
from .scan import scan
from .solution import Solution, cautions_of, is_positive, spring_of
from .steady_part import SteadyRecord
from .two_stage import two_stage
from .uncertainty import is_sigma_uncertain, uncertainty

# A fit whose strokes do not saturate must be better by this than one whose strokes do.
_PREFERENCE = 0.9
# Misfit in standard deviations of the noise up to which the model explains the records.
_EXPLAINED = 1.5
# All samples are used up to this many in a stroke and about this many in all; more are averaged over so fine cells
# that what is lost is far below the noise.
_POINTS_PER_STROKE = 2000
_POINTS = 40_000
_LEAST_STEPS = 100  # of the sampler of the posterior


@dataclass(frozen=True)
class RefinedOptions(Method):
    """Options of the refined method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen by the two-stage start if None.
    robust : bool                  Huber's loss instead of squares, for records with outliers.
    bootstrap : int                Repetitions of a stroke-wise bootstrap for the standard errors; 0 for none.
    seed : int                     Of the bootstrap and the posterior.
    posterior : int                Steps of a Monte Carlo sampler of the posterior; 0 for none. Needs emcee.
    """

    name: ClassVar[str] = "refined"

    robust: bool = False
    bootstrap: int = 0
    seed: int = 0
    posterior: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 <= self.bootstrap <= 10_000:
            raise ValueError(f"`bootstrap` must be within [0, 10000] repetitions, got {self.bootstrap}.")
        if self.posterior and not _LEAST_STEPS <= self.posterior <= 1_000_000:
            raise ValueError(f"`posterior` must be 0 or within [{_LEAST_STEPS}, 1000000] steps, got {self.posterior}.")
        if self.posterior and find_spec("emcee") is None:
            raise ValueError("`posterior` needs the package emcee; install it: pip install strandspring[posterior]")
        if self.seed < 0:
            raise ValueError(f"`seed` must be >= 0, got {self.seed}.")

    @property
    def withstands_outliers(self) -> bool:
        """Whether isolated outliers hardly change the fit."""
        return self.robust

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Identify by the better of two-stage and scan, and refine the result on all samples.

        Raises
        ------
        IdentificationError   If no model is physically possible.
        """
        samples = _samples(parts)
        loops = samples.loops
        best = self._best(parts, samples, where)
        refinement, basis = best.refinement, best.basis
        cautions = [Outcome.AMPLIFIER_REDUCED] if basis != best.start.basis else []
        if refinement.hysteresis.rho * loops.length.max() < 1.01 * RHO_BOUNDS[0]:
            cautions.append(Outcome.NO_STEADY_SECTION)
        if not refinement.converged:
            cautions.append(Outcome.NOT_CONVERGED)
        cautions += cautions_of(loops, refinement.hysteresis, refinement.omega)
        linear = Linearised.of(loops, basis, refinement)
        errors, interval = uncertainty(linear), prediction_interval(samples, linear)
        content: dict[str, Any] = {
            **errors.as_json(),
            "prediction_interval": interval.as_json(),
            "indistinct": errors.indistinct(refinement),
        }
        if self.bootstrap:
            spread = bootstrap(loops, basis, refinement, best.start.hysteresis, self.bootstrap, self.seed, where)
            content["bootstrap"] = {"repetitions": self.bootstrap, "seed": self.seed, **spread}
        if self.posterior:
            content["posterior"] = posterior(linear, self.posterior, self.seed)
        if content["indistinct"]:
            cautions.append(Outcome.INDISTINCT)
        if is_sigma_uncertain(loops, basis, refinement):
            cautions.append(Outcome.SIGMA_AT_BOUND)
        return Fitted(
            spring_of(basis, refinement.backbone, refinement.hysteresis),
            tuple(cautions),
            best.start.steady_share,
            tuple(refinement.omega_start.tolist()),
            content,
            PredictionBand.of(linear, interval),
        )

    def _best(self, parts: Sequence[SteadyRecord], samples: Samples, where: str) -> _Candidate:
        """The better refinement of two starts; the scan is tried where the residuals of the first exceed the noise."""
        coarse = join([part.loops for part in parts])
        candidates: list[_Candidate] = []
        start = two_stage(coarse, self.degrees)
        if start is not None:
            candidates.append(self._possible(samples, start, where))
        if start is None or samples.excess(candidates[0].refinement) > _EXPLAINED:
            degrees = self.degrees if start is None else (start.basis.elastic, start.basis.amplifier)
            other = scan(coarse, degrees)
            if other is not None:
                candidates.append(self._possible(samples, other, where))
        if not candidates:
            raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
        return min(candidates, key=lambda candidate: candidate.rank(samples))

    def _possible(self, samples: Samples, start: Solution, where: str) -> _Candidate:
        """The refinement of a start, with the degree of FA lowered until it is positive."""
        basis = start.basis
        refinement = refine(samples, basis, start.hysteresis, self.robust)
        while not is_positive(basis, refinement.backbone):
            if basis.amplifier == 0:
                raise IdentificationError(Outcome.BRANCHES_CROSS, where)
            basis = replace(basis, amplifier=basis.amplifier - 1)
            refinement = refine(samples, basis, start.hysteresis, self.robust)
        return _Candidate(basis, refinement, start)


@dataclass(frozen=True, eq=False)
class _Candidate:
    """A physically possible refined fit and its start."""

    basis: Basis
    refinement: Refinement
    start: Solution

    def rank(self, samples: Samples) -> float:
        """rms misfit [N], lowered for a fit whose strokes saturate."""
        loops, fit = samples.loops, self.refinement
        steady = Outcome.NO_STEADY_SECTION not in cautions_of(loops, fit.hysteresis, fit.omega)
        return loops.rms(fit.backbone.misfit(loops.force, fit.omega)) * (_PREFERENCE if steady else 1.0)


def _samples(parts: Sequence[SteadyRecord]) -> Samples:
    """The samples of all records, averaged where there are very many."""
    strokes = sum(part.strokes.count for part in parts)
    points = max(POINTS_PER_STROKE, min(_POINTS_PER_STROKE, _POINTS // strokes))
    loops = join([part.loops_with(points) for part in parts])
    return Samples(loops, tuple(force_noise(part.record.force) for part in parts))
