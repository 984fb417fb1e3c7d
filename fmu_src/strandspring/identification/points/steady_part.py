"""Which part of a record is steady, and whether a physically possible spring can have made it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ...loops.noise_levels import least_reversal, noise_level
from ...loops.strokes import Strokes, find_strokes
from ...loops.turning import turning_points
from ...model.outcomes import IdentificationError, Outcome
from ...records.record import Record
from .direction import correlation, least_lag, wrong_way
from .sample_points import POINTS_PER_STROKE, SamplePoints, gather
from .usable import usable_samples

_SHARES = (np.arange(100) + 0.5) / 100  # of the common range, where the mean loop is taken
_INSIDE = np.linspace(0.05, 0.95, 64)  # where strokes are compared, shares of their lengths
_FULL = 0.9  # share of the longest stroke from which a stroke counts as a full one
_AVERAGED = 1000  # full strokes in a direction that are enough for a mean
_RETURN = 0.4  # share of the longest stroke that must be gone back at least
_SNAP = 0.2  # counter-movement of the force within a branch, share of its range
_CHATTER = 4  # turns of the force within a stroke from which it is stick-slip
_NO_LOOP = 1e-4  # half height of a loop that is called none, share of the force range
_CROSSED = 0.1  # share of the displacement range over which the branches may be crossed
_ALIKE = 0.015  # difference between two strokes that is called none, share of the force range
_LEAST_LEFT = 2  # samples of each branch that make a loop
# What a spring cannot do, but the records of one with a delay between the columns may show.
_LIKE_DELAYS = (Outcome.COLUMNS_SWAPPED, Outcome.BRANCHES_CROSS, Outcome.SNAP_THROUGH)
_UNEVEN = 1.5  # longest step of the time in the usual one of a record that is sampled evenly
_NOISY = 5e-4  # noise of the displacement that is reported, share of its range


@dataclass(frozen=True, eq=False)
class SteadyRecord:
    """A record cut into strokes with its steady part marked.

    Attributes
    ----------
    record : Record
    strokes : Strokes        Of the whole record.
    first_used : int         First stroke of the steady part.
    loops : SamplePoints     Points of the steady part, without a known delay; memory strokes included.
    periodic : bool          The record is one closed period.
    cautions : dict          Outcomes with their details, which may be empty.
    used : ndarray of bool, shape (K,)   Samples that are fitted; the others belong to the path only.
    refusal : IdentificationError or None   Why no spring can have made the record, unless there is a delay.
    """

    record: Record
    strokes: Strokes
    first_used: int
    loops: SamplePoints
    periodic: bool
    cautions: dict[Outcome, str]
    used: NDArray[np.bool_]
    refusal: IdentificationError | None = None

    def loops_with(self, points: int) -> SamplePoints:
        """The points again, strokes averaged over another number of cells."""
        if points not in self._by_points:
            self._by_points[points] = _points_of(
                self.record, self.strokes, self.first_used, self.periodic, points, self.used
            )
        return self._by_points[points]

    def turning_between_samples(self, corners: bool) -> SteadyRecord:
        """The same record with reversals between its samples; a single period as it is."""
        return self if self.periodic else replace(self, strokes=self.strokes.turning_between_samples(corners))

    @cached_property
    def _by_points(self) -> dict[int, SamplePoints]:
        return {}

    def all_samples(self) -> SamplePoints:
        """Every sample of the record as a point, those before the steady part too."""
        return gather(self.strokes, self.record.force, 0, len(self.record), np.ones(len(self.record), dtype=bool))

    @property
    def is_even(self) -> bool:
        """Whether samples follow each other evenly, as far as times tell."""
        if self.record.time is None:
            return True
        steps = np.diff(self.record.time)
        return bool(steps.min() >= 0.0 and steps.max() <= _UNEVEN * np.mean(steps))

    @property
    def cycle_time(self) -> float | None:
        """Duration of a cycle of even samples [s]; None without times."""
        time = self.record.time
        return None if time is None else self.strokes.period * float(time[-1] - time[0]) / (time.size - 1)

    @property
    def first_sample(self) -> int:
        """Index of the first steady sample."""
        return int(self.strokes.turning[self.first_used])


def find_steady_part(record: Record, delay: float = 0.0, seeks_delay: bool = False) -> SteadyRecord:
    """Cut a record into strokes, choose its steady part and refuse what no spring of this kind can do.

    Parameters
    ----------
    record : Record
    delay : float        By which the force is known to lag [s]; needs times.
    seeks_delay : bool   What a delay could explain is kept as `refusal`, not raised.

    Raises
    ------
    IdentificationError   With the outcome that names the reason.
    """
    strokes = find_strokes(record.displacement)
    # Constant, or so coarse that all of it is taken for noise.
    if not strokes.length.max():
        raise _no_cycle(record)
    used, cautions = usable_samples(record, strokes)
    noise = strokes.noise / float(np.ptp(record.displacement))
    if noise > _NOISY:
        cautions[Outcome.DISPLACEMENT_NOISE] = f"standard deviation {100.0 * noise:.2g} % of the range"
    in_step = synchronised(record, delay)
    if delay and record.time is not None:
        # The force of the other samples arose before the record, or after it.
        moment = record.time - delay
        used = used & (moment >= record.time[0]) & (moment <= record.time[-1])
    periodic = strokes.count in (2, 3) and _is_closed(in_step, strokes)
    first_used = 0 if periodic else _first_steady_stroke(strokes, in_step, cautions)
    left = strokes.direction[strokes.of_sample[used & (strokes.of_sample >= first_used)]]
    loops = _points_of(in_step, strokes, first_used, periodic, POINTS_PER_STROKE, used)
    # A period that is followed by itself may have fewer reversals than alone.
    for directions, least in ((left, _LEAST_LEFT), (loops.direction[loops.stroke], 1)):
        if min(np.count_nonzero(directions == side) for side in (1, -1)) < least:
            raise IdentificationError(Outcome.TOO_LITTLE_LEFT, record.path)
    refusal = None
    try:
        _refuse_impossible(in_step, loops, strokes)
    except IdentificationError as error:
        if not seeks_delay or error.outcome not in _LIKE_DELAYS:
            raise
        refusal = error
    return SteadyRecord(record, strokes, first_used, loops, periodic, cautions, used, refusal)


def synchronised(record: Record, delay: float) -> Record:
    """The record with the force interpolated at the moments of the displacement.

    Parameters
    ----------
    record : Record
    delay : float     By which the force lags [s]; 0 without times.
    """
    if not delay or record.time is None:
        return record
    return replace(record, force=np.interp(record.time + delay, record.time, record.force))


@dataclass(frozen=True, eq=False)
class MeanLoop:
    """Mean branches of the full strokes on common cells of displacement [m], [N]."""

    displacement: FloatArray
    loading: FloatArray
    unloading: FloatArray

    @property
    def half_height(self) -> float:
        """Mean of half the distance between the branches [N]; negative if the loop runs the wrong way round."""
        return float(np.mean(self.loading - self.unloading)) / 2.0


def mean_loop(loops: SamplePoints, among: NDArray[np.intp] | None = None) -> MeanLoop:
    """Average the full strokes, of very many a part, on common displacements, loading and unloading apart.

    Parameters
    ----------
    loops : SamplePoints
    among : ndarray of int, shape (T,), or None   Strokes with points, of either direction; all if None.
    """
    used = loops.used if among is None else among
    chosen = []
    for side in (1, -1):
        strokes = used[loops.direction[used] == side]
        full = strokes[loops.length[strokes] >= _FULL * loops.length[strokes].max()]
        chosen.append(full[:: max(1, full.size // _AVERAGED)])
    both = np.concatenate(chosen)
    ends = np.stack([loops.start[both], loops.start[both] + loops.direction[both] * loops.length[both]])
    low, high = max(loops.selected[0], ends.min(axis=0).max()), min(loops.selected[1], ends.max(axis=0).min())
    grid = low + (high - low) * _SHARES
    branches = []
    for side, strokes in zip((1, -1), chosen, strict=True):
        pieces = [slice(*np.searchsorted(loops.stroke, [stroke, stroke + 1])) for stroke in strokes]
        profiles = [np.interp(grid, loops.displacement[p][::side], loops.force[p][::side]) for p in pieces]
        branches.append(np.mean(profiles, axis=0))
    return MeanLoop(grid, *branches)


def _paired(loops: SamplePoints) -> NDArray[np.intp]:
    """Full strokes that follow each other and so form loops; of different cycles they need not meet."""
    used = loops.used
    full = used[loops.length[used] >= _FULL * loops.length[used].max()]
    follows = np.diff(full) == 1
    return np.asarray(np.union1d(full[:-1][follows], full[1:][follows]))


def _is_closed(record: Record, strokes: Strokes) -> bool:
    """Whether the record is one whole period: it ends where it began, in displacement and force."""
    x, r = record.displacement, record.force
    step = 3.0 * float(np.max(np.abs(np.diff(strokes.displacement))))
    noise = 6.0 * noise_level(r, strokes.turning[1:-1])
    # The last sample may stop one step short of the first.
    missing = abs(float(r[-1] - r[-2])) + abs(float(r[1] - r[0]))
    return bool(
        abs(x[-1] - x[0]) <= max(step, 0.01 * np.ptp(x))
        and abs(r[-1] - r[0]) <= max(noise, _ALIKE * np.ptp(r), missing)
    )


def _points_of(
    record: Record, strokes: Strokes, first_used: int, periodic: bool, points: int, used: NDArray[np.bool_]
) -> SamplePoints:
    if periodic:
        loops = _closed_loops(record, strokes, points, used)
    else:
        loops = gather(strokes, record.force, first_used, points, used)
    if record.compared is None:
        return loops
    within = strokes.displacement[record.compared]
    return replace(loops, selected=(float(within.min()), float(within.max())))


def _closed_loops(record: Record, strokes: Strokes, points: int, used: NDArray[np.bool_]) -> SamplePoints:
    """One period, begun at its first reversal and preceded by itself, so that the memory is steady."""
    turn = 0 if strokes.count == 2 else int(strokes.turning[1])
    order = np.concatenate([np.arange(turn, len(record.force)), np.arange(1, turn + 1)])
    if turn == 0:
        order = order[: len(record.force)]
    twice = np.concatenate([order, order[1:]])
    repeated = find_strokes(record.displacement[twice])
    return gather(repeated, record.force[twice], 2, points, used[twice])


def _first_steady_stroke(strokes: Strokes, record: Record, cautions: dict[Outcome, str]) -> int:
    """First stroke of the steady part: not the very first, whose memory is unknown, if the others suffice."""
    differs = [_difference(strokes, record.force, k) > _ALIKE * float(np.ptp(record.force)) for k in (0, 1)]
    if any(differs):
        cautions[Outcome.FIRST_CYCLE_DIFFERS] = ""
    # If the second stroke differs from its successor, the first cycle reaches into it.
    for first in (2, 1, 0) if differs[1] else (1, 0):
        if _goes_forth_and_back(strokes, first):
            return first
    raise _no_cycle(record)


def _no_cycle(record: Record) -> IdentificationError:
    """The refusal of a path without a cycle, or with one that is taken for noise."""
    strokes = find_strokes(record.displacement, least_reversal(record.displacement))
    is_cycle = strokes.length.max() > 0.0 and _goes_forth_and_back(strokes, 0)
    return IdentificationError(Outcome.UNDERSAMPLED if is_cycle else Outcome.TOO_FEW_STROKES, record.path)


def _goes_forth_and_back(strokes: Strokes, first: int) -> bool:
    """Whether the strokes from `first` on hold a full one and a good part of one the other way."""
    length = strokes.length[first:] / float(strokes.length.max())
    direction = strokes.direction[first:]
    reach = [float(np.max(length[direction == side], initial=0.0)) for side in (1, -1)]
    return max(reach) >= _FULL and min(reach) >= _RETURN


def _difference(strokes: Strokes, force: FloatArray, k: int) -> float:
    """rms difference between stroke k and the next one of its kind, beyond what later cycles differ by [N]."""

    def difference(a: int, b: int) -> float:
        if b >= strokes.count:
            return 0.0
        ends = strokes.turning_displacement
        tolerance = 0.02 * float(strokes.length.max())
        if abs(ends[a + 1] - ends[b + 1]) > tolerance or abs(ends[a] - ends[b]) > tolerance:
            return 0.0
        profiles = []
        for stroke in (a, b):
            piece = slice(strokes.turning[stroke], strokes.turning[stroke + 1] + 1)
            grid = _INSIDE * strokes.length[stroke]
            distance = np.abs(strokes.displacement[piece] - ends[stroke])
            profiles.append(np.interp(grid, distance, force[piece]))
        return float(np.sqrt(np.mean((profiles[0] - profiles[1]) ** 2)))

    return difference(k, k + 2) - 2.0 * difference(k + 2, k + 4)


def _refuse_impossible(record: Record, loops: SamplePoints, strokes: Strokes) -> None:
    mean, reversals = mean_loop(loops), strokes.turning[1:-1]

    def refuse(outcome: Outcome, detail: str = "") -> None:
        raise IdentificationError(outcome, record.path, detail)

    span = float(max(np.ptp(mean.loading), np.ptp(mean.unloading)))
    # Rise and fall within one branch: a snap is both, whatever the sign convention of the columns.
    least = _SNAP * max(span, 6.0 * abs(mean.half_height))
    for branch in (mean.loading, mean.unloading):
        fall = float(np.max(np.maximum.accumulate(branch) - branch))
        rise = float(np.max(branch - np.minimum.accumulate(branch)))
        if min(rise, fall) > least:
            refuse(Outcome.STICK_SLIP if _most_turns(record, strokes, least) >= _CHATTER else Outcome.SNAP_THROUGH)
    height = mean.half_height
    noise = noise_level(record.force, reversals)
    if correlation(record) < -0.5:
        refuse(Outcome.FORCE_REVERSED)
    if abs(height) <= max(4.0 * noise / np.sqrt(record.force.size), _NO_LOOP * span):
        refuse(Outcome.NO_LOOP)
    paired = _paired(loops)
    if not paired.size:  # the amplitude changes all the time
        return
    closed = mean_loop(loops, among=paired)
    height = closed.half_height
    if height < 0.0:
        outcome, lag = wrong_way(record), least_lag(record)
        lags = outcome is Outcome.COLUMNS_SWAPPED and lag is not None and lag > 0.0
        refuse(outcome, f" If the force lags, then by more than {1e3 * (lag or 0.0):.3g} ms." if lags else "")
    crossed = closed.unloading > closed.loading + max(4.0 * noise, 0.02 * span)
    if np.mean(crossed) > _CROSSED:
        refuse(Outcome.BRANCHES_CROSS)


def _most_turns(record: Record, strokes: Strokes, least: float) -> int:
    """Turns of the force by `least` [N] within the stroke that has most; the mean of several blurs them."""
    pieces = (slice(strokes.turning[k], strokes.turning[k + 1] + 1) for k in range(strokes.count))
    return max(turning_points(record.force[piece], least).size - 2 for piece in pieces)
