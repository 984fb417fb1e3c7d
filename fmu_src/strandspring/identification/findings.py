"""What records show by themselves, without a fit, and the rows of them that may be fitted.

`check` is the door: it cuts the records, refuses what no spring can have made, and names what is left out, what is too
coarse, and which cycles or records differ.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..findings import Finding, IdentificationError, Outcome
from ..kernel.arrays import BoolArray, FloatArray, IndexArray
from ..loops.loop import ALIKE
from ..records.record import Record
from ..records.spikes import spikes_of
from .refusals import FULL, RESOLVED, SURE, Strokes, cut_all, differing_units, impossible

_TURNS = 0.01  # of the force's deviation, that reversals between samples falsify
_FLAT = 0.15  # slope in a gap, of the mean slope: no knee is as flat between steep parts
_CELLS = 50  # of a stroke, for its slopes; a gap is three of them at least
_FIGURES = ("height of the loops", "stiffness")
_SHARES = np.linspace(0.05, 0.95, 31)  # of a stroke, where cycles are compared
# What a delay between the columns may make of a spring's record.
_LIKE_DELAYS = (Outcome.COLUMNS_SWAPPED, Outcome.BRANCHES_CROSS, Outcome.SNAP_THROUGH)


def check(
    records: Sequence[Record], state: str = "mean"
) -> tuple[list[BoolArray], list[Finding], IdentificationError | None]:
    """Check records before a fit.

    Parameters
    ----------
    records : sequence of Record       Of one spring.
    state : "first", "mean" or "last"  Of the cycles of one amplitude the first third is fitted, all, or the last third.

    Returns
    -------
    usable : list of ndarray of bool, shape (K,)   Samples of each record that may be fitted.
    findings : list of Finding
    refusal : IdentificationError or None          To be raised unless a delay between the columns is found.

    Raises
    ------
    IdentificationError   If no spring can have made a record, or its samples are too few.
    """
    try:
        parts = cut_all(records)
        refusals = [refusal for part in parts if (refusal := impossible(part)) is not None]
        # A piece of a test may hold less than a loop.
        if len(refusals) < len(parts) or any(refusal.outcome is not Outcome.NO_LOOP for refusal in refusals):
            refusals = [refusal for refusal in refusals if refusal.outcome is not Outcome.NO_LOOP]
        for refusal in refusals:
            if refusal.outcome not in _LIKE_DELAYS or any(record.rising_time is None for record in records):
                raise refusal
        if not refusals and (refusal := differing_units(parts)) is not None:
            raise refusal
        if any(_decide(record) for record in records):
            raise IdentificationError(Outcome.SPIKES_DECIDE, "")
    except IdentificationError as refusal:
        raise explained(refusal, records) from None
    cycles = Cycles.of(parts)
    usable, findings = [], []
    for number, part in enumerate(parts):
        first, of_state = _first_cycle(part), cycles.of_state(state, number, part.length.size)
        usable.append(part.usable & (part.of_sample >= first) & of_state[part.of_sample])
        findings += [*_spikes(part.record), *_of_record(part)]
        if first:
            findings.append(Finding(Outcome.FIRST_CYCLE_DIFFERS, {"strokes": first}, part.record.path))
    findings += [*_play(parts), *cycles.findings(parts), *_apart(parts)]
    return usable, findings, refusals[0] if refusals else None


def explained(refusal: IdentificationError, records: Sequence[Record]) -> IdentificationError:
    """A refusal with what may have caused it: isolated outliers in its place, clipped forces after it."""
    causes = [replace(spikes, kind=Outcome.SPIKES_DECIDE) for record in records for spikes in _spikes(record)]
    first, *others = causes or refusal.findings
    clipped = [finding for record in records for finding in _clipped(Strokes(record))]
    return IdentificationError(first.kind, first.where, first.numbers, [*others, *clipped])


# -- single records


def _spikes(record: Record) -> Iterator[Finding]:
    """Isolated outliers."""
    columns = {"displacement": record.displacement, "force": record.force}
    numbers: dict[str, Any] = {}
    for (name, values), spikes in zip(columns.items(), spikes_of(*columns.values()), strict=True):
        if spikes.size:
            samples = tuple(f"sample {k + 1}" for k in spikes)
            numbers |= {name: tuple(values[spikes].tolist()), f"{name}_at": samples}
    if numbers:
        yield Finding(Outcome.SPIKES, numbers, record.path)


def _decide(record: Record) -> bool:
    """Whether the isolated outliers of a column have a larger sum of squares than all other samples."""
    columns = (record.displacement, record.force)
    squares = [(values - np.median(values)) ** 2 for values in columns]
    return any(2.0 * s[spikes].sum() > s.sum() > 0.0 for s, spikes in zip(squares, spikes_of(*columns), strict=True))


def _of_record(part: Strokes) -> Iterator[Finding]:
    """What is left out of one record, missing in it or too coarse."""
    record, path = part.record, part.record.path
    yield from _clipped(part)
    if relaxed := _relaxed(part):
        yield Finding(Outcome.DWELLS, {"force": relaxed}, path)
    if record.time is not None and np.any((steps := np.diff(record.time)) > 0.0):
        # Three lost samples are more than jitter makes.
        at = np.flatnonzero(steps > 3.5 * np.median(steps[steps > 0.0]))
        # A file of several parts, or one that was sampled at will, has no usual step.
        if 0 < at.size <= 0.02 * steps.size:
            gaps = tuple((float(record.time[k]), float(record.time[k + 1])) for k in at[:6])
            yield Finding(Outcome.GAPS, {"gaps": gaps, "more": at.size - 6 if at.size > 6 else ""}, path)
    noise = part.displacement_noise / float(np.ptp(record.displacement))
    if noise > RESOLVED:
        yield Finding(Outcome.DISPLACEMENT_NOISE, {"share": noise}, path)
    lost, samples = _lost_at_reversals(part), part.samples_per_cycle
    # Of few samples in a cycle estimates of reversals are poor.
    if lost > (_TURNS if samples >= 100.0 else 0.5 * _TURNS):
        yield Finding(Outcome.TURNS_BETWEEN_SAMPLES, {"samples": samples, "share": lost}, path)


def _clipped(part: Strokes) -> Iterator[Finding]:
    """Forces at the end of the sensor's range."""
    if count := int(part.clipped.sum()):
        yield Finding(Outcome.CLIPPED, {"count": count, "samples": len(part.record)}, part.record.path)


