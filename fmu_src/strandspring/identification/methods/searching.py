"""The search of the refined method: reversals between samples, other causes, effects of the rig."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...model.outcomes import IdentificationError, Outcome
from ..causes.backlash import backlash
from ..causes.band_limit import band_limit
from ..causes.between_records import differences
from ..causes.hum import hum_beside
from ..points.sample_points import POINTS_PER_STROKE, SamplePoints
from ..rig.corrected import Corrected
from ..rig.effect_columns import Effect, Rig, Sizes
from ..rig.effect_search import find_delayed
from ..rig.removal import Kept, find_removable
from ..search.search import CLOSE, Candidate, is_explained, search

# All samples are used up to this many in a stroke and about this many in all; more are averaged over so fine cells
# that what is lost is far below the noise.
_POINTS_PER_STROKE = 2000
_POINTS = 40_000
_COARSE = 5e-5  # travel between samples at reversals from which it is looked for, share of a stroke
_LIKE_CORNERS = frozenset((Effect.DELAY, Effect.VISCOSITY, Effect.PLAY))


class Found(NamedTuple):
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


def searched(
    rig: Rig, degrees: tuple[int, int] | None, noise: float, refusal: IdentificationError | None, where: str
) -> Found:
    """The springs that the records show.

    Parameters
    ----------
    rig : Rig
    degrees : (int, int) or None            Of FE and FA; chosen if None.
    noise : float                           The rms that noise alone gives the residuals [N].
    refusal : IdentificationError or None   Why no spring can have made the records as measured; a delay may have.
    where : str                             Names of the records, for messages.

    Raises
    ------
    IdentificationError   If no spring is found.
    """
    if refusal is not None:
        delayed = find_delayed(rig, noise, degrees)
        if not delayed:
            raise refusal
        return Found(rig, delayed, [], {})
    rig, candidates = _with_turns(rig, search(rig.loops, degrees), degrees)
    if not candidates:
        raise IdentificationError(Outcome.BRANCHES_CROSS, where)
    findings: dict[Outcome, str] = {}
    if not is_explained(candidates[0], noise):
        findings, alike = causes_in(rig, candidates)
        rig = rig.keeping(alike)
    return Found(rig, *find_removable(rig, candidates, noise, degrees), findings)


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


def final_points(rig: Rig, sizes: Sizes, fit: Candidate) -> SamplePoints:
    """The samples of all records without the effects of the rig, averaged where there are very many."""
    strokes = sum(part.strokes.count for part in rig.parts)
    finest = rig.with_points(max(POINTS_PER_STROKE, min(_POINTS_PER_STROKE, _POINTS // strokes)))
    return finest.corrected(sizes, fit) if sizes else finest.loops


def causes_in(rig: Rig, candidates: Sequence[Candidate]) -> tuple[dict[Outcome, str], frozenset[Effect]]:
    """The causes in the records of a rig: outcomes with their details, and effects of the rig that look like them.

    Parameters
    ----------
    rig : Rig
    candidates : sequence of Candidate   From `search`, of the points as measured, the best first; may be empty.
    """
    findings: dict[Outcome, str] = {}
    forbidden: frozenset[Effect] = frozenset()
    for difference in differences([part.record for part in rig.parts]):
        findings[difference.outcome] = difference.detail
        forbidden |= frozenset(difference.forbidden)
    if (limit := band_limit(rig.parts)) is not None:
        findings[Outcome.BAND_LIMITED] = limit.sentence
        # A filter on the force alone delays it.
        forbidden |= _LIKE_CORNERS if limit.is_common else frozenset()
    if gap := backlash(rig.parts):
        findings[Outcome.BACKLASH] = gap
        forbidden |= _LIKE_CORNERS
    if candidates and (line := hum_beside(rig, candidates[0])) is not None:
        findings[Outcome.HUM] = line.sentence
        forbidden |= _LIKE_CORNERS
    return findings, forbidden
