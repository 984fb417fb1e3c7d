"""The refined method: the class that predicts held-out strokes best, with what is known of its spring."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any

import numpy as np

from ..core.branches import MECHANISMS
from ..core.parameters import SpringParameters
from ..findings import Finding, Outcome
from ..kernel.arrays import FloatArray
from .certainty import AT_BOUND, Certainty, certainty
from .choice import Allowed, Choice, Judged, Search, choose, flexible
from .fit import Fit, Problem
from .method import Fitted, Stage, begin
from .options import RefinedOptions
from .plain_models import held_out
from .rig import best_lag, lagging, likely_delay
from .samples import Samples
from .spring import spring_of
from .verdict import Verdict, groups

_SEARCHED = 900  # rows on which classes are compared


def candidates(options: RefinedOptions, samples: Samples, where: str) -> Iterator[Fitted]:  # noqa: ARG001
    """The springs of the classes by their held-out errors, the best first."""
    begin(Stage.SEARCHING)
    refinement, samples = _Refinement(options), _turning(samples)
    choice, delay = refinement.chosen(samples.thinned(_SEARCHED))
    if delay:
        samples = samples.on([lagging(record, delay) for record in samples.records])
    others = sorted(choice.seen, key=lambda judged: judged.logarithm)
    for judged in (choice.best, *others[:12]):
        yield refinement.fitted(replace(choice, best=judged), samples, delay)


@dataclass(frozen=True)
class _Refinement:
    """The refined method with its options."""

    options: RefinedOptions

    @property
    def allowed(self) -> Allowed:
        """The classes to choose from: with given degrees only what is given."""
        most = (1, 0) if self.options.degrees else (MECHANISMS, 2)
        mechanisms = (1, most[0]) if self.options.mechanisms is None else (self.options.mechanisms,) * 2
        branches = (0, most[1]) if self.options.branches is None else (self.options.branches,) * 2
        return Allowed(self.options.degrees, mechanisms, branches)

    def chosen(self, few: Samples) -> tuple[Choice, float]:
        """The choice, and the delay without which it was made [s]."""
        choice = self._choose(few)
        delay = likely_delay(few) if self.options.delay is None and few.is_timed else 0.0
        if delay:
            other = self._choose(few.on([lagging(record, delay) for record in few.records]))
            was, now = ((each.problem, each.best.fit) for each in (choice, other))
            # One mechanism without branches leaves nothing but noise.
            is_simple = now[0].is_noise(now[1]) and now[1].spring_class.nonlinear == 3
            if is_simple and (not was[0].is_noise(was[1]) or now[0].criterion(now[1]) < was[0].criterion(was[1])):
                delay = best_lag(few, now[1], delay, 0.1 * delay)[0]
                return self._choose(few.on([lagging(record, delay) for record in few.records])), delay
        return choice, 0.0

    def _choose(self, few: Samples) -> Choice:
        problem = Problem(few)
        if self.options.robust:
            first = Search(problem, self.allowed).begin()
            problem = problem.weighted(first.fit, True) or problem
        return choose(problem, self.allowed)

    def fitted(self, choice: Choice, samples: Samples, delay: float) -> Fitted:
        """The spring of a choice fitted to all rows, and what is known of it."""
        begin(Stage.REFINING)
        problem, fit = choice.problem.refined(choice.best.fit, samples, self.options.robust)
        offsets, drift = problem.nuisances(fit)
        spring = spring_of(problem, fit, drift * {"first": -0.5, "mean": 0.0, "last": 0.5}[self.options.state])
        begin(Stage.UNCERTAINTY)
        final = replace(choice, best=Judged(fit, choice.best.held_out))
        known = certainty(final, problem, spring)
        few = choice.problem
        # Where nothing but noise is left, no other model is asked.
        plain = {} if few.is_noise(choice.best.fit) else held_out(few.samples)
        verdict = Verdict.of(few.samples, choice.best.held_out / few.roots, plain)
        effects: dict[str, Any] = dict(self.options.known)
        findings = list(_of_fit(problem, fit, spring, known))
        if delay:
            effects["delay"] = delay
            findings.append(Finding(Outcome.DELAY, {"delay": delay}))
        if offsets.any():
            files = [PurePath(record.path).name for record in samples.measured]
            # Arrays, and files of several folders, may have one name.
            names = [name if files.count(name) == 1 else f"{name} ({k})" for k, name in enumerate(files, 1)]
            effects["force_zero"] = dict(zip(names, offsets.tolist(), strict=True))
            numbers = {"range": float(np.ptp(offsets)), "records": tuple(names), "shifts": tuple(offsets.tolist())}
            findings.append(Finding(Outcome.FORCE_ZERO, numbers))
        if drift:
            effects["drift"] = drift
            findings.append(Finding(Outcome.DRIFT_REMOVED, {"drift": drift}))
        return Fitted(
            spring, tuple(findings), effects=effects, nuisance=_nuisance(samples, offsets, drift), delay=delay,
            certainty=known, verdict=verdict,
        )  # fmt: skip


def _turning(samples: Samples) -> Samples:
    """Samples of coarse records with reversals between their samples, if a flexible spring follows these better."""
    if samples.displacement.size > 50 * len(samples.strokes):
        return samples
    variants = [samples, samples.restored(corners=False), samples.restored(corners=True)]
    misfits = [flexible(Problem(each.thinned(_SEARCHED))).squares for each in variants]
    best = int(np.argmin(misfits))
    return variants[best] if misfits[best] < 0.9 * misfits[0] else samples


def _nuisance(samples: Samples, offsets: FloatArray, drift: float) -> tuple[FloatArray, ...]:
    """What zeros and drift add to each record as measured [N]."""
    place = np.arange(samples.displacement.size) / (samples.displacement.size - 1) - 0.5
    return tuple(
        offset + drift * place[end - len(record) : end]
        for offset, record, end in zip(offsets, samples.measured, samples.begins[1:], strict=True)
    )


def _one_rate(samples: Samples) -> tuple[float, float] | None:
    """Least and greatest frequency of a test in which each amplitude has one rate [Hz]; None if one has several."""
    amplitude, frequency = samples.cycles
    middle = [0.25, 0.75]  # half strokes at the ends of records seem quicker
    for group in np.unique(of := groups(amplitude)):
        low, high = np.quantile(frequency[of == group], middle)
        if high > 1.7 * low:  # strokes between amplitudes seem quicker by 1.6
            return None
    low, high = np.quantile(frequency, middle).tolist()
    return low, high


def _of_fit(problem: Problem, fit: Fit, spring: SpringParameters, known: Certainty) -> Iterator[Finding]:
    """What a fit and its uncertainty call for."""
    lack, unrecorded, content = known.lack, known.unrecorded, known.uncertainty
    if lack.missed > 0.03 and lack.is_structured:
        yield Finding(Outcome.LACK_OF_FIT, lack.numbers)
    if unrecorded.one_amplitude:
        yield Finding(Outcome.ONE_AMPLITUDE, unrecorded.numbers)
    elif unrecorded.high - unrecorded.low > 0.14 * unrecorded.energy:  # +-7 % is decided
        yield Finding(Outcome.SMALL_LOOPS, unrecorded.numbers)
    if spring.branches and (rates := _one_rate(problem.samples)):
        yield Finding(Outcome.RATE_OPEN, {"frequencies": (rates,)})
    low, high = problem.bounds(fit.spring_class)
    if fit.q[2] < low[2] + AT_BOUND or fit.q[2] > high[2] - AT_BOUND:
        yield Finding(Outcome.N_AT_BOUND, {"n": spring.n})
    interval = content["prediction_interval"]
    if (held := interval["held_out_coverage"]) is not None and held < 0.9 and lack.missed > 1e-3:
        yield Finding(Outcome.INTERVAL_TOO_NARROW, {"held": held})
