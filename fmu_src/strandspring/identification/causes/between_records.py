"""How the steady loops of one spring differ between records and between frequencies, by their figures alone.

Loops of one amplitude are compared, so that no model is needed. What changes within a record as much as from one to the
next is wear and is left to the effects of the rig; so is a height that grows linearly with the frequency while the
stiffness stays, as a delay and viscous damping have it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ...loops.cycles import Cycle, find_cycles
from ...loops.loop import group_by_amplitude
from ...loops.strokes import find_strokes
from ...model.outcomes import Outcome
from ...records.record import Record
from ..rig.effect_columns import Effect

_LEAST = 0.03  # difference that is reported, share of the height or of the stiffness
_SURE = 3.0  # standard errors
_SAME_FREQUENCY = 1.1  # frequencies within this factor count as one
_CURVED = 4.0  # change of figures that differences between turning points make, in theirs
_CLEARER = 2.0  # misfit of the worse of two laws in that of the better
_EXACT = 0.01  # deviation from a law up to which it is followed
_FOLLOWED = 0.05  # the same as a share of the change by the law
_ALONE = 4.0  # times the differences among the others by which one record differs from all
_ALONG = np.linspace(0.05, 0.95, 31)  # where the stiffness is taken, shares of the stroke
_LIKE_RATES = (Effect.DELAY, Effect.VISCOSITY, Effect.FRICTION_WEAR, Effect.STIFFNESS_WEAR)
_LIKE_STEPS = (*_LIKE_RATES, Effect.PLAY, Effect.DRIFT, Effect.CURVED_DRIFT)


@dataclass(frozen=True)
class RecordDifference:
    """A difference between loops that should be alike.

    Attributes
    ----------
    outcome : Outcome             RECORDS_DIFFER, INERTIA or RATE_DEPENDENT.
    size : float                  Relative change of height or stiffness [-]; of INERTIA the moving mass [kg].
    error : float                 Its standard error.
    detail : str                  In words.
    forbidden : tuple of Effect   Which effects of a rig it would be taken for.
    """

    outcome: Outcome
    size: float
    error: float
    detail: str
    forbidden: tuple[Effect, ...]


@dataclass(frozen=True, eq=False)
class _Figure:
    """Height or stiffness of all groups less the mean of their amplitude, relative to it.

    Attributes
    ----------
    value, error : ndarray, shape (G,)   As measured, and its standard error [-].
    gradual : (float, float)             Change in a cycle within the records, and its standard error [-].
    """

    value: FloatArray
    error: FloatArray
    gradual: tuple[float, float]


def differences(records: Sequence[Record]) -> list[RecordDifference]:
    """What differs between records or frequencies at like amplitudes, significantly and by more than 3 %.

    Parameters
    ----------
    records : sequence of Record   Of one spring, in the order of the test.
    """
    compared = _Compared.from_groups(*_groups(records))
    if compared is None:
        return []
    of_stiffness, of_height, turned = _of_the_rate(compared)
    alone = None if turned else _one_alone(compared, records)
    return [difference for difference in (of_stiffness or alone or of_height,) if difference is not None]


def _groups(records: Sequence[Record]) -> tuple[FloatArray, FloatArray]:
    """Cycles by record, amplitude and frequency, and relative changes from cycle to cycle of each.

    There are no groups where a loop runs the wrong way round.

    Returns
    -------
    ndarray, shape (G, 9)   Number of record and of amplitude, frequency [Hz] (0 without times), stroke [m], mean place
                            among the cycles of all records, height [N], stiffness [N/m], and their standard errors.
    ndarray, shape (C, 3)   Changes of height and stiffness, and over how many cycles.
    """
    cycles = [(k, cycle) for k, record in enumerate(records) for cycle in find_cycles(record) if cycle.gap == 0.0]
    strokes = [find_strokes(record.displacement) for record in records]
    begun = np.cumsum([0.0, *(0.5 * strokes_of_record.count for strokes_of_record in strokes)])
    place = {id(c): begun[k] + 0.5 * float(np.searchsorted(strokes[k].turning, c.first_sample)) for k, c in cycles}
    number = {id(cycle): k for k, cycle in cycles}
    groups, changes = [], []
    for amplitude, members in enumerate(group_by_amplitude([cycle for _, cycle in cycles])):
        ordered = sorted(members, key=lambda cycle: (number[id(cycle)], _rate(cycle), cycle.first_sample))
        for (record, _), some in groupby(ordered, key=lambda cycle: (number[id(cycle)], _rate(cycle))):
            alike = list(some)
            values = np.array([[cycle.figures.height, _stiffness(cycle)] for cycle in alike])
            mean = values.mean(axis=0)
            if mean.min() <= 0.0:
                return np.empty((0, 9)), np.empty((0, 3))
            places = np.array([place[id(cycle)] for cycle in alike])
            changes += [(*(b / a - 1.0), far) for a, b, far in zip(values, values[1:], np.diff(places), strict=False)]
            scatter = np.std(values, axis=0, ddof=1) if len(alike) > 1 else np.zeros(2)
            error = np.maximum(_errors(alike), scatter) / math.sqrt(len(alike))
            rates = [cycle.frequency or 0.0 for cycle in alike]
            stroke = float(np.mean([cycle.figures.stroke for cycle in alike]))
            groups.append([record, amplitude, np.mean(rates), stroke, places.mean(), *mean, *error])
    return np.array(groups).reshape(-1, 9), np.array(changes).reshape(-1, 3)


def _rate(cycle: Cycle) -> int:
    """Number of the class of a cycle's frequency."""
    return -1000 if cycle.frequency is None else round(math.log(cycle.frequency) / math.log(_SAME_FREQUENCY))


