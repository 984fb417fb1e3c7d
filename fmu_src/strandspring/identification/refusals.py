"""Which samples may be fitted, and records that no spring of this kind can have made: by direct tests, without a fit.

A spring absorbs energy, its force rises with the displacement, and its loading branch is above its unloading branch.
That is judged by the work of the force between the first and the last passage of a displacement, where whatever
depends on the displacement alone has done none, and by the mean branches of the full strokes.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..findings import IdentificationError, Outcome
from ..ground.gravity import STANDARD_GRAVITY
from ..kernel.arrays import BoolArray, FloatArray, IndexArray
from ..loops import strokes
from ..loops.strokes import noise_level, path_noise, turning_points
from ..records.record import Record
from .samples import REVERSAL

FULL = 0.9  # of the longest stroke, from which a stroke is a full one: tests repeat amplitudes more exactly
SURE = 4.0  # standard errors that chance does not reach in thousands of tests
RESOLVED = 5e-4  # of the range: noise above blurs reversals, and motion within four times that is a rest
_FEWEST = 8  # samples of a loop: noise turns after 1.5 samples and fills 3 or 4, smoothed noise twice as many
_TWICE = math.log(2.0)  # ratio of loops' figures that only units explain; a quarter of it is agreement
# Units that are mistaken for each other: column, how many of the second one the first is, and both.
_UNITS = (
    ("displacement", 1000.0, "m", "mm"), ("displacement", 25.4, "inches", "mm"), ("force", 1000.0, "kN", "N"),
    ("force", STANDARD_GRAVITY, "kgf", "N"), ("force", 4.4482216, "lbf", "N"),
)  # fmt: skip


class Strokes(strokes.Strokes):
    """A record cut at its reversals, and its usable samples.

    Clipped forces and dwells but for their first sample are not usable, nor is what is not selected.

    Attributes
    ----------
    record : Record
    usable, clipped, resting : ndarray of bool, shape (K,)
    dwells : list of (int, int)                   First and last sample of each rest within the test.
    noise, displacement_noise : float             Standard deviations of white noise [N], [m].
    """

    def __init__(self, record: Record) -> None:
        x = record.displacement
        super().__init__(x, turning_points(x, REVERSAL * float(np.ptp(x))))
        self.record, self.start = record, self.ends[:-1]
        self.noise = noise_level(record.force, self.turning[1:-1])
        # Samples that were written twice are no noise.
        written = x[np.append(True, (np.diff(x) != 0.0) | (np.diff(record.force) != 0.0))]
        self.displacement_noise = path_noise(written)
        self.clipped = clipped_samples(record.force)
        self.resting, self.dwells = self._rests()
        self.usable = ~self.clipped & ~self.resting & (True if record.compared is None else record.compared)

    def _rests(self) -> tuple[BoolArray, list[tuple[int, int]]]:
        """Samples of rests but their first, and `dwells`."""
        x, count = self.path, self.count
        # Dense records are thinned, or every step would look like a rest.
        stride = max(1, x.size // (200 * count))
        thinned, span = x[::stride], float(np.ptp(x))
        # In that share of a stroke's samples a sine still moves by four times what is a rest.
        window = max(_FEWEST, round(0.12 * thinned.size / count))
        still = 4.0 * RESOLVED * span + 2.0 * SURE * self.displacement_noise
        resting = np.zeros(x.size, bool)
        dwells: list[tuple[int, int]] = []
        # Noise of a hundredth of the range hides rests.
        if thinned.size <= window or 8.0 * still >= REVERSAL * span:
            return resting, dwells
        windows = sliding_window_view(thinned, window)
        rests = np.flatnonzero(windows.max(axis=1) - windows.min(axis=1) <= still)
        steps = np.abs(np.diff(thinned))
        step = float(np.min(steps[steps > 0.0]))
        away = [np.abs(x - end) > 4.0 * still for end in (x[0], x[-1])]
        moved = int(np.argmax(away[0])), x.size - 1 - int(np.argmax(away[1][::-1]))
        for run in np.split(rests, np.flatnonzero(np.diff(rests) > 1) + 1) if rests.size else []:
            begin, end = stride * int(run[0]), min(stride * int(run[-1] + window - 1), x.size - 1)
            stroke = int(self.of_sample[begin])
            moved_by = max(step, float(np.ptp(x[begin : end + 1]))) / float(self.length[stroke : stroke + 2].min())
            # A sine takes less than half of that for so much motion about its turning point.
            if end - begin >= math.acos(max(1.0 - 4.0 * moved_by, -1.0)) * x.size / count:
                resting[begin + 1 : end + 1] = True
                if moved[0] <= begin and end <= moved[1]:
                    dwells.append((begin, end))
        return resting, dwells

    @cached_property
    def begun(self) -> FloatArray:
        """Way from the start of the record to that of each stroke, shape (S,) [m]."""
        return np.asarray(np.cumsum(self.length) - self.length)

    @cached_property
    def way(self) -> FloatArray:
        """Way from the start of the record to each usable sample, never falling [m]."""
        of = self.of_sample
        travel = np.clip(self.direction[of] * (self.record.displacement - self.start[of]), 0.0, self.length[of])
        return np.asarray(np.maximum.accumulate(self.begun[of] + travel)[self.usable])

    def forces(self, strokes: IndexArray, travel: FloatArray) -> FloatArray:
        """Force of strokes at distances from their starts, without outliers, shape of `travel`, (T, P) [N]."""
        return np.interp(self.begun[strokes][:, None] + travel, self.way, self.smooth[self.usable])

    @cached_property
    def smooth(self) -> FloatArray:
        """The force by medians of three samples, where they are dense [N]."""
        r = self.record.force
        if self.samples_per_cycle < 4 * _FEWEST:
            return r
        return np.concatenate([r[:1], np.median([r[:-2], r[1:-1], r[2:]], axis=0), r[-1:]])

    def full(self, side: int) -> IndexArray:
        """Full strokes in a direction; of very many a part."""
        there = np.flatnonzero(self.direction == side)
        there = there[self.length[there] >= FULL * self.length[there].max(initial=0.0)]
        return np.asarray(there[:: max(1, there.size // 1000)])

    @cached_property
    def samples_per_cycle(self) -> float:
        """Median number of samples that move in two strokes, short ones and those that the record's ends cut aside."""
        moving = np.concatenate([[0], np.cumsum(np.diff(self.record.displacement) != 0.0)])
        whole = self.length >= 0.5 * self.length.max()
        if whole[1:-1].any():
            whole[[0, -1]] = False
        return 2.0 * float(np.median(np.diff(moving[self.turning])[whole]))

    @cached_property
    def loop(self) -> Loop:
        """Mean branches of the full strokes; of those that follow each other, if there are such, which form loops."""
        up, down = self.full(1), self.full(-1)
        paired = [a[np.isin(a + 1, b) | np.isin(a - 1, b)] for a, b in ((up, down), (down, up))]
        is_paired = min(side.size for side in paired) > 0
        if is_paired:
            up, down = paired
        low = max(self.start[up].max(), (self.start - self.length)[down].max())
        high = min(self.start[down].min(), (self.start + self.length)[up].min())
        if self.record.compared is not None:
            x = self.record.displacement[self.usable]
            low, high = max(low, x.min()), max(low, min(high, x.max()))
        grid = np.asarray(low + (high - low) * (np.arange(100) + 0.5) / 100.0, np.float64)
        loading = self.forces(up, grid - self.start[up][:, None])
        unloading = self.forces(down, self.start[down][:, None] - grid)
        return Loop(grid, loading.mean(axis=0), unloading.mean(axis=0), is_paired)


