"""The refined method: least squares from several starts, effects of the rig removed, with standard errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np

from ...core.branches import BRANCHES, MECHANISMS
from ...core.parameters import SpringParameters
from ...errors import RecordError
from ...ground.arguments import flag, seed_of, whole
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...model.outcomes import IdentificationError, Outcome
from ...records.record import Record
from ..certainty.figures import periodic_start
from ..certainty.lack_of_fit import LackOfFit
from ..certainty.posterior import posterior
from ..certainty.prediction_interval import ForceInterval, PredictionBand, prediction_interval
from ..certainty.uncertainty import is_sigma_uncertain, uncertainty
from ..classes.refined_class import RefinedClass, refined_class
from ..classes.selection import AllowedClasses
from ..classes.wider import wider_class
from ..least_squares.linearised import Linearised
from ..least_squares.projection import Problem, Refinement
from ..least_squares.refinement import FAIR_TOLERANCE, Samples, refine
from ..points.noise import force_noise
from ..points.polynomials import Basis
from ..points.steady_part import SteadyRecord
from ..rig.corrected import Corrected, rms_in, spring_alone
from ..rig.effect_columns import Rig, Sizes
from ..rig.effect_search import other_effects
from ..rig.effect_texts import CAUTIONS, RELAXING, described, detail, with_other_effects
from ..rig.effects import KEEP, STATES, USUAL_STATE, Effect
from ..rig.known_rig import KnownRig
from ..rig.other_mounts import nearest_mount
from ..search.search import PILOT, Candidate, bending_more, is_explained
from ..search.solution import cautions_of, is_positive, refuse_too_few, saturation_share, spring_of
from ..unrecorded.small_loops import loop_energy, one_amplitude_doubts, rival_springs, springs_of, undecided_energy
from ..unrecorded.wider_class import unrecorded
from .fitted import Fitted
from .method import Method
from .progress import Stage, begin
from .searching import final_points, searched

# Points in all, and at least in a stroke, on which minima are looked for.
_SEARCHED = 1000
_LEAST_POINTS = 24
_NEGLIGIBLE = 1e-3  # half-width of the prediction interval, share of the rms force, below which nobody asks for it
_LEAST_STEPS = 100  # of the sampler of the posterior


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
    mechanisms : int or None       Friction mechanisms, 1 or 2; chosen by what was left out if None, with given degrees
                                   1. A wider class has degrees of its own.
    branches : int or None         Maxwell branches, 0 to 3, which need times; chosen likewise if None, 0 or 1.
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
    mechanisms: int | None = None
    branches: int | None = None

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
        for name, low, high in (("mechanisms", 1, MECHANISMS), ("branches", 0, BRANCHES)):
            count = getattr(self, name)
            if count is not None and not low <= whole(name, count) <= high:
                raise ValueError(f"`{name}` must be within [{low}, {high}], got {count}.")
        if (self.bootstrap or self.posterior) and self.wanted.least != (1, 0):
            raise ValueError(
                "`bootstrap` and `posterior` are of springs without branches and a second mechanism; give one or the "
                "other."
            )

    @property
    def withstands_outliers(self) -> bool:
        """Whether isolated outliers hardly change the fit."""
        return self.robust

    @property
    def known(self) -> KnownRig:
        """What is known of the rig."""
        return KnownRig(self.moving_mass, self.fixture_stiffness, self.delay)

    @property
    def wanted(self) -> AllowedClasses:
        """Which classes are allowed: with given degrees, a bootstrap or a posterior only those that are given."""
        if self.degrees is not None or self.bootstrap or self.posterior:
            return AllowedClasses(self.mechanisms or 1, self.branches or 0)
        return AllowedClasses(self.mechanisms, self.branches)

    @property
    def known_delay(self) -> float:
        """By which the force of the records is known to lag [s]."""
        return self.delay or 0.0

    @property
    def seeks_delay(self) -> bool:
        """Whether a delay between the columns is sought in the records."""
        return self.delay is None

    @property
    def simpler(self) -> Sequence[Method]:
        """The paper's class first, unless another was asked for."""
        one = replace(self, mechanisms=self.mechanisms or 1, branches=self.branches or 0)
        return [*([] if one == self or self.degrees else [one]), *super().simpler]

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
        begin(Stage.SEARCHING)
        strokes = sum(part.strokes.count for part in parts)
        rig = Rig.from_parts(parts, max(_LEAST_POINTS, _SEARCHED // strokes), self.delay)
        rig = rig.keeping(effect for name in self.keep for effect in KEEP[name])
        noise = tuple(force_noise(part.record.force, part.strokes.turning[1:-1]) for part in parts)
        refuse_too_few(rig.loops, Basis(*rig.loops.reach, *(self.degrees or PILOT)), where)
        refusal = next((part.refusal for part in parts if part.refusal is not None), None)
        noise_rms = Samples(rig.loops, noise).noise_rms
        found = searched(rig, self.degrees, noise_rms, refusal, where)
        rig, best = found.rig, found.states[0]
        begin(Stage.COMPARING)
        wider = wider_class(rig, best, noise_rms, self.wanted, found.causes, where)
        chosen = None if wider is None else wider.fit
        sizes = best.sizes if wider is None or chosen is None else wider.sizes
        begin(Stage.REFINING)
        final_rig = rig.describing(self.state)
        samples = Samples(final_points(final_rig, sizes, best.fit), noise)
        loops = samples.loops
        added = None if chosen is None else refined_class(final_rig, samples, chosen, self.robust)
        if added is None:
            basis, refinement = self._refined(samples, best.fit, where)
        else:
            basis, refinement = added.basis, added.refinement
        linear = Linearised.from_refinement(loops, basis, refinement, None if added is None else added.further)
        begin(Stage.UNCERTAINTY)
        interval = prediction_interval(samples, linear)
        content = self._uncertainty(linear, interval, where)
        more = () if added is None else (added.second, added.branches)
        spring = spring_of(basis, refinement.backbone, refinement.hysteresis, where, *more)
        hysteretic = refinement.omega * refinement.backbone.G
        if added is not None:
            hysteretic += added.force_beside(final_rig, loops)
        lack = LackOfFit.from_fit(loops, refinement, hysteretic, samples.noise_rms)
        effects = described(sizes)
        cautions = self._cautions(linear, interval, sizes, content)
        findings = found.causes | {outcome: detail(outcome, effects) for outcome in cautions}
        if refusal is not None:
            sentence = refusal.outcome.value.partition(";")[0]
            findings[Outcome.DELAY] += f"; without it, {sentence[0].lower()}{sentence[1:]}"
        if Effect.CURVED_DRIFT in sizes:
            findings[Outcome.DRIFT_REMOVED] += RELAXING
        if wider is not None:
            findings = {**findings, **wider.findings}
        if spring.branches:
            findings.pop(Outcome.RATE_DEPENDENT, None)
        if added is None:
            findings = with_other_effects(findings, sizes, other_effects(found.states))
        # What a wider class explains to the noise is no fault of the rig.
        in_doubt = [] if wider is not None and added is not None and wider.unexplained is None else found.kept
        doubted = [kept for kept in in_doubt if not (kept.is_negligible or (added and kept.may_be_mount))]
        rig_or_mount = dict.fromkeys(kept.sentence for kept in doubted)
        if rig_or_mount:
            findings[Outcome.RIG_OR_MOUNT] = "; ".join(rig_or_mount)
        rivals = [] if added else rival_springs(self._alternatives(found.states))
        misfit = lack.beyond_noise * loops.rms(hysteretic) if lack.is_structured else 0.0
        doubts = one_amplitude_doubts(rig, best, cautions, content["interval_95"]) if loops.has_one_amplitude else []
        period = parts[0].cycle_time
        doubts += [f"undecided is {sentence}" for sentence in rig_or_mount]
        if undecided := undecided_energy(spring, content, rivals, 0.5 * loops.shortest, misfit, doubts, period):
            findings[Outcome.SMALL_LOOPS] = undecided
        if lack.is_reported:
            findings[Outcome.LACK_OF_FIT] = lack.advice
        other_energies = [loop_energy(other) for other in (*rivals, *springs_of([kept.fit for kept in in_doubt]))]
        unexplained = None if is_explained(best.fit, rms_in(best.loops, noise_rms, rig.loops)) else best
        if wider is not None and added is not None:
            other_energies += [loop_energy(other, period) for other in wider.other_springs()]
            unexplained = wider.unexplained
        if unexplained is not None:
            unseen = unrecorded(unexplained)
            other_energies += [loop_energy(spring, period) * share for share in unseen.energies]
            beyond = None if unexplained is best else "the chosen class leaves more than noise"
            if unseen.is_far and (mount := nearest_mount(rig, unexplained) or beyond):
                findings[Outcome.OTHER_MOUNT] = unseen.sentence(mount)
        is_turning = any(part.strokes.beyond is not None for part in rig.parts)
        predicted: tuple[FloatArray, ...] = ()
        alone: tuple[SteadyRecord, ...] = ()
        if sizes or self.known.effects or is_turning:
            whole = final_rig.with_points(None)
            final = replace(best.fit, basis=basis, refinement=refinement)
            described_sizes = final_rig.sizes_here(sizes)
            predicted = self._measured(whole, described_sizes, final, spring, added)
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
            wider=wider,
        )

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
        basis, start = fit.basis, fit.hysteresis
        refinement = refine(samples, basis, start, self.robust)
        while not is_positive(basis, refinement.backbone):
            if basis.amplifier == 0:
                raise IdentificationError(Outcome.BRANCHES_CROSS, where)
            basis = replace(basis, amplifier=basis.amplifier - 1)
            refinement = refine(samples, basis, start, self.robust)
        return basis, refinement

    def _measured(
        self, rig: Rig, sizes: Sizes, fit: Candidate, spring: SpringParameters, added: RefinedClass | None
    ) -> tuple[FloatArray, ...]:
        """Force at every sample of each record that the spring on this rig gives [N]."""
        _, force = rig.predicted(sizes, fit)
        if added is not None:
            force = force + added.force_beside(rig, rig.placed(sizes))
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


def bootstrap(linear: Linearised, repetitions: int, seed: int, where: str) -> dict[str, float]:
    """Standard errors of kappa_omega, rho, sigma and n from refits to strokes drawn with replacement.

    The weights stay those of the fit.

    Parameters
    ----------
    linear : Linearised   The fit.
    repetitions, seed : int
    where : str           Names of the records, for messages.

    Raises
    ------
    IdentificationError   If there are not two strokes in each direction to draw from.
    """
    loops, basis, refinement = linear.loops, linear.basis, linear.refinement
    generator = np.random.default_rng(seed)
    strokes = loops.used
    # Loading and unloading are drawn apart: without one of them FE and FA cannot be separated.
    groups = [strokes[loops.direction[strokes] == side] for side in (1, -1)]
    fewest = min(group.size for group in groups)
    if fewest < 2:
        raise IdentificationError(Outcome.TOO_FEW_TO_DRAW, where)
    problem = Problem(loops, basis, refinement.hysteresis, coarse=True)
    rows = []
    for _ in range(repetitions):
        count = np.zeros(int(strokes.max()) + 1)
        for group in groups:
            count[group] = generator.multinomial(group.size, np.full(group.size, 1.0 / group.size))
        weight = refinement.weight * count[loops.stroke]
        again = problem.solve(refinement.hysteresis, refinement.omega_start, weight, FAIR_TOLERANCE)
        powers = basis.powers(again.backbone.amplified)
        rows.append((powers[0], again.hysteresis.rho, again.hysteresis.sigma, again.hysteresis.n))
    # Draws from m strokes vary by m - 1 parts in m of what m strokes do.
    errors = np.std(np.array(rows), axis=0, ddof=1) * np.sqrt(fewest / (fewest - 1.0))
    return dict(zip(("kappa_omega", "rho", "sigma", "n"), errors.tolist(), strict=True))