def _errors(cycles: Sequence[Cycle]) -> FloatArray:
    """What noise makes of height [N] and stiffness [N/m] of one cycle, about: both are means over its samples."""
    samples = float(np.mean([cycle.last_sample - cycle.first_sample for cycle in cycles]))
    noise = float(np.mean([cycle.noise for cycle in cycles])) / math.sqrt(samples)
    stroke = float(np.mean([cycle.figures.stroke for cycle in cycles]))
    return noise * np.array([2.5, 4.0 / stroke])


def _stiffness(cycle: Cycle) -> float:
    """Slope of the line through both branches [N/m], which noise changes far less than the one through their ends."""
    low, high = cycle.figures.low, cycle.figures.high
    cells = low + (high - low) * _ALONG
    force = cycle.loading.profile(cells)[0] + cycle.unloading.profile(cells)[0]
    return float(0.5 * force @ (_ALONG - 0.5) / ((_ALONG - 0.5) @ (_ALONG - 0.5)) / (high - low))


@dataclass(frozen=True, eq=False)
class _Compared:
    """Groups that share their amplitude with another record or frequency.

    Attributes
    ----------
    amplitude : ndarray of int, shape (G,)
    place : ndarray, shape (G,)              Number of the cycle in the test, less the mean of the amplitude.
    frequency : ndarray, shape (G,)          [Hz]
    record : ndarray of int, shape (G,)
    height, stiffness : _Figure
    apart : float                            Largest difference between strokes that count as equal, share of them.
    loss : float                             Height over stiffness and stroke [-].
    scale : float                            Mean stiffness [N/m].
    """

    amplitude: NDArray[np.intp]
    place: FloatArray
    frequency: FloatArray
    record: NDArray[np.intp]
    height: _Figure
    stiffness: _Figure
    apart: float
    loss: float
    scale: float

    @classmethod
    def from_groups(cls, groups: FloatArray, changes: FloatArray) -> _Compared | None:
        """None where there is nothing to compare; arguments as `_groups` returns them."""
        counts = np.bincount(groups[:, 1].astype(np.intp))
        kept = groups[counts[groups[:, 1].astype(np.intp)] > 1]
        if not kept.size or not changes.size:
            return None
        record, _, frequency, strokes, place, heights, stiffnesses, *errors = kept.T
        _, amplitude = np.unique(kept[:, 1], return_inverse=True)
        figures = []
        for k, (values, error) in enumerate(zip((heights, stiffnesses), errors, strict=True)):
            mean = (np.bincount(amplitude, values) / np.bincount(amplitude))[amplitude]
            gradual = _gradual(changes[:, k], changes[:, 2], float(np.mean(error / mean)))
            figures.append(_Figure(values / mean - 1.0, np.maximum(error / mean, 0.1 * _EXACT), gradual))
        height, stiffness = figures
        return cls(
            amplitude,
            _centred(place, amplitude),
            frequency,
            record.astype(np.intp),
            height,
            stiffness,
            apart=float(np.max(np.abs(_centred(strokes, amplitude)) / strokes)),
            loss=float(np.mean(heights / (stiffnesses * strokes))),
            scale=float(np.mean(stiffnesses)),
        )

    def coefficient(self, figure: _Figure, law: FloatArray) -> tuple[float, float, float]:
        """Coefficient of a law, its standard error, and the rms that it leaves alone.

        The law stands beside a constant for each amplitude, and beside a gradual change that is known from the cycles
        within the records, with its error; what it needs that change for is not counted.

        Parameters
        ----------
        figure : _Figure
        law : ndarray, shape (G,)   The law at the groups.
        """
        slope, doubt = figure.gradual
        weight = 1.0 / figure.error**2
        x, place, y = (_centred(values, self.amplitude, weight) for values in (law, self.place, figure.value))
        scale = max(float(np.max(np.abs(x))), 1e-300)
        rows = np.vstack([np.stack([x / scale, place], axis=1) / figure.error[:, None], [[0.0, 1.0 / doubt]]])
        right = np.append(y / figure.error, slope / doubt)
        matrix = np.linalg.pinv(rows.T @ rows)
        both = matrix @ (rows.T @ right)
        left = right - rows @ both
        freedom = max(1, y.size - int(self.amplitude.max()) - 2)
        error = math.sqrt(max(1.0, float(left @ left) / freedom) * matrix[0, 0]) / scale
        alone = float((weight * x) @ y / max(float(weight @ x**2), 1e-300))
        return _lesser(float(both[0]) / scale, alone), error, float(np.sqrt(np.mean((y - alone * x) ** 2)))


