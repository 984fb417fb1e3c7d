"""The wider class of a spring that records show, and what is said of it: the door of this folder."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import RecordError
from ...model.outcomes import IdentificationError, Outcome
from ..least_squares.stages import Backbone
from ..rig.corrected import Corrected, rms_in
from ..rig.effect_columns import Effect, Rig, Sizes
from ..rig.paying_effects import fitted_with, is_white
from ..search.search import Criterion, force_floor, is_explained
from ..search.solution import spring_of
from .problem import ClassFit
from .rates import is_timed
from .refined_class import as_spring, branches_of, second_of
from .selection import AllowedClasses, Choice, Classes, Tried

# What a branch gives as well, so that it is not removed beside one.
_LIKE_BRANCHES = (Effect.VISCOSITY, Effect.CURVED_DRIFT)
# Causes of misfit that a wider class would be fitted to.
_OTHER_CAUSES = (
    Outcome.BAND_LIMITED, Outcome.BACKLASH, Outcome.HUM, Outcome.INERTIA, Outcome.RECORDS_DIFFER,
)  # fmt: skip
_MOST_RECORDS = 24  # in which classes are sought unasked: each has an omega_start
_NAMES = ("no", "one", "two", "three")


@dataclass(frozen=True, eq=False)
class Wider:
    """What a search for wider classes found.

    Attributes
    ----------
    choice : Choice
    sizes : dict        Effects of the rig beside the chosen class.
    spread : float      Standard deviation of the force [N].
    durations : (float, float)   Of the short and the long strokes recorded [s]; of samples without times.
    unexplained : Corrected or None   The chosen class if it is wider and leaves more than noise, as a spring of its
                                      largest mechanism.
    """

    choice: Choice
    sizes: Sizes
    spread: float
    durations: tuple[float, float]
    unexplained: Corrected | None = None

    @property
    def fit(self) -> ClassFit | None:
        """The chosen class, if it is wider than the paper's."""
        return None if self.choice.chosen.kind == (1, 0) else self.choice.chosen.fit

    @property
    def findings(self) -> dict[Outcome, str]:
        """Cautions with their details."""
        chosen, other = self.choice.chosen, self.choice.open_branch
        if chosen.fit.stiffness.size:
            low, high = self.durations
            sizes = ", ".join(
                f"{branch.stiffness:.3g} N/m with {branch.time_constant:.3g} s" for branch in branches_of(chosen.fit)
            )
            return {Outcome.RATES: f"strokes took {low:.3g} to {high:.3g} s; branches of {sizes}"}
        if other is not None:
            errors = f"the misfit would be {other.misfit:.3g} N, and is {chosen.misfit:.3g} N"
            if other.held_out < chosen.held_out:
                errors = f"the error on what was left out would be {self._share(other)}, and is {self._share(chosen)}"
            return {Outcome.RATE_OPEN: f"with {_in_words(other)} {errors}"}
        return {}

    @property
    def sentence(self) -> str:
        """Errors of the classes on what was left out, in words."""
        plain, *others = self.choice.tried
        best = {each.kind: each for each in sorted(others, key=lambda each: -each.held_out)}
        texts = [f"{self._share(plain)} with one mechanism"] + [
            f"{self._share(each)} with {_in_words(each)}{' (chosen)' if each is self.choice.chosen else ''}"
            for each in best.values()
        ]
        return f"classes: error of the force on what was left out {', '.join(texts)}"

    def as_json(self) -> list[dict[str, Any]]:
        """Content of the model file's field `fit.classes`."""
        return [
            {
                "mechanisms": each.kind[0],
                "branches": each.kind[1],
                "parameters": each.fit.parameters,
                "rmse": each.misfit,
                "held_out_rmse": each.held_out,
                "chosen": each is self.choice.chosen,
            }
            for each in self.choice.tried
        ]

    def other_springs(self) -> list[SpringParameters]:
        """The springs of the classes that were not chosen, as far as they are springs."""
        springs = []
        for each in self.choice.tried:
            if each is not self.choice.chosen:
                with suppress(IdentificationError):
                    springs.append(_spring_of(each.fit))
        return springs

    def _share(self, tried: Tried) -> str:
        return f"{100.0 * tried.held_out / self.spread:.2g} %"


