"""The refined method: least squares from several starts, effects of the rig removed, with standard errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any, ClassVar, NamedTuple

from ...core.parameters import SpringParameters
from ...errors import RecordError
from ...ground.arguments import flag, seed_of, whole
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...model.outcomes import IdentificationError, Outcome
from ...records.record import Record
from ..causes.causes import causes_in
from ..certainty.bootstrap import bootstrap
from ..certainty.figures import periodic_start
from ..certainty.lack_of_fit import LackOfFit
from ..certainty.posterior import posterior
from ..certainty.prediction_interval import ForceInterval, PredictionBand, prediction_interval
from ..certainty.uncertainty import is_sigma_uncertain, uncertainty
from ..least_squares.linearised import Linearised
from ..least_squares.projection import Refinement
from ..least_squares.refinement import Samples, refine
from ..points.noise import force_noise
from ..points.polynomials import Basis
from ..points.sample_points import POINTS_PER_STROKE, SamplePoints
from ..points.steady_part import SteadyRecord
from ..rig.corrected import Corrected, rms_in, spring_alone
from ..rig.effect_columns import Rig, Sizes
from ..rig.effect_search import find_delayed, other_effects
from ..rig.effect_texts import CAUTIONS, RELAXING, described, detail, with_other_effects
from ..rig.effects import KEEP, STATES, USUAL_STATE, Effect
from ..rig.known_rig import KnownRig
from ..rig.other_mounts import nearest_mount
from ..rig.removal import Kept, find_removable
from ..search.search import CLOSE, PILOT, Candidate, bending_more, is_explained, search
from ..search.solution import cautions_of, is_positive, refuse_too_few, saturation_share, spring_of
from ..unrecorded.small_loops import loop_energy, one_amplitude_doubts, rival_springs, springs_of, undecided_energy
from ..unrecorded.wider_class import unrecorded
from .fitted import Fitted
from .method import Method

# Points in all, and at least in a stroke, on which minima are looked for.
_SEARCHED = 1000
_LEAST_POINTS = 24
# All samples are used up to this many in a stroke and about this many in all; more are averaged over so fine cells
# that what is lost is far below the noise.
_POINTS_PER_STROKE = 2000
_POINTS = 40_000
_NEGLIGIBLE = 1e-3  # half-width of the prediction interval, share of the rms force, below which nobody asks for it
_COARSE = 5e-5  # travel between samples at reversals from which it is looked for, share of a stroke
_LEAST_STEPS = 100  # of the sampler of the posterior


class _Found(NamedTuple):
    """What a search found.

    Attributes
    ----------
    rig : Rig                    With reversals restored if need be, and what must stay in the records kept.
    states : list of Corrected   Springs, the best first.
    kept : list of Kept          Effects that were left in the records.
    causes : dict                Outcomes of other causes than effects of the rig, with their details.
    """

    rig: Rig
    states: list[Corrected]
    kept: list[Kept]
    causes: dict[Outcome, str]


@dataclass(frozen=True)
class RefinedOptions(Method):
    """Options of the refined method: several starts, effects of the rig removed, standard errors.

    Effects that the records show and that pay for themselves are removed unasked, see `effects`; what no record shows
    is given here.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA, both polynomials; chosen from the data if None, when FE
                                   may also become a table.
    robust : bool                  Huber's loss instead of squares, for records with outliers.
    bootstrap : int                Repetitions of a stroke-wise bootstrap for the standard errors; 0 for none.
    seed : int                     Of the bootstrap and the posterior.
    posterior : int                The posterior is drawn too, in so many steps of a Monte Carlo sampler where weighted
                                   draws do not do; 0 for none. Needs emcee.
    moving_mass : float            Between load cell and spring [kg]; its inertia is removed, which needs times.
    fixture_stiffness : float      Of what yields between displacement sensor and spring [N/m]; infinite for nothing.
    delay : float or None          By which the force lags [s], negative if it leads; sought in the records if None.
                                   One that is given needs times.
    keep : tuple of str            Effects that are left in the records: names of `KEEP`.
    state : str                    The spring that is described where the test changes it by wear or drift: that of its
                                   "first" cycle, of its "mean" or of its "last" cycle.
    """

    name: ClassVar[str] = "refined"

    robust: bool = False
    bootstrap: int = 0
    seed: int = 0
    posterior: int = 0
    moving_mass: float = 0.0
    fixture_stiffness: float = math.inf
    delay: float | None = None
    keep: tuple[str, ...] = ()
    state: str = USUAL_STATE

    def __post_init__(self) -> None:
        super().__post_init__()
        flag("robust", self.robust)
        for name in ("bootstrap", "posterior"):
            whole(name, getattr(self, name))
        if self.bootstrap != 0 and not 2 <= self.bootstrap <= 10_000:
            raise ValueError(f"`bootstrap` must be 0 or within [2, 10000] repetitions, got {self.bootstrap}.")
        if self.posterior and not _LEAST_STEPS <= self.posterior <= 1_000_000:
            raise ValueError(f"`posterior` must be 0 or within [{_LEAST_STEPS}, 1000000] steps, got {self.posterior}.")
        if self.posterior and find_spec("emcee") is None:
            raise ValueError(
                '`posterior` needs the package emcee; install it with pip install "strandspring[posterior]".'
            )
        if not isinstance(self.keep, tuple) or not set(self.keep) <= KEEP.keys():
            raise ValueError(f"`keep` must be a tuple of {', '.join(KEEP)}, got {self.keep!r}.")
        if self.state not in STATES:
            raise ValueError(f"`state` must be one of {', '.join(STATES)}, got {self.state!r}.")
        seed_of(self.seed)
        _ = self.known  # which checks itself

    @property
    def withstands_outliers(self) -> bool:
        """Whether isolated outliers hardly change the fit."""
        return self.robust

    @property
    def known(self) -> KnownRig:
        """What is known of the rig."""
        return KnownRig(self.moving_mass, self.fixture_stiffness, self.delay)

    @property
    def known_delay(self) -> float:
        """By which the force of the records is known to lag [s]."""
        return self.delay or 0.0

    @property
    def seeks_delay(self) -> bool:
        """Whether a delay between the columns is sought in the records."""
        return self.delay is None

    def prepare(self, record: Record) -> Record:
        """The record without the effects of the rig that are known, but for the delay.

        Raises
        ------
        RecordError   If the record does not have the times that they need.
        """
        return self.known.removed(record)

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Identify from several starts and refine the best minimum on all samples.

        Raises
        ------
        IdentificationError   If no model is physically possible.
        RecordError           If a delay is given for a single closed period.
        """
        if self.delay and any(part.periodic for part in parts):
            raise RecordError(f"{where}: a delay cannot be removed from a single cycle; record at least two.")
        strokes = sum(part.strokes.count for part in parts)
        rig = Rig.from_parts(parts, max(_LEAST_POINTS, _SEARCHED // strokes), self.delay)
        rig = rig.keeping(effect for name in self.keep for effect in KEEP[name])
        noise = tuple(force_noise(part.record.force, part.strokes.turning[1:-1]) for part in parts)
        refuse_too_few(rig.loops, Basis(*rig.loops.reach, *(self.degrees or PILOT)), where)
        refusal = next((part.refusal for part in parts if part.refusal is not None), None)
        noise_rms = Samples(rig.loops, noise).noise_rms
        searched = self._searched(rig, noise_rms, refusal, where)
        rig, best = searched.rig, searched.states[0]
        sizes = best.sizes
        final_rig = rig.describing(self.state)
        samples = Samples(_points(final_rig, sizes, best.fit), noise)
        loops = samples.loops
        basis, refinement = self._refined(samples, best.fit, where)
        linear = Linearised.from_refinement(loops, basis, refinement)
        interval = prediction_interval(samples, linear)
        content = self._uncertainty(linear, interval, where)
        spring = spring_of(basis, refinement.backbone, refinement.hysteresis, where)
        lack = LackOfFit.from_fit(loops, refinement, samples.noise_rms)
        effects = described(sizes)
        cautions = self._cautions(linear, interval, sizes, content)
        findings = searched.causes | {outcome: detail(outcome, effects) for outcome in cautions}
        if refusal is not None:
            sentence = refusal.outcome.value.partition(";")[0]
            findings[Outcome.DELAY] += f"; without it, {sentence[0].lower()}{sentence[1:]}"
        if Effect.CURVED_DRIFT in sizes:
            findings[Outcome.DRIFT_REMOVED] += RELAXING
        findings = with_other_effects(findings, sizes, other_effects(searched.states))
        rig_or_mount = dict.fromkeys(kept.sentence for kept in searched.kept if not kept.is_negligible)
        if rig_or_mount:
            findings[Outcome.RIG_OR_MOUNT] = "; ".join(rig_or_mount)
        rivals = rival_springs(self._alternatives(searched.states))
        misfit = lack.beyond_noise * loops.rms(refinement.omega * refinement.backbone.G) if lack.is_structured else 0.0
        doubts = one_amplitude_doubts(rig, best, cautions, content["interval_95"]) if loops.has_one_amplitude else []
        doubts += [f"undecided is {sentence}" for sentence in rig_or_mount]
        if undecided := undecided_energy(spring, content, rivals, 0.5 * loops.shortest, misfit, doubts):
            findings[Outcome.SMALL_LOOPS] = undecided
        if lack.is_reported:
            findings[Outcome.LACK_OF_FIT] = lack.advice
        other_energies = [loop_energy(other) for other in (*rivals, *springs_of([kept.fit for kept in searched.kept]))]
        if not is_explained(best.fit, rms_in(best.loops, noise_rms, rig.loops)):
            wider = unrecorded(best)
            other_energies += [loop_energy(spring) * share for share in wider.energies]
            if wider.is_far and (mount := nearest_mount(rig, best)) is not None:
                findings[Outcome.OTHER_MOUNT] = wider.sentence(mount)
        is_turning = any(part.strokes.beyond is not None for part in rig.parts)
        predicted: tuple[FloatArray, ...] = ()
        alone: tuple[SteadyRecord, ...] = ()
        if sizes or self.known.effects or is_turning:
            whole = final_rig.with_points(None)
            final = replace(best.fit, basis=basis, refinement=refinement)
            described_sizes = final_rig.sizes_here(sizes)
            predicted = self._measured(whole, described_sizes, final, spring)
            if sizes or self.delay:
                alone = spring_alone(whole, described_sizes, final)
        return Fitted(
            spring,
            findings,
            saturation_share(loops, refinement.hysteresis),
            tuple(refinement.omega_start.tolist()),
            content,
            PredictionBand.from_interval(linear, interval),
            effects={**self.known.effects, **effects},
            predicted=predicted,
            lack_of_fit=lack,
            alone=alone,
            turning=tuple(rig.parts) if is_turning else (),
            other_energies=tuple(other_energies),
        )

    def _searched(self, rig: Rig, noise: float, refusal: IdentificationError | None, where: str) -> _Found:
        """The springs that the records show.

        Parameters
        ----------
        rig : Rig
        noise : float                           The rms that noise alone gives the residuals [N].
        refusal : IdentificationError or None   Why no spring can have made the records as measured; a delay may have.
        where : str                             Names of the records, for messages.

        Raises
        ------
        IdentificationError   If no spring is found.
        """
        if refusal is not None:
            delayed = find_delayed(rig, noise, self.degrees)
            if not delayed:
                raise refusal
            return _Found(rig, delayed, [], {})
        rig, candidates = _with_turns(rig, search(rig.loops, self.degrees), self.degrees)
        if not candidates:
            raise IdentificationError(Outcome.BRANCHES_CROSS, where)
        findings: dict[Outcome, str] = {}
        if not is_explained(candidates[0], noise):
            findings, alike = causes_in(rig, candidates)
            rig = rig.keeping(alike)
        return _Found(rig, *find_removable(rig, candidates, noise, self.degrees), findings)

    def _uncertainty(self, linear: Linearised, interval: ForceInterval, where: str) -> dict[str, Any]:
        """Content of the model file's field."""
        content = uncertainty(linear)
        indistinct = content.pop("indistinct")
        content |= {"prediction_interval": interval.as_json(), "indistinct": indistinct}
        if self.bootstrap:
            spread = bootstrap(linear, self.bootstrap, self.seed, where)
            content["bootstrap"] = {"repetitions": self.bootstrap, "seed": self.seed, **spread}
        if self.posterior:
            content["posterior"] = posterior(linear, self.posterior, self.seed)
        return content

    def _cautions(
        self, linear: Linearised, interval: ForceInterval, sizes: Sizes, content: dict[str, Any]
    ) -> list[Outcome]:
        """What the fit itself, and what was found beside it, call for."""
        loops, basis, refinement = linear.loops, linear.basis, linear.refinement
        too_narrow = interval.is_too_narrow and interval.half_width > _NEGLIGIBLE * loops.rms(loops.force)
        called_for = {
            Outcome.AMPLIFIER_REDUCED: self.degrees not in (None, (basis.elastic, basis.amplifier)),
            **{CAUTIONS[effect]: True for effect in sizes},
            Outcome.NOT_CONVERGED: not refinement.converged,
            **dict.fromkeys(cautions_of(loops, refinement.hysteresis, refinement.omega), True),
            Outcome.INDISTINCT: bool(content["indistinct"]),
            Outcome.INTERVAL_TOO_NARROW: too_narrow,
            Outcome.SIGMA_AT_BOUND: is_sigma_uncertain(loops, basis, refinement),
        }
        return [outcome for outcome, applies in called_for.items() if applies]

    def _alternatives(self, states: Sequence[Corrected]) -> list[list[Candidate]]:
        """What may be about as good as the first, which begins each list; their criteria are by the same count."""
        best = states[0]
        alternatives = [[replace(state.fit, criterion=best.better_by(state)) for state in states]]
        if self.degrees is None:
            alternatives.append(bending_more(best.loops, best.fit))
        return alternatives

    def _refined(self, samples: Samples, fit: Candidate, where: str) -> tuple[Basis, Refinement]:
        """The fit refined on all samples, with the degree of FA lowered until it is positive."""
        basis, start = fit.basis, fit.refinement.hysteresis
        refinement = refine(samples, basis, start, self.robust)
        while not is_positive(basis, refinement.backbone):
            if basis.amplifier == 0:
                raise IdentificationError(Outcome.BRANCHES_CROSS, where)
            basis = replace(basis, amplifier=basis.amplifier - 1)
            refinement = refine(samples, basis, start, self.robust)
        return basis, refinement

    def _measured(self, rig: Rig, sizes: Sizes, fit: Candidate, spring: SpringParameters) -> tuple[FloatArray, ...]:
        """Force at every sample of each record that the spring on this rig gives [N]."""
        _, force = rig.predicted(sizes, fit)
        forces = [force[at] for _, at in rig.loops.by_record]
        solver = PathSolver(spring)
        for k, part in enumerate(rig.parts):
            if part.periodic:
                path = part.strokes.displacement
                forces[k] = solver.force(path, periodic_start(solver, path))
        return tuple(
            force_of_record + self.known.inertia(part.record)
            for force_of_record, part in zip(forces, rig.parts, strict=True)
        )


def _with_turns(rig: Rig, candidates: list[Candidate], degrees: tuple[int, int] | None) -> tuple[Rig, list[Candidate]]:
    """The rig with reversals between the samples, if these explain the records clearly better, and springs for it."""
    if not candidates or max(part.strokes.lost_at_reversals for part in rig.parts) < _COARSE:
        return rig, candidates
    at_samples = best = Corrected(candidates[0], rig.loops, {})
    settled = rig, candidates
    for corners in (False, True):
        parts = [part.turning_between_samples(corners) for part in rig.parts]
        turning = Rig.from_parts(parts, rig.points, rig.delay).keeping(rig.kept)
        if others := search(turning.loops, degrees):
            between = Corrected(others[0], turning.loops, {})
            if between.better_by(at_samples) > CLOSE and between.better_by(best) > 0.0:
                best, settled = between, (turning, others)
    return settled


def _points(rig: Rig, sizes: Sizes, fit: Candidate) -> SamplePoints:
    """The samples of all records without the effects of the rig, averaged where there are very many."""
    strokes = sum(part.strokes.count for part in rig.parts)
    finest = rig.with_points(max(POINTS_PER_STROKE, min(_POINTS_PER_STROKE, _POINTS // strokes)))
    return finest.corrected(sizes, fit) if sizes else finest.loops
