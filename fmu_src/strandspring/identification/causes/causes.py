"""Causes that records show beside a spring, of which no effect of the rig is one, with the effects they look like."""

from __future__ import annotations

from collections.abc import Sequence

from ...model.outcomes import Outcome
from ..rig.effect_columns import Effect, Rig
from ..search.search import Candidate
from .backlash import backlash
from .band_limit import band_limit
from .between_records import differences
from .hum import hum_beside

_LIKE_CORNERS = frozenset((Effect.DELAY, Effect.VISCOSITY, Effect.PLAY))


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
