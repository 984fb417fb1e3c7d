"""Choosing part of a record: whole cycles, a window of time, a range of displacement."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal

import numpy as np

from ..errors import RecordError
from ..records.record import Record, is_finite_number
from .cycles import find_cycles

Bounds = tuple[float | None, float | None]

_NARROWEST = 0.02  # share of the displacement's range, as for a stroke
_FEWEST = 16  # samples of a part that can show a loop


def checked_ends(name: Literal["cycles", "time", "displacement"], ends: Bounds | None) -> Bounds | None:
    """Both ends of what `select` is to use, None for that of the record.

    Raises
    ------
    RecordError   If the first is above the last, a number is not finite, or a cycle is below 1.
    """
    if ends is None:
        return None
    unit = {"cycles": "", "time": " [s]", "displacement": " [m]"}[name]
    if not (isinstance(ends, tuple | list) and len(ends) == 2):
        raise RecordError(f"`{name}` must be a pair of first and last{unit}, None for an open end, got {ends!s:.60}.")
    given = [value for value in ends if value is not None]
    if not all(map(is_finite_number, given)) or (len(given) == 2 and given[0] > given[1]):
        raise RecordError(
            f"`{name}` must be two finite numbers{unit} of which the first is not above the second, got {ends!s:.60}."
        )
    if name == "cycles" and any(value != int(value) or value < 1 for value in given):
        raise RecordError(f"`cycles` must be whole numbers from 1 on, got {ends}.")
    return ends


def select(
    record: Record,
    *,
    cycles: Bounds | None = None,
    time: Bounds | None = None,
    displacement: Bounds | None = None,
) -> Record:
    """Part of a record.

    Cycles and time cut the record: what remains is one piece of it. The cycles are those of `find_cycles`, which leaves
    out the first stroke of a series, since that depends on the motion before it. A range of displacement cuts nothing,
    since the force depends on the whole path: the samples outside are not compared with the model (`Record.compared`),
    and the spring is identified for the range.

    Parameters
    ----------
    record : Record
    cycles : (int or None, int or None) or None            First and last cycle, counted from 1.
    time : (float or None, float or None) or None          Window of time [s], ends included.
    displacement : (float or None, float or None) or None  Range of displacement [m], ends included.

    Returns
    -------
    Record        With notes on what was selected.

    Raises
    ------
    RecordError   If nothing usable is left; the message says what there is.
    TypeError     If the record is something else.

    Examples
    --------
    >>> import numpy as np
    >>> from strandspring import Record, select
    >>> path = 1e-3 * np.sin(np.linspace(0.0, 20.0 * np.pi, 2001))
    >>> part = select(Record(path, 1e4 * path), cycles=(2, 4))
    >>> len(part), part.notes
    (601, ('cycles 2 to 4 of 9 selected, samples 351 to 951 of 2001, as given',))
    """
    if not isinstance(record, Record):
        raise TypeError(f"`record` must be a Record, got {type(record).__name__}; read files with `read_record`.")
    cycles, time = checked_ends("cycles", cycles), checked_ends("time", time)
    displacement = checked_ends("displacement", displacement)
    keep = slice(0, len(record))
    notes = []
    if cycles is not None:
        whole = find_cycles(record)
        first, last = (int(cycles[0] or 1), int(cycles[1] or len(whole)))
        if not whole:
            raise RecordError(
                f"{record.path}: has no full cycle (two consecutive strokes equal in length within 3 %) to select; "
                "select by time instead."
            )
        which = f"cycle {first}" if first == last else f"cycles {first} to {last}"
        if first > len(whole) or last > len(whole):
            raise RecordError(
                f"{record.path}: cycle {max(first, last)} cannot be selected, since the record has {len(whole)}; "
                f"select among 1 to {len(whole)}."
            )
        keep = slice(whole[first - 1].first_sample, whole[last - 1].last_sample + 1)
        notes.append(f"{which} of {len(whole)} selected, {_samples(keep, record)}, as given")
    if time is not None:
        keep = _window(record, time, keep)
        low, high = _ends(time, "s")
        notes.append(f"time from {low} to {high} selected, {_samples(keep, record)}, as given")
    part = record if keep == slice(0, len(record)) else _cut(record, keep)
    if displacement is not None:
        part, note = _within(part, displacement)
        notes.append(note)
    return replace(part, notes=(*part.notes, *notes))


def _window(record: Record, window: Bounds, keep: slice) -> slice:
    """The samples of a slice within a window of time."""
    if record.time is None:
        raise RecordError(
            f"{record.path}: a window of time needs times, and the record has none; name its time column, or select by "
            "cycles."
        )
    if np.any(np.diff(record.time) < 0.0):
        raise RecordError(
            f"{record.path}: a window of time needs times that do not fall back, and they do; select by cycles, or "
            "name the time column."
        )
    low, high = (-math.inf if window[0] is None else window[0], math.inf if window[1] is None else window[1])
    begin = max(keep.start, int(np.searchsorted(record.time, low, side="left")))
    end = min(keep.stop, int(np.searchsorted(record.time, high, side="right")))
    if end - begin < _FEWEST:
        low_text, high_text = _ends(window, "s")
        cycles = "" if keep == slice(0, len(record)) else " (the cycles selected)"
        raise RecordError(
            f"{record.path}: the time from {low_text} to {high_text} must hold at least {_FEWEST} samples, found "
            f"{max(end - begin, 0)}; the record goes from {record.time[keep.start]:.6g} to "
            f"{record.time[keep.stop - 1]:.6g} s{cycles}."
        )
    return slice(begin, end)


def _within(record: Record, bounds: Bounds) -> tuple[Record, str]:
    """The record with the samples outside a range marked as not compared."""
    low, high = (-math.inf if bounds[0] is None else bounds[0], math.inf if bounds[1] is None else bounds[1])
    inside = (record.displacement >= low) & (record.displacement <= high)
    count = int(inside.sum())
    texts = _ends(bounds, "mm", 1e3)
    own_low, own_high = 1e3 * record.displacement.min(), 1e3 * record.displacement.max()
    if count < _FEWEST:
        raise RecordError(
            f"{record.path}: the displacement from {texts[0]} to {texts[1]} must hold at least {_FEWEST} samples, "
            f"found {count}; the record goes from {own_low:.6g} to {own_high:.6g} mm."
        )
    if record.compared is not None:
        inside &= record.compared
    covered = float(np.ptp(record.displacement[inside])) if inside.any() else 0.0
    if covered < _NARROWEST * np.ptp(record.displacement):
        raise RecordError(
            f"{record.path}: the displacement from {texts[0]} to {texts[1]} must hold samples over at least "
            f"{100.0 * _NARROWEST:g} % of the record's range, {own_low:.6g} to {own_high:.6g} mm, and they cover "
            f"{1e3 * covered:.4g} mm."
        )
    return replace(record, compared=inside), (
        f"displacement from {texts[0]} to {texts[1]} selected, {count} of {len(record)} samples, as given; the others "
        "belong to the path only"
    )


def _cut(record: Record, keep: slice) -> Record:
    return replace(
        record,
        displacement=record.displacement[keep],
        force=record.force[keep],
        time=None if record.time is None else record.time[keep],
        compared=None if record.compared is None else record.compared[keep],
        is_cut=True,
        first_sample=record.first_sample + keep.start,
    )


def _samples(keep: slice, record: Record) -> str:
    return f"samples {keep.start + 1} to {keep.stop} of {len(record)}"


def _ends(bounds: Bounds, unit: str, factor: float = 1.0) -> tuple[str, str]:
    """Both ends in words."""
    low, high = bounds
    return (
        "its start" if low is None else f"{factor * low:.6g} {unit}",
        "its end" if high is None else f"{factor * high:.6g} {unit}",
    )
