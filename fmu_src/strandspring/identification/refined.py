"""The refined method: the class that predicts held-out strokes best, with what is known of its spring."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import PurePath
from typing import Any, ClassVar, get_args

import numpy as np

from ..core.branches import BRANCHES, MECHANISMS
from ..core.parameters import SpringParameters
from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.arguments import flag, whole
from ..kernel.arrays import FloatArray
from ..records.record import Record
from .certainty import AT_BOUND, Certainty, certainty
from .choice import Allowed, Choice, Judged, Search, choose, flexible
from .findings import State
from .fit import Fit, Problem
from .method import Fitted, Stage, begin
from .plain_models import held_out
from .rig import KnownRig, best_lag, lagging, likely_delay
from .samples import Samples
from .spring import spring_of
from .verdict import Verdict, groups

_SEARCHED = 900  # rows on which classes are compared


@dataclass(frozen=True)
class RefinedOptions(KnownRig):
    """Options of the refined method.

    Zeros between records, a drift and a delay are taken out unasked where nothing but noise is left without them, see
    `effects`; what no record shows is given here.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA, both polynomials; chosen by what is held out if None,
                                   when FE may also become a table.
    robust : bool                  Huber's loss instead of squares, for records with outliers.
    moving_mass : float            Between load cell and spring [kg]; its inertia is removed, which needs times.
    fixture_stiffness : float      Of what yields between displacement sensor and spring [N/m]; infinite for nothing.
    delay : float or None          By which the force lags [s], negative if it leads; sought in the records if None.
                                   One that is given needs times.
    state : str                    The spring that is described where the test changes it: that of its "first" cycles,
                                   of all ("mean") or of its "last" cycles.
    mechanisms : int or None       Friction mechanisms, 1 or 2; chosen by what is held out if None, with given degrees
                                   1.
    branches : int or None         Maxwell branches, 0 to 3, which need times; chosen likewise if None, 0 to 2.
    """

    name: ClassVar[str] = "refined"

    robust: bool = False
    state: State = "mean"
    mechanisms: int | None = None
    branches: int | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        flag("robust", self.robust)
        if self.state not in get_args(State):
            raise ValueError(f"`state` must be one of {', '.join(get_args(State))}, got {self.state!r}.")
        for name, low, high in (("mechanisms", 1, MECHANISMS), ("branches", 0, BRANCHES)):
            count = getattr(self, name)
            if count is not None and not low <= whole(name, count) <= high:
                raise ValueError(f"`{name}` must be within [{low}, {high}], got {count}.")

    @property
    def allowed(self) -> Allowed:
        """The classes to choose from: with given degrees only what is given."""
        most = (1, 0) if self.degrees else (MECHANISMS, 2)
        mechanisms = (1, most[0]) if self.mechanisms is None else (self.mechanisms,) * 2
        branches = (0, most[1]) if self.branches is None else (self.branches,) * 2
        return Allowed(self.degrees, mechanisms, branches)

    def prepare(self, record: Record) -> Record:
        """The record without the effects of the rig that are known.

        Raises
        ------
        RecordError   If the record does not have the times that they, or branches, need.
        """
        if self.branches and record.rising_time is None:
            raise RecordError(
                "{where}: Maxwell branches need times that rise from sample to sample; name the time column with "
                "{to[time]}, or give {to[branches=0]}.",
                where=record.path,
            )
        return super().prepare(record)

    def candidates(self, samples: Samples, where: str) -> Iterator[Fitted]:  # noqa: ARG002 - it refuses nothing
        """The springs of the classes by their held-out errors, the best first."""
        begin(Stage.SEARCHING)
        samples = _turning(samples)
        choice, delay = self._chosen(samples.thinned(_SEARCHED))
        if delay:
            samples = samples.on([lagging(record, delay) for record in samples.records])
        others = sorted(choice.seen, key=lambda judged: judged.logarithm)
        for judged in (choice.best, *others[:12]):
            yield self._of(replace(choice, best=judged), samples, delay)

    def _chosen(self, few: Samples) -> tuple[Choice, float]:
        """The choice, and the delay without which it was made [s]."""
        choice = self._choose(few)
        delay = likely_delay(few) if self.delay is None and few.is_timed else 0.0
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
        if self.robust:
            first = Search(problem, self.allowed).begin()
            problem = problem.weighted(first.fit, True) or problem
        return choose(problem, self.allowed)

    def _of(self, choice: Choice, samples: Samples, delay: float) -> Fitted:
        """The spring of a choice fitted to all rows, and what is known of it."""
        begin(Stage.REFINING)
        problem, fit = choice.problem.refined(choice.best.fit, samples, self.robust)
        offsets, drift = problem.nuisances(fit)
        spring = spring_of(problem, fit, drift * {"first": -0.5, "mean": 0.0, "last": 0.5}[self.state])
        begin(Stage.UNCERTAINTY)
        final = replace(choice, best=Judged(fit, choice.best.held_out))
        known = certainty(final, problem, spring)
        few = choice.problem
        # Where nothing but noise is left, no other model is asked.
        plain = {} if few.is_noise(choice.best.fit) else held_out(few.samples)
        verdict = Verdict.of(few.samples, choice.best.held_out / few.roots, plain)
        effects: dict[str, Any] = dict(self.known)
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
