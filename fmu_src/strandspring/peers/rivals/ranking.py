"""Which class of models predicts best what it was not fitted to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...identification.points.steady_part import SteadyRecord
from ...identification.search.search import force_floor
from ...kernel.arrays import FloatArray
from ...loops.strokes import IndexArray
from .classes import OWN, RIVALS, Rival
from .fitting import RivalFit, RivalProblem, fit_class
from .track import Track

_MOST_FOLDS = 10
_RECORDS = 3  # from which whole records are held out
_CYCLES = 5  # from which whole cycles are held out
_STROKES = 4  # from which whole strokes are held out
_ARCS, _ARC_FOLDS = 10, 5  # into which a stroke is cut when there are fewer, and the folds they make
_FRAGMENT = 0.3  # share of the median number of points below which a fold is joined to the one before
_AS_WELL = 1.02  # errors within this factor of the least are equally good, and fewer parameters come first
_CLEAR = 0.10  # by how much the error must be lower to be clearly lower, and...
_CONFIDENCE = 0.975  # ...quantile of Student's t for the standard errors by which the mean log ratio must exceed zero


@dataclass(frozen=True, eq=False)
class RankingEntry:
    """One class in a ranking.

    Attributes
    ----------
    fit : RivalFit          To all points.
    error : float           rms error on points held out, over all folds [N].
    errors : ndarray, shape (F,)   The same in each fold.
    """

    fit: RivalFit
    error: float
    errors: FloatArray

    @property
    def rival(self) -> Rival:
        """The class."""
        return self.fit.rival


@dataclass(frozen=True, eq=False)
class Ranking:
    """Classes of models by their error on what was held out.

    Attributes
    ----------
    entries : tuple of RankingEntry   Least error first, but of errors within 2 % of the least the one with the fewest
                                  parameters; classes without a possible model are missing.
    held_out : str                What was held out in turn: records, cycles, strokes or arcs of strokes.
    folds : int                   How many times.
    spread : float                Standard deviation of the force [N].
    floor : float                 Error below which classes are equally good [N].
    notes : tuple of str          Assumptions, in sentences.
    """

    entries: tuple[RankingEntry, ...]
    held_out: str
    folds: int
    spread: float
    floor: float
    notes: tuple[str, ...] = field(default=())

    @property
    def own(self) -> RankingEntry | None:
        """This program's class; None if no possible model of it was found."""
        return next((entry for entry in self.entries if entry.rival is OWN), None)

    def is_clearly_better(self, entry: RankingEntry) -> bool:
        """Whether a class is clearly better than this program's.

        The logarithm of the ratio of both errors is taken in each fold, errors below `floor` counting as `floor`. The
        class is clearly better if the mean of these says at least 10 % less error and exceeds zero by so many of its
        standard errors, from the scatter between the folds, as Student's t needs for 97.5 %.
        """
        reference = self.own
        if reference is None or entry is reference or reference.errors.size < 2:
            return False
        from scipy.stats import t

        gain = np.log(np.maximum(reference.errors, self.floor) / np.maximum(entry.errors, self.floor))
        standard_error = float(np.std(gain, ddof=1)) / np.sqrt(gain.size)
        quantile = float(t.ppf(_CONFIDENCE, gain.size - 1))
        return bool(gain.mean() >= max(-np.log(1.0 - _CLEAR), quantile * standard_error))

    @property
    def better(self) -> tuple[RankingEntry, ...]:
        """The classes that are clearly better than this program's, best first."""
        return tuple(entry for entry in self.entries if self.is_clearly_better(entry))

    @property
    def sentence(self) -> str:
        """The ranking in a sentence."""
        if self.own is None:
            return "No possible model of this program's class was found in the comparison with other classes."

        def share(entry: RankingEntry) -> str:
            return f"{100.0 * entry.error / self.spread:.2g} % of the force's standard deviation"

        place = self.entries.index(self.own) + 1
        others = [entry for entry in self.entries if entry is not self.own]
        text = f"Error on {self.held_out} held out: {share(self.own)}, place {place} of {len(self.entries)} classes"
        if not others:
            return f"{text}."
        best = f"the best other one, {others[0].rival.title}, has {share(others[0])}"
        clearly = "clearly less" if self.is_clearly_better(others[0]) else "not clearly less"
        return f"{text}; {best}{f', {clearly}' if place > 1 else ''}."