def _relaxed(part: Strokes) -> float:
    """Mean change of the force while the displacement rests, against that before [N]; 0 if none is seen."""
    force, changes, variances = part.record.force, [], []
    for a, b in part.dwells:
        # At its ends a rest may move.
        rest, n = force[a + (b - a) // 8 : b + 1 - (b - a) // 8], max(1, (b - a) // 10)
        changes.append(part.direction[part.of_sample[a]] * (rest[:n].mean() - rest[-n:].mean()))
        variances.append(np.var(np.diff(rest)) / n)
    if not changes:
        return 0.0
    change, error = abs(float(np.mean(changes))), math.sqrt(np.sum(variances)) / len(changes)
    return change if change > max(SURE * error, ALIKE / 3.0 * float(np.std(force))) else 0.0


def _lost_at_reversals(part: Strokes) -> float:
    """Error of the force by reversals that fall between samples, of its deviation: medians, by parabolas."""
    x, r, top = part.record.displacement, part.record.force, part.turning[1:-1]
    before, after = np.abs(x[top] - x[top - 1]), np.abs(x[top] - x[top + 1])
    # Where the displacement rests at a reversal, that is recorded.
    bend = np.where(np.minimum(before, after) > 0.0, before + after, math.inf)
    beyond = max(float(np.median((before - after) ** 2 / (8.0 * bend))) - part.displacement_noise, 0.0)
    share = beyond / (beyond + float(np.median(np.maximum(before, after))) or 1.0)
    return share * float(np.median(part.direction[1:] * (r[top + 1] - r[top]))) / (float(np.std(r)) or 1.0)


def _first_cycle(part: Strokes) -> int:
    """Strokes of a first cycle that differs from the next one by more than later ones do, if the others suffice."""
    ends = part.record.displacement[part.turning]

    def difference(a: int, b: int) -> float:
        near = 0.5 * ALIKE * float(part.length.max())
        if b >= part.length.size or max(abs(ends[a] - ends[b]), abs(ends[a + 1] - ends[b + 1])) > near:
            return 0.0
        one, other = part.forces(np.array([a, b]), _SHARES * part.length[[a, b], None])
        # What differs from place to place is noise.
        return float(np.sqrt(np.mean(np.convolve(one - other, np.full(5, 0.2), "valid") ** 2)))

    for k in (1, 0):
        if difference(k, k + 2) - 2.0 * difference(k + 2, k + 4) > 0.5 * ALIKE * np.ptp(part.record.force):
            full = part.length[k + 1 :] >= FULL * part.length.max()
            return k + 1 if np.unique(part.direction[k + 1 :][full]).size == 2 else 0
    return 0


# -- play


def _play(parts: Sequence[Strokes]) -> Iterator[Finding]:
    """Play: the force rests after each reversal, or in mid stroke at about one force both ways."""
    part = max(parts, key=lambda part: float(part.length.max()))
    widths = [_rest_after_reversals(part, side) for side in (1, -1)]
    rests = [_rest(branch) for branch in (part.loop.loading, part.loop.unloading)]
    path, level = part.record.path, float(np.mean([force for _, force in rests]))
    if min(widths) > 0.5 * max(widths):
        width = float(np.mean(widths))
        yield Finding(Outcome.BACKLASH, {"width": width}, path)
    elif all(cells for cells, _ in rests) and abs(rests[0][1] - rests[1][1]) <= 0.25 * np.ptp(part.record.force):
        width = float(np.mean([cells for cells, _ in rests]) * np.ptp(part.loop.displacement) / _CELLS)
        yield Finding(Outcome.BACKLASH, {"width": width, "force": level}, path)


def _rest_after_reversals(part: Strokes, side: int) -> float:
    """Way for which the force rests after reversals, before it changes faster than anywhere near [m]; 0 for none."""
    strokes = part.full(side)
    strokes = strokes[strokes > 0]
    if not strokes.size or part.record.compared is not None:
        return 0.0
    shares, length = np.linspace(0.0, 0.1, _CELLS + 1), part.length[strokes]
    slopes = side * np.diff(part.forces(strokes, shares * length[:, None]).mean(axis=0))
    slopes = np.convolve(slopes, np.ones(3) / 3.0, mode="same")
    steepest = float(slopes.max())
    begun = int(np.argmax(slopes > 0.5 * steepest))
    width = float(shares[begun] * length.mean())
    begins = part.begun[strokes]
    inside = np.searchsorted(part.way, begins + width) - np.searchsorted(part.way, begins, "right")
    usual = 0.1 * (part.loop.loading[-1] - part.loop.loading[0]) / _CELLS
    is_seen = begun >= 3 and np.median(inside) >= 2 and width > 2.0 * SURE * part.displacement_noise
    return width if is_seen and steepest > usual > 0.0 and abs(slopes[: begun - 1].mean()) < _FLAT * steepest else 0.0


def _rest(branch: FloatArray) -> tuple[int, float]:
    """The longest rest in a branch with steeper parts on both sides, in cells, and its force [N]; 0 cells for none."""
    means = branch.reshape(_CELLS, -1).mean(axis=1)
    slopes = np.convolve(np.diff(means), np.ones(3) / 3.0, mode="same") / ((means[-1] - means[0]) / _CELLS or 1.0)
    edges = np.diff(np.concatenate([[False], slopes < _FLAT, [False]]).astype(np.int8))
    longest, force = 0, 0.0
    for begin, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        sides = slopes[max(begin - 4, 0) : begin], slopes[end : end + 4]
        if end - begin >= max(3, longest + 1) and min(side.max(initial=0.0) for side in sides) > 0.7:
            longest, force = int(end - begin), float(means[begin : end + 1].mean())
    return longest, force


# -- cycles that should be alike


@dataclass(frozen=True, eq=False)
class Cycles:
    """Pairs of strokes of one length that follow a third, C in all records; arrays are of shape (C,) or (2, C)."""

    record: IndexArray  # its number
    stroke: IndexArray  # number of the first one in the record
    amplitude: IndexArray  # its number
    place: FloatArray  # cycles since the beginning of the first record
    frequency: FloatArray  # [Hz]; 0 without times
    figures: FloatArray  # height over the stroke and stiffness [N/m]
    errors: FloatArray  # of these by noise alone

    @classmethod
    def of(cls, parts: Sequence[Strokes]) -> Cycles:
        """The cycles of records; of very many a part."""
        rows, begun = [np.empty((0, 9))], 0.0
        weights = (_SHARES - 0.5) / ((_SHARES - 0.5) @ (_SHARES - 0.5))
        for number, part in enumerate(parts):
            alike = np.abs(np.diff(part.length)) <= ALIKE * part.length[1:]
            valid = np.flatnonzero(alike[:-1] & alike[1:]) + 1
            # Every second one of those that follow each other.
            runs = valid[np.diff(valid, prepend=-2) > 1]
            k = valid[(valid - runs[np.searchsorted(runs, valid, side="right") - 1]) % 2 == 0]
            k = k[:: max(1, k.size // 1000)]
            length, side = part.length[k], part.direction[k]
            forth = part.forces(k, _SHARES * length[:, None])
            back = part.forces(k + 1, (1.0 - _SHARES) * length[:, None])
            height, stiffness = side * np.stack([(forth - back).mean(axis=1), 0.5 * (forth + back) @ weights]) / length
            first, end = part.turning[k], part.turning[k + 2]
            time = part.record.rising_time
            frequency = np.zeros(k.size) if time is None else 1.0 / (time[end] - time[first])
            middle, noise = part.start[k] + 0.5 * side * length, part.noise / np.sqrt(end - first) / length
            columns = [np.full(k.size, number), k, begun + 0.5 * k, frequency, length, middle, height, stiffness, noise]
            rows.append(np.stack(columns, axis=1))
            begun += 0.5 * part.length.size
        record, stroke, place, frequency, length, middle, height, stiffness, noise = np.concatenate(rows).T
        amplitude = np.full(length.size, -1)
        while (amplitude < 0).any():
            one = int(np.argmin(amplitude))
            apart = np.maximum(np.abs(length - length[one]), np.abs(middle - middle[one]))
            amplitude[(apart <= 0.5 * ALIKE * length[one]) & (amplitude < 0)] = amplitude.max() + 1
        figures, errors = np.stack([height, stiffness]), np.stack([2.5 * noise, 4.0 * noise])
        return cls(record.astype(np.intp), stroke.astype(np.intp), amplitude, place, frequency, figures, errors)

    def of_state(self, state: str, record: int, strokes: int) -> BoolArray:
        """Which of so many strokes of a record are of a state; those that are part of no cycle at its other end go."""
        kept = np.ones(strokes, bool)
        own = self.stroke[self.record == record]
        if state == "mean" or not own.size:
            return kept
        kept[slice(own.max() + 2, None) if state == "first" else slice(own.min())] = False
        for amplitude in np.unique(self.amplitude):
            members = np.flatnonzero(self.amplitude == amplitude)
            third = -(-members.size // 3)
            others = members[third:] if state == "first" else members[:-third]
            gone = self.stroke[others[self.record[others] == record]]
            kept[gone] = kept[gone + 1] = False
        return kept

    @property
    def rates_differ(self) -> bool:
        """Whether there are several frequencies."""
        return bool(self.frequency.min() > 0.0 and self.frequency.max() > 1.1 * self.frequency.min())

    def effect(self, figure: int, law: FloatArray, groups: IndexArray) -> tuple[float, float]:
        """What a law makes of a relative figure over its range, the means of groups aside, and its standard error.

        Beside it stands a change per cycle, as far as cycles of one record tell of that.
        """
        groups = np.unique(groups, return_inverse=True)[1]
        sizes = np.bincount(groups)

        def means(values: FloatArray) -> FloatArray:
            return np.asarray((np.bincount(groups, values) / sizes)[groups])

        # Rates change the stiffness alike at all amplitudes; where it is nearly none, the height counts.
        whole = means(self.figures[0]) if figure == 0 else np.full(groups.size, np.mean(self.figures.sum(axis=0)))
        beside = law is not self.place and np.unique(groups * len(sizes) + self.record).size < groups.size
        A = np.stack([values - means(values) for values in ((law, self.place) if beside else (law,))], axis=1)
        y = (self.figures[figure] - means(self.figures[figure])) / whole
        scale, freedom = np.linalg.norm(A, axis=0), y.size - sizes.size - A.shape[1]
        # Noise may be coloured, and is known from the scatter alone.
        if freedom < 2 or scale[0] <= 1e-9 * np.linalg.norm(law):
            return 0.0, math.inf
        A = A / np.maximum(scale, 1e-300)
        inverse = np.linalg.pinv(A.T @ A, rcond=1e-6, hermitian=True)
        solution = inverse @ (A.T @ y)
        variance = max(np.sum((y - A @ solution) ** 2) / (freedom - 1), np.mean((self.errors[figure] / whole) ** 2))
        size = float(np.ptp(law) / scale[0])
        return size * float(solution[0]), size * math.sqrt(variance * inverse[0, 0])

    def findings(self, parts: Sequence[Strokes]) -> Iterator[Finding]:
        """How cycles of one amplitude change, depend on the frequency, or differ between records."""
        if not self.place.size or self.figures[0].min() <= 0.0:
            return
        within = self.amplitude * len(parts) + self.record
        for figure, kind in enumerate((Outcome.FRICTION_WEAR, Outcome.STIFFNESS_WEAR)):
            change, error = self.effect(figure, self.place, within)
            if abs(change) > max(ALIKE, SURE * error):
                change /= float(np.ptp(self.place))
                yield Finding(kind, {"change": change, "figure": _FIGURES[figure]})
        if beside := (self._of_rate() if self.rates_differ else None) or self._of_records(parts):
            yield beside

    def _of_rate(self) -> Finding | None:
        """A stiffness that depends on the frequency: by its square as of a moving mass, or otherwise."""
        f, squares = self.frequency, self.frequency**2
        change, error = self.effect(1, np.log(f), self.amplitude)
        by_mass, error_by_mass = self.effect(1, squares, self.amplitude)
        if -by_mass > max(ALIKE, SURE * error_by_mass) and error_by_mass < 0.5 * error:
            mass = -by_mass / np.ptp(squares) * float(np.mean(self.figures.sum(axis=0))) / (2.0 * math.pi) ** 2
            return Finding(Outcome.INERTIA, {"mass": mass, "share": -by_mass, "frequency": float(f.max())})
        if abs(change) > max(ALIKE, SURE * error):
            ends = {"low": float(f.min()), "high": float(f.max())}
            return Finding(Outcome.RATE_DEPENDENT, {"change": change, **ends})
        return None

    def _of_records(self, parts: Sequence[Strokes]) -> Finding | None:
        """The record whose loops differ from the others'; of two the second."""
        steps = []
        for number in range(len(parts)):
            kept = np.isin(self.amplitude, self.amplitude[self.record == number])
            shared = Cycles(*(getattr(self, name)[..., kept] for name in self.__dataclass_fields__))
            count = np.unique(shared.record).size
            if count < 2 or count < 2 + shared.rates_differ or (number == 0 and count == 2):
                continue
            for figure in (0,) if shared.rates_differ else (0, 1):
                step, error = shared.effect(figure, (shared.record == number).astype(np.float64), shared.amplitude)
                by_rate, error_by_rate = shared.effect(figure, shared.frequency, shared.amplitude)
                # A delay and a dashpot make a height that is linear in the frequency.
                if abs(step) > max(ALIKE, SURE * error, abs(by_rate) * error / error_by_rate):
                    steps.append((abs(step), step, figure, number))
        if not steps:
            return None
        _, step, figure, number = max(steps)
        numbers = {"change": step, "figure": _FIGURES[figure]}
        return Finding(Outcome.RECORDS_DIFFER, numbers, parts[number].record.path)


def _apart(parts: Sequence[Strokes]) -> Iterator[Finding]:
    """Displacements between those of the records."""
    x = [part.record.displacement[part.usable] for part in parts]
    ranges = sorted((float(of.min()), float(of.max())) for of in x)
    reached = np.maximum.accumulate([high for _, high in ranges])
    if gaps := tuple((float(a), b) for a, (b, _) in zip(reached, ranges[1:], strict=False) if b > a):
        yield Finding(Outcome.RANGE_WITH_GAPS, {"gaps": gaps})