def wider_class(
    rig: Rig, best: Corrected, noise: float, wanted: AllowedClasses, causes: Mapping[Outcome, str], where: str
) -> Wider | None:
    """The wider class that the records show; None where none is promising, or other causes may be fitted by it.

    Parameters
    ----------
    rig : Rig
    best : Corrected     The spring of the paper's class.
    noise : float        The rms that noise alone gives the residuals at the rig's points [N].
    wanted : AllowedClasses
    causes : mapping     Other causes of misfit that were found.
    where : str          Names of the records, for messages.

    Raises
    ------
    RecordError          If a wanted class needs more than the records hold.
    """
    is_forced = wanted.least != (1, 0)
    if wanted.branches and not is_timed(rig):
        raise RecordError(
            f"{where}: Maxwell branches (`branches={wanted.branches}`) need records of several cycles with rising "
            "times; give such records, or `branches=0`."
        )
    if any(part.periodic for part in rig.parts):
        if is_forced:
            raise RecordError(
                f"{where}: a second mechanism (`mechanisms=2`) cannot be told from a single cycle; record several, or "
                "give `mechanisms=1`."
            )
        return None
    if not wanted.next(wanted.least) and not is_forced:
        return None
    if not is_forced and (len(rig.parts) > _MOST_RECORDS or any(cause in causes for cause in _OTHER_CAUSES)):
        return None
    sizes = {effect: size for effect, size in best.sizes.items() if effect not in _LIKE_BRANCHES}
    begin = best if len(sizes) == len(best.sizes) else fitted_with(rig, best.fit, sizes)
    if begin is None:
        return None
    left = rms_in(begin.loops, noise, rig.loops)
    if not is_forced and (begin.fit.misfit <= force_floor(begin.loops) or is_white(begin.fit, left)):
        return None
    choice = Classes(rig, begin.loops, begin.fit, left).choice(wanted)
    if choice is None:
        return None
    loops = begin.loops
    if begin is not best and not is_forced and _is_worse(choice.chosen, best):
        return None
    # Strokes from one amplitude to the next are shorter than others.
    low, high = np.quantile(rig.durations(loops)[loops.used], (0.1, 0.9), method="nearest").tolist()
    chosen = None if choice.chosen.kind == (1, 0) else as_spring(rig, loops, choice.chosen.fit, sizes)
    unexplained = None if chosen is None or is_explained(chosen.fit, left) else chosen
    return Wider(choice, sizes, loops.force_deviation, (low, high), unexplained)


def _is_worse(chosen: Tried, best: Corrected) -> bool:
    """Whether effects of the rig explain the records as well as a class without them."""
    criterion = Criterion.from_points(best.loops, min(chosen.time, best.fit.autocorrelation_time))
    with_effects = criterion.value(best.fit.misfit, best.price + best.fit.coefficients + 3)
    return chosen.kind == (1, 0) or criterion.value(chosen.misfit, chosen.fit.parameters) >= with_effects


def _spring_of(fit: ClassFit) -> SpringParameters:
    backbone = Backbone(fit.elastic, fit.amplified[0], np.zeros(0), np.zeros(0))
    return spring_of(fit.basis, backbone, fit.shape.hysteresis[0], "", second_of(fit), branches_of(fit))


def _in_words(tried: Tried) -> str:
    mechanisms, branches = tried.kind
    words = ["a second mechanism"] if mechanisms > 1 else []
    if branches:
        words.append(f"{_NAMES[branches]} Maxwell branch{'es' if branches > 1 else ''}")
    return " and ".join(words) or "neither"