@dataclass(frozen=True, eq=False)
class Loop:
    """Mean branches on common displacements [m], [N]; `is_paired` if their strokes form loops."""

    displacement: FloatArray
    loading: FloatArray
    unloading: FloatArray
    is_paired: bool = True

    @property
    def height(self) -> float:
        """Mean distance of the branches [N]."""
        return float(np.mean(self.loading - self.unloading))

    def after_reversals(self, stroke: float) -> float:
        """Mean change of the force over a stroke [m] after the reversals [N]."""
        x = self.displacement
        up = np.interp(x[0] + stroke, x, self.loading) - self.loading[0]
        down = self.unloading[-1] - np.interp(x[-1] - stroke, x, self.unloading)
        return float(0.5 * (up + down))


def clipped_samples(force: FloatArray) -> BoolArray:
    """Samples at an extreme of the force that comes far more often than any other, as at the end of a sensor's range.

    A coarse sensor repeats every level, and a record without noise every force of a cycle; a sine that is digitised has
    about twice as many.
    """
    _, number, counts = np.unique(force, return_inverse=True, return_counts=True)
    ends = np.array([0, counts.size - 1])
    return np.isin(number, ends[counts[ends] > 3 * counts[1:-1].max(initial=1)])


def cut_all(records: Sequence[Record]) -> list[Strokes]:
    """Cut records into strokes.

    Raises
    ------
    IdentificationError   TOO_FEW_STROKES, TOO_FEW_SAMPLES, UNDERSAMPLED or TOO_LITTLE_LEFT.
    """
    parts = [Strokes(record) for record in records]
    longest = [[part.length[part.direction == side].max(initial=0.0) for side in (1.0, -1.0)] for part in parts]
    # With less of a way back, half a loop is unknown.
    goes_back = any(min(both) > 0.4 * max(both) for both in longest)
    for part in parts:
        if part.length.size < 2 or not goes_back:
            raise IdentificationError(Outcome.TOO_FEW_STROKES, part.record.path)
    left = sum(len(part.record) - 1 - int(part.turning[1]) for part in parts)
    if left < _FEWEST:
        where = ", ".join(record.path for record in records)
        raise IdentificationError(Outcome.TOO_FEW_SAMPLES, where, {"found": left, "needed": _FEWEST})
    for part in parts:
        if part.samples_per_cycle < _FEWEST:
            raise IdentificationError(Outcome.UNDERSAMPLED, part.record.path)
        sides = part.direction[part.of_sample[part.usable]]
        if min(np.count_nonzero(sides == side) for side in (1.0, -1.0)) < 2:
            raise IdentificationError(Outcome.TOO_LITTLE_LEFT, part.record.path)
    return parts