def rank(
    parts: Sequence[SteadyRecord],
    rivals: Sequence[Rival] = (OWN, *RIVALS),
    advance: Callable[[int], None] = lambda _: None,
) -> Ranking:
    """Fit every class to records and rank them by the error on what is held out in turn.

    Whole records are held out if there are three or more, otherwise whole cycles (five or more), strokes (four or
    more), or arcs of strokes. What is held out is judged where the rest has been, so that no polynomial is
    extrapolated; the displacement of the strokes held out still sets the memory of those that follow.

    Parameters
    ----------
    parts : sequence of SteadyRecord   Of an identification, without the effects of the rig that it took out.
    rivals : sequence of Rival
    advance : callable                 Called with the number of classes done so far.
    """
    track = Track.from_steady(parts)
    fold, what = folds(track)
    entries = []
    for k, rival in enumerate(rivals):
        entry = _entry(rival, track, fold)
        if entry is not None:
            entries.append(entry)
        advance(k + 1)
    notes = []
    if any(rival.needs_time for rival in rivals) and any(part.record.rising_time is None for part in parts):
        notes.append("Without rising times, velocities are taken from samples at equal intervals of time.")
    floor = force_floor(track.loops)
    spread = track.loops.force_deviation
    return Ranking(_sorted(entries, floor), what, int(fold.max()) + 1, spread, floor, tuple(notes))


def folds(track: Track) -> tuple[IndexArray, str]:
    """The fold of each point, shape (P,), and what a fold is made of."""
    loops = track.loops
    stroke = np.unique(loops.stroke, return_inverse=True)[1]
    if int(track.source[-1]) + 1 >= _RECORDS:
        return _at_most(np.unique(track.source, return_inverse=True)[1]), "records"
    strokes = int(stroke.max()) + 1
    if strokes >= 2 * _CYCLES:
        return _at_most(_without_fragments(stroke // 2)), "cycles"
    if strokes >= _STROKES:
        return _without_fragments(stroke), "strokes"
    arc = np.minimum((_ARCS * loops.travel / loops.length[loops.stroke]).astype(np.intp), _ARCS - 1)
    return (arc + stroke) % _ARC_FOLDS, "arcs of strokes"


def _without_fragments(fold: IndexArray) -> IndexArray:
    """Folds with few points joined to the one before, or to the one after the first."""
    count = np.bincount(fold)
    whole = count >= _FRAGMENT * np.median(count)
    return np.asarray(np.maximum(np.cumsum(whole) - 1, 0)[fold])


def _at_most(fold: IndexArray) -> IndexArray:
    """Folds joined to at most ten."""
    count = int(fold.max()) + 1
    return np.asarray(fold * min(count, _MOST_FOLDS) // count)


def _sorted(entries: Sequence[RankingEntry], floor: float) -> tuple[RankingEntry, ...]:
    enough = _AS_WELL * max(min((entry.error for entry in entries), default=0.0), floor)

    def place(entry: RankingEntry) -> tuple[float, ...]:
        return (0, entry.fit.parameters, entry.error) if entry.error <= enough else (1, entry.error, 0)

    return tuple(sorted(entries, key=place))


def _entry(rival: Rival, track: Track, fold: IndexArray) -> RankingEntry | None:
    """A class fitted to all points, and then to those of all folds but one in turn."""
    fits = fit_class(rival, track, fold)
    if not fits:
        return None
    loops = track.loops
    errors, squares, total = [], 0.0, 0.0
    for held in range(int(fold.max()) + 1):
        out = fold == held
        weight = np.where(out, 0.0, loops.weight)
        carried = RivalProblem(rival, fits[0].basis, track, weight).carried(fits)
        # A fit that does not dissipate without this fold has no prediction of its own: that of all points is kept.
        prediction = (carried or fits)[0].at_points(track)
        judged = out & _within(loops.displacement, loops.displacement[~out])
        if not judged.any():
            continue
        power = float(loops.weight[judged] @ (loops.force - prediction)[judged] ** 2)
        weights = float(loops.weight[judged].sum())
        errors.append(np.sqrt(power / weights))
        squares, total = squares + power, total + weights
    return RankingEntry(fits[0], float(np.sqrt(squares / max(total, 1e-300))), np.array(errors))


def _within(values: FloatArray, others: FloatArray) -> NDArray[np.bool_]:
    return np.asarray((values >= others.min()) & (values <= others.max()))
