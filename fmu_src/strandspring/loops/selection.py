"""Parts of a record: whole cycles, a window of time, a range of displacement."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..kernel.arrays import BoolArray, FloatArray
from ..records.record import Record
from .cycles import find_cycles
from .strokes import FEWEST_SAMPLES, LEAST_STROKE
from .windows import Bounds, check_ends


def select(
    record: Record, *, cycles: Bounds | None = None, time: Bounds | None = None, displacement: Bounds | None = None
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
    Record        With findings of what was selected.

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
    (601, ('Selected, as given: cycles 2 to 4 of 9. (samples 351 to 951 of 2001)',))
    """
    if not isinstance(record, Record):
        raise TypeError(f"`record` must be a Record, got {type(record).__name__}; read files with `read_record`.")
    for name, ends in (("cycles", cycles), ("time", time), ("displacement", displacement)):
        if ends is not None:
            check_ends(name, ends, ends)
    whole = keep = slice(0, len(record))
    findings = list(record.findings)
    for ends, cut_by in ((cycles, _cycles), (time, _window)):
        if ends is not None:
            keep, which = cut_by(record, ends, keep)
            numbers = {"part": which, "samples": [(keep.start + 1, keep.stop)], "of": len(record)}
            findings.append(Finding(Outcome.CUT, numbers))
    if keep != whole:
        columns = ("displacement", "force", "time", "compared")
        cut = {name: values[keep] for name in columns if (values := getattr(record, name)) is not None}
        record = replace(record, **cut, is_cut=True, first_sample=record.first_sample + keep.start)
    if displacement is not None:
        inside, which = _within(record, record.displacement, displacement, ("displacement", "mm", 1e3))
        findings.append(Finding(Outcome.WITHIN, {"part": which, "count": int(inside.sum()), "samples": len(record)}))
        record = replace(record, compared=inside if record.compared is None else inside & record.compared)
        x, compared = record.displacement, record.displacement[record.compared]
        covered = float(np.ptp(compared)) if compared.size else 0.0
        if covered < LEAST_STROKE * np.ptp(x):
            raise RecordError(
                f"{record.path}: the {which} must hold samples over at least {100.0 * LEAST_STROKE:g} % of the "
                f"record's range, {1e3 * x.min():.6g} to {1e3 * x.max():.6g} mm, and they cover {1e3 * covered:.4g} mm."
            )
    return replace(record, findings=tuple(findings))


def _cycles(record: Record, ends: Bounds, _keep: slice) -> tuple[slice, str]:
    """The samples of some cycles, and these in words."""
    cycles = find_cycles(record)
    if not cycles:
        raise RecordError(
            f"{record.path}: has no full cycle (two consecutive strokes equal in length within 3 %) to select; "
            "select by time instead."
        )
    count = len(cycles)
    first, last = int(ends[0] or 1), int(ends[1] or count)
    if (latest := max(first, last)) > count:
        raise RecordError(
            f"{record.path}: cycle {latest:.9g} cannot be selected, since the record has {count}; select among 1 to "
            f"{count}."
        )
    which = f"cycle {first}" if first == last else f"cycles {first} to {last}"
    return slice(cycles[first - 1].first_sample, cycles[last - 1].last_sample + 1), f"{which} of {count}"


def _window(record: Record, ends: Bounds, keep: slice) -> tuple[slice, str]:
    """The samples of a slice within a window of time, and the window in words."""
    if record.time is None or np.any(np.diff(record.time) < 0.0):
        found = "the record has none" if record.time is None else "they do"
        raise RecordError(
            f"{record.path}: a window of time needs times that do not fall back, and {found}; name its time column, or "
            "select by cycles."
        )
    inside, words = _within(record, record.time[keep], ends, ("time", "s", 1.0))
    first, last = np.flatnonzero(inside)[[0, -1]].tolist()
    return slice(keep.start + first, keep.start + last + 1), words


def _within(record: Record, values: FloatArray, ends: Bounds, column: tuple[str, str, float]) -> tuple[BoolArray, str]:
    """Which values of a column, of a name, a unit and its factor, lie within two ends; these in words."""
    (name, unit, factor), (low, high) = column, ends
    from_text = "its start" if low is None else f"{factor * low:.6g} {unit}"
    to_text = "its end" if high is None else f"{factor * high:.6g} {unit}"
    words = f"{name} from {from_text} to {to_text}"
    inside = (values >= (-math.inf if low is None else low)) & (values <= (math.inf if high is None else high))
    if (count := int(inside.sum())) < FEWEST_SAMPLES:
        own = f"{factor * values.min():.6g} to {factor * values.max():.6g} {unit}"
        part = "" if values.size == len(record) else " (the cycles selected)"
        raise RecordError(
            f"{record.path}: the {words} must hold at least {FEWEST_SAMPLES} samples, found {count}; the record goes "
            f"from {own}{part}."
        )
    return inside, words