def work(record: Record, noise: float) -> tuple[float, float]:
    """Work of the force from the first to the last passage of a displacement, and what may be none of it [J].

    Nothing that depends on the displacement alone does work on that path. The displacement is that of the middle of the
    range.
    """
    x, r = record.displacement, record.force
    middle = 0.5 * float(x.min() + x.max())
    passes = np.flatnonzero((x[1:] >= middle) != (x[:-1] >= middle))
    if passes.size < 2:
        return 0.0, math.inf
    first, last = int(passes[0]), int(passes[-1])
    ends = [r[k] + (middle - x[k]) / (x[k + 1] - x[k]) * (r[k + 1] - r[k]) for k in (first, last)]
    steps = np.diff(x[first + 1 : last + 1], prepend=middle, append=middle)
    force = np.concatenate([ends[:1], r[first + 1 : last + 1], ends[1:]])
    # Rounding of columns makes loops of a ten-thousandth of the force.
    doubt = SURE * noise * float(np.linalg.norm(steps)) + 1e-4 * float(np.ptp(r)) * float(np.abs(steps).sum())
    return float(0.5 * (force[1:] + force[:-1]) @ steps), doubt


def backwards(part: Strokes) -> Outcome | None:
    """Why a record gives energy away: FORCE_REVERSED or COLUMNS_SWAPPED; None if it does not."""
    energy, doubt = work(part.record, part.noise)
    if energy >= -doubt:
        return None
    return Outcome.FORCE_REVERSED if correlation(part.record) < 0.0 else Outcome.COLUMNS_SWAPPED


def correlation(record: Record) -> float:
    """Correlation of displacement and force [-], of the record or of what is selected, whichever is larger.

    In a narrow range the hysteresis decides on it, and outside the range the force may snap through.
    """
    kept = np.ones(len(record), bool) if record.compared is None else record.compared
    found = []
    for x, r in ((record.displacement, record.force), (record.displacement[kept], record.force[kept])):
        if x.size and np.ptp(x) and np.ptp(r):
            found.append(float(np.corrcoef(x, r)[0, 1]))
    return max(found, default=0.0)


