"""The result of one run of a study of a SYSTEM.toml."""

from __future__ import annotations

from dataclasses import dataclass

from ...ground.strict_json import finite
from ...vibration.verdicts.answers import CaseAnswer
from ...vibration.verdicts.verdicts import CaseVerdict, FigureKind
from .runs import DONE

# Figures whose margins stand in a row.
_LIMITED = (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.TILT, FigureKind.STROKE)


@dataclass(frozen=True)
class SystemRow:
    """One run: a load case on a candidate at a grid point.

    Attributes
    ----------
    run : int                             From 0 in the study.
    accelerations : tuple of float        Largest absolute acceleration of each point [m/s^2]; empty if refused.
    sway, tilt : float or None            Largest of all points and of all bodies [m], [rad].
    stroke : float or None                Largest share used of the way from rest to the end of a spring's range.
    mount : str or None                   The axis of a mount that has it.
    force : float or None                 Largest of any axis of a mount [N].
    rms_acceleration, rms_sway : float or None   Largest of all points and axes [m/s^2], [m]; None if nothing settles.
    error : float or None                 Numerical error of acceleration, sway or stroke, relative to the largest.
    acceleration_margin, sway_margin, tilt_margin, stroke_margin : float or None
                                          Least share of a limit that is left; None without a limit.
    governing : str or None               The limit with the least margin.
    verdict : str                         See `CaseVerdict`.
    beyond : float or None                Share of the draws beyond a limit or an identified range.
    outcome : str                         `DONE`, "outside" where figures are extrapolated, or why it is refused.
    """

    run: int
    accelerations: tuple[float, ...] = ()
    sway: float | None = None
    tilt: float | None = None
    stroke: float | None = None
    mount: str | None = None
    force: float | None = None
    rms_acceleration: float | None = None
    rms_sway: float | None = None
    error: float | None = None
    acceleration_margin: float | None = None
    sway_margin: float | None = None
    tilt_margin: float | None = None
    stroke_margin: float | None = None
    governing: str | None = None
    beyond: float | None = None
    verdict: str = CaseVerdict.REFUSED.value
    outcome: str = DONE


def system_row(run: int, answer: CaseAnswer) -> SystemRow:
    """A run of which there is an answer."""
    if answer.verdict is CaseVerdict.REFUSED:
        return SystemRow(run, outcome=answer.refusal)
    worst = {
        kind.name.lower(): finite(max((figure.high for figure in answer.figures_of(kind)), default=None))
        for kind in FigureKind
        if kind.name.lower() in SystemRow.__dataclass_fields__
    }
    stroke = max(answer.figures_of(FigureKind.STROKE), key=lambda figure: figure.high)
    margins: dict[str, float | None] = {}
    for kind in _LIMITED:
        shares = [figure.margin for figure in answer.figures_of(kind) if figure.margin is not None]
        margins[f"{kind.name.lower()}_margin"] = finite(min(shares, default=None))
    nearest = answer.nearest_limit
    return SystemRow(
        run=run,
        accelerations=tuple(figure.high for figure in answer.figures_of(FigureKind.ACCELERATION)),
        mount=stroke.subject,
        error=finite(answer.relative_error),
        **worst,
        **margins,
        governing=None if nearest is None else f"{nearest.quantity.value} of {nearest.subject}",
        beyond=answer.beyond,
        verdict=answer.verdict.value,
        outcome=answer.verdict.value if answer.verdict is CaseVerdict.OUTSIDE else DONE,
    )