def _lesser(first: float, other: float) -> float:
    """The smaller of two changes; 0 if their signs differ."""
    return min(first, other, key=abs) if first * other > 0.0 else 0.0


def _centred(values: FloatArray, group: NDArray[np.intp], weight: FloatArray | None = None) -> FloatArray:
    """Values less the weighted mean of their group."""
    weight = np.ones(values.size) if weight is None else weight
    return np.asarray(values - (np.bincount(group, weight * values) / np.bincount(group, weight))[group])


def _gradual(changes: FloatArray, far: FloatArray, error: float) -> tuple[float, float]:
    """Change in a cycle by those from one cycle of a record to the next, and its standard error.

    Parameters
    ----------
    changes, far : ndarray, shape (C,)   Relative changes [-], and over how many cycles.
    error : float                        Of a mean of some cycles [-].
    """
    slope = float(changes @ far / (far @ far))
    left = float(np.sqrt(np.sum((changes - slope * far) ** 2) / max(1, changes.size - 1)))
    return slope, max(left, 2.0 * error) / math.sqrt(float(far @ far))


def _one_alone(compared: _Compared, records: Sequence[Record]) -> RecordDifference | None:
    """The record whose loops differ from those of all others, which are alike; or of two of one frequency the second.

    Where the frequencies differ, at least two others must show that the frequency does not matter.
    """
    candidates: list[RecordDifference] = []
    for name, figure in (("height of the loops", compared.height), ("stiffness", compared.stiffness)):
        for number in np.unique(compared.record):
            of_record = compared.record == number
            shared = np.isin(compared.amplitude, compared.amplitude[of_record])
            others = shared & ~of_record
            if not others.any() or (number == 0 and np.unique(compared.record[shared]).size == 2):
                continue
            rates = compared.frequency[shared]
            one_rate = rates.max() <= _SAME_FREQUENCY * max(rates.min(), 1e-300) or rates.max() == 0.0
            if not one_rate and np.unique(compared.record[others]).size < 2:
                continue
            step, error, left = compared.coefficient(figure, of_record.astype(np.float64))
            least = max(_LEAST + _CURVED * compared.apart, _SURE * error, _ALONE * left)
            if abs(step) > least:
                path = PurePath(records[number].path).name
                text = f"{name} in {path} {_more(step)} than in the others"
                candidates.append(RecordDifference(Outcome.RECORDS_DIFFER, step, error, text, _LIKE_STEPS))
    return max(candidates, key=lambda difference: abs(difference.size), default=None)