def impossible(part: Strokes) -> IdentificationError | None:
    """Why no spring can have made a record."""
    record, loop = part.record, part.loop
    span = float(max(np.ptp(loop.loading), np.ptp(loop.unloading)))
    # Rise and fall within one branch: a snap is both, whatever the sign convention, and larger than sensors' errors.
    least = 0.2 * max(span, 3.0 * abs(loop.height))
    pieces = [slice(part.turning[k], part.turning[k + 1] + 1) for side in (1, -1) for k in part.full(side)]
    # Noise reaches four standard deviations to either side. A snap is two such turns.
    turns = max(least, 2.0 * SURE * part.noise)
    if np.median([turning_points(part.smooth[piece], turns).size - 2 for piece in pieces]) >= 4:
        return IdentificationError(Outcome.STICK_SLIP, record.path)
    for branch in (loop.loading, loop.unloading):
        falls, rises = np.maximum.accumulate(branch) - branch, branch - np.minimum.accumulate(branch)
        if min(falls.max(), rises.max()) > least:
            return IdentificationError(Outcome.SNAP_THROUGH, record.path)
    if correlation(record) < -0.5:
        return IdentificationError(Outcome.FORCE_REVERSED, record.path)
    energy, doubt = work(record, part.noise)
    if abs(energy) <= doubt < math.inf:
        return IdentificationError(Outcome.NO_LOOP, record.path)
    if (outcome := backwards(part)) is not None:
        time = record.rising_time
        lag = _least_lag(record, time) if outcome is Outcome.COLUMNS_SWAPPED and time is not None else 0.0
        return IdentificationError(outcome, record.path, {"lag": lag} if lag > 0.0 else {})
    crossed = loop.unloading > loop.loading + max(SURE * part.noise, 0.02 * span)
    # Where they are crossed on less of the range, a fit with FA >= 0 follows.
    return IdentificationError(Outcome.BRANCHES_CROSS, record.path) if loop.is_paired and crossed.mean() > 0.1 else None


def _least_lag(record: Record, time: FloatArray) -> float:
    """The lag of the force that makes its loops vanish [s].

    A force of stiffness k that lags by d does the work -k d v dx, with the velocity v, on a step dx.
    """
    x, r, steps = record.displacement, record.force, np.diff(record.displacement)
    line = np.polynomial.Polynomial.fit(x, r, 1)
    left = r - line(x)
    lost = float(0.5 * (left[1:] + left[:-1]) @ steps)
    return float(-lost / (line.deriv()(0.0) * np.sum(steps**2 / np.diff(time))))


def differing_units(parts: Sequence[Strokes]) -> IdentificationError | None:
    """The record that agrees with most others only after a factor between units; of two the second."""
    loops = [part.loop for part in parts]
    # Of records in a circle by their range each is compared with both neighbours.
    order = sorted(range(len(parts)), key=lambda k: float(np.ptp(loops[k].displacement)))
    pairs = dict.fromkeys([*pairwise([*order, order[0]]), *pairwise([order[0], *order[::-1]])])
    mistaken = {pair: found for pair in pairs if (found := _factor_between(*(loops[k] for k in pair)))}
    if not mistaken:
        return None
    votes = Counter(k for k, _ in mistaken)
    k, other = max(mistaken, key=lambda pair: (votes[pair[0]], pair[0]))
    column, factor, read = mistaken[k, other]
    numbers = {"column": column, "factor": factor, "read": read, "other": parts[other].record.path}
    return IdentificationError(Outcome.UNITS_DIFFER, parts[k].record.path, numbers)


def _unlike(loop: Loop, other: Loop) -> tuple[float, float]:
    """Least and largest logarithm of the ratios of two loops' figures: height, and the force after a reversal.

    The force after a reversal hardly depends on the amplitude; the height does, and counts at like amplitudes only.
    """
    spans = [float(np.ptp(each.displacement)) for each in (loop, other)]
    if not min(spans):
        return 0.0, math.inf
    pairs = [(loop.after_reversals(FULL * min(spans)), other.after_reversals(FULL * min(spans)))]
    if FULL**2 * max(spans) <= min(spans):
        pairs.append((loop.height, other.height))
    ratios = [abs(math.log(a / b)) if min(a, b) > 0.0 else math.inf for a, b in pairs]
    return min(ratios), max(ratios) if len(ratios) > 1 else math.inf


def _factor_between(loop: Loop, other: Loop) -> tuple[str, float, str] | None:
    """Column, factor and units that correct a loop which does not agree with another one at all, if anything does."""
    if _unlike(loop, other)[0] <= _TWICE:
        return None
    fitting = []
    for column, size, large, small in _UNITS:
        for factor, units in ((size, f"{large} read as {small}"), (1.0 / size, f"{small} read as {large}")):
            of_x, of_r = (factor, 1.0) if column == "displacement" else (1.0, factor)
            corrected = Loop(of_x * loop.displacement, of_r * loop.loading, of_r * loop.unloading)
            least, largest = _unlike(corrected, other)
            apart = abs(math.log(np.ptp(corrected.displacement) / np.ptp(other.displacement)))
            # Nothing but a unit makes a factor of 1000; loops of other amplitudes may differ much otherwise.
            if largest < 0.25 * _TWICE or (size == 1000.0 and least < 2.0 * _TWICE):
                fitting.append((apart + least, (column, factor, units)))
    return min(fitting)[1] if fitting else None
