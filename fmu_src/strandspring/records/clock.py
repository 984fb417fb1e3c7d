"""Times of day, dates with times and durations in hours, minutes and seconds, as seconds."""

from __future__ import annotations

import re
from collections.abc import Iterable
from datetime import date

import numpy as np
from numpy.typing import NDArray

_DAY = 86400.0  # [s]
_TIME = re.compile(
    r"(?:(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})[ T]|(?P<days>\d{1,6}) days?, ?)?"
    r"(?:(?P<hours>\d{1,6}):)?(?P<minutes>[0-5]?\d):(?P<seconds>[0-5]?\d(?P<decimals>[.,]\d{1,9})?)"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?Z?"
)


# Days since midnight or since the year 1, seconds since, and whether there is a date; apart, or digits would be lost.
Moment = tuple[int, float, bool]


def is_clock(cells: Iterable[str]) -> bool:
    """Whether there are cells, all of them times such as "10:00:08.5", or all with a date, "2024-05-17 10:00:08"."""
    moments = [moment_of(cell) for cell in cells]
    return {None if moment is None else moment[2] for moment in moments} in ({False}, {True})


def moment_of(cell: str) -> Moment | None:
    """The moment that a cell holds; None if it is no time: "10:05" may be hours and minutes or minutes and seconds.

    Examples
    --------
    >>> moment_of("10:00:08,5"), moment_of("1:05.25"), moment_of("0001-01-02 00:00:01"), moment_of("10:05")
    ((0, 36008.5, False), (0, 65.25, False), (2, 1.0, True), None)
    """
    match = _TIME.fullmatch(cell)
    if match is None or not (match["hours"] or match["decimals"]):
        return None
    hours = int(match["hours"] or 0)
    if match["half"]:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if match["half"] in "Pp" else 0)
    days = int(match["days"] or 0)
    if match["year"]:
        try:
            days = date(int(match["year"]), int(match["month"]), int(match["day"])).toordinal()
        except ValueError:
            return None
    seconds = float(match["seconds"].replace(",", "."))
    return days, hours * 3600.0 + int(match["minutes"]) * 60.0 + seconds, match["year"] is not None


def elapsed(moments: Iterable[Moment]) -> NDArray[np.float64]:
    """Seconds since midnight, or since the first time if there are dates, shape (K,); without dates, midnight may pass.

    Examples
    --------
    >>> elapsed([(0, 86399.0, False), (0, 1.0, False)]).tolist()
    [86399.0, 86401.0]
    """
    days, seconds, dated = map(np.array, zip(*moments, strict=True))
    if dated.any():
        return np.asarray((days - days[0]) * _DAY + (seconds - seconds[0]))
    values = days * _DAY + seconds
    midnights = np.cumsum(np.concatenate([[0.0], np.diff(values) < -0.5 * _DAY]))
    return np.asarray(values + _DAY * midnights)