def _more(size: float) -> str:
    return f"{100.0 * abs(size):.2g} % {'higher' if size > 0.0 else 'lower'}"


def _turned(compared: _Compared) -> float:
    """Change of the height by the frequency as a share of the elastic force's range; 0 if it is small or not linear."""
    size, left = 0.0, 0.0
    for amplitude in np.unique(compared.amplitude):
        at_amplitude = compared.amplitude == amplitude
        f, height = compared.frequency[at_amplitude], compared.height.value[at_amplitude]
        if f.size > 1 and np.ptp(f) > 0.0:
            slope, level = np.polyfit(f, height, 1).tolist()
            size = max(size, abs(slope) * float(np.ptp(f)))
            left = max(left, float(np.max(np.abs(height - level - slope * f))))
    return size * compared.loss if size > _LEAST and left < max(_EXACT, _FOLLOWED * size) else 0.0


def _of_the_rate(compared: _Compared) -> tuple[RecordDifference | None, RecordDifference | None, float]:
    """How stiffness, and height alone, depend on the frequency, and the change of height that a delay may make.

    The last is a share of the elastic force's range: a delay and viscous damping turn elastic force into height,
    linearly in the frequency, and change the stiffness by less than that.
    """
    f = compared.frequency
    if f.min() <= 0.0 or f.max() <= _SAME_FREQUENCY * f.min():
        return None, None, 0.0
    several = np.unique(np.round(np.log(f) / math.log(_SAME_FREQUENCY))).size > 2
    least = _LEAST + _CURVED * compared.apart
    turned = _turned(compared)

    def change(figure: _Figure, law: FloatArray) -> tuple[float, float, float]:
        slope, error, left = compared.coefficient(figure, law)
        size, error = slope * float(np.ptp(law)), error * float(np.ptp(law))
        return (size if abs(size) > max(least, _SURE * error) else 0.0), error, left

    square, square_error, square_left = change(compared.stiffness, f**2)
    stiffness, error, left = change(compared.stiffness, np.log(f))
    between = f" at {f.max():.3g} Hz than at {f.min():.3g} Hz"
    if several and square < -2.0 * turned and _CLEARER * square_left < left:
        factor = compared.scale / (2.0 * math.pi) ** 2 / float(np.ptp(f**2))
        mass, error = -square * factor, square_error * factor
        text = f"{mass:.3g} +- {error:.1g} kg, {-100.0 * square:.2g} % of the stiffness at {f.max():.3g} Hz"
        return RecordDifference(Outcome.INERTIA, mass, error, text, (*_LIKE_RATES, Effect.PLAY)), None, turned
    height, height_error, _ = change(compared.height, np.log(f))
    of_height = f"height of the loops {_more(height)}"
    if abs(stiffness) > turned:
        text = f"stiffness {_more(stiffness)}" + (f" and {of_height}" if height else "") + between
        return RecordDifference(Outcome.RATE_DEPENDENT, stiffness, error, text, _LIKE_RATES), None, turned
    if height and not turned:
        text = of_height + between
        return None, RecordDifference(Outcome.RATE_DEPENDENT, height, height_error, text, _LIKE_RATES), turned
    return None, None, turned
