"""How a record is to be read and what is to be used of it, as options and description files say it."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Literal, TypeVar

from ..errors import RecordError
from ..records.reading import check_reverse, check_skipping, read_record
from ..records.record import Record
from ..records.units import Quantity, unit_factor
from .selection import Bounds, checked_ends, select

_SELECTIONS = ("cycles", "time_window", "displacement_range", "label")

Ends = TypeVar("Ends")
_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_WINDOW = re.compile(rf"\s*({_NUMBER})?\s*:\s*({_NUMBER})?\s*")
_CYCLES = re.compile(r"\s*([0-9]{1,9})?\s*(:)?\s*([0-9]{1,9})?\s*")


def is_window(text: str) -> bool:
    """Whether a text is "FROM:TO", with numbers of which one may be left out.

    Examples
    --------
    >>> from strandspring.loops.wanted import is_window
    >>> is_window("0.5:"), is_window("Time"), is_window(":")
    (True, False, False)
    """
    match = _WINDOW.fullmatch(text)
    return match is not None and any(match.groups())


def window(text: str) -> tuple[float | None, float | None]:
    """Both ends of "FROM:TO", None for one that is left out.

    Raises
    ------
    RecordError   If the text is not of that form.

    Examples
    --------
    >>> from strandspring.loops.wanted import window
    >>> window("-5:2.5"), window("3:")
    ((-5.0, 2.5), (3.0, None))
    """
    match = _WINDOW.fullmatch(text) if isinstance(text, str) else None
    if match is None or not any(match.groups()):
        raise RecordError(f"must be FROM:TO, such as 2.5:10, 2.5: or :10, got {text!r:.60}.")
    low, high = (None if end is None else float(end) for end in match.groups())
    if low is not None and high is not None and low > high:
        raise RecordError(f"must be FROM:TO of which the first is not above the second, got {text!r:.60}.")
    return low, high


def cycle_range(text: str) -> tuple[int | None, int | None]:
    """First and last cycle of "2:5", "2:", ":5" or "3".

    Raises
    ------
    RecordError   If the text is not of that form.

    Examples
    --------
    >>> from strandspring.loops.wanted import cycle_range
    >>> cycle_range("2:5"), cycle_range(":5"), cycle_range("3")
    ((2, 5), (None, 5), (3, 3))
    """
    match = _CYCLES.fullmatch(text) if isinstance(text, str) else None
    if match is None or not (match[1] or match[3]):
        raise RecordError(f"must be a cycle or FIRST:LAST, such as 3, 2:5, 2: or :5, got {text!r:.60}.")
    if match[2] is None:
        return int(text), int(text)
    first, last = (int(number) if number else None for number in (match[1], match[3]))
    if first is not None and last is not None and first > last:
        raise RecordError(f"must be FIRST:LAST of which the first is not above the second, got {text!r:.60}.")
    return first, last


@dataclass(frozen=True)
class Wanted:
    """How to read a record; None is what `read_record` does by itself.

    Parameters
    ----------
    displacement, force, time : int, str or None   Columns, see `read_record`.
    displacement_unit, force_unit, time_unit : str or None   Their units.
    reverse : "displacement", "force" or None      The column to negate.
    displacement_offset, force_offset : float      Subtracted from the column, in the column's own units.
    displacement_scale, force_scale : float        Factor of what is left, such as kN per V; the product has the unit.
    skip_bad_lines : bool or None                  Whether lines that cannot be read are left out, up to a tenth.
    cycles : str, int or None                      "2:5", "2:", ":5" or 3: see `select`.
    time_window : str or None                      "0.5:10" [s].
    displacement_range : str or None               "-5:5" [mm], of the displacement after offset and sign.
    label : str or None                            Name of the specimen or test.

    Raises
    ------
    RecordError   If cycles, window or range are not of their form, or a unit or the column to negate is none.

    Examples
    --------
    >>> from strandspring.loops.wanted import Wanted
    >>> for_all, for_one = Wanted(force_unit="kN", cycles="2:"), Wanted(cycles="3:5")
    >>> for_one.over(for_all).cycles, for_one.over(for_all).force_unit
    ('3:5', 'kN')
    """

    displacement: int | str | None = None
    force: int | str | None = None
    time: int | str | None = None
    displacement_unit: str | None = None
    force_unit: str | None = None
    time_unit: str | None = None
    reverse: Literal["displacement", "force"] | None = None
    displacement_offset: float | None = None
    force_offset: float | None = None
    displacement_scale: float | None = None
    force_scale: float | None = None
    skip_bad_lines: bool | None = None
    cycles: str | int | None = None
    time_window: str | None = None
    displacement_range: str | None = None
    label: str | None = None

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid", "strict": True, "allow_inf_nan": False}

    def __post_init__(self) -> None:
        _ = self.selection
        quantities: tuple[Quantity, ...] = ("displacement", "force", "time")
        for quantity in quantities:
            unit = getattr(self, f"{quantity}_unit")
            if unit is not None:
                unit_factor(unit, quantity)
        check_reverse(self.reverse)
        if self.skip_bad_lines is not None:
            check_skipping(self.skip_bad_lines)

    @property
    def selection(self) -> dict[str, Bounds | None]:
        """What to use of the record: arguments of `select`, in SI units."""
        cycles = _parsed("cycles", cycle_range, None if self.cycles is None else str(self.cycles))
        time = _parsed("time_window", window, self.time_window)
        span = _parsed("displacement_range", window, self.displacement_range)
        in_metres = None if span is None else (_metres(span[0]), _metres(span[1]))
        return {
            "cycles": checked_ends("cycles", cycles),
            "time": checked_ends("time", time),
            "displacement": checked_ends("displacement", in_metres),
        }

    def over(self, other: Wanted) -> Wanted:
        """This, with what it leaves open taken from another."""
        return replace(other, **{name: value for name, value in asdict(self).items() if value is not None})

    def read(self, path: str | os.PathLike[str]) -> Record:
        """Read a record so.

        Raises
        ------
        RecordError   If the file is not a record, or the selection leaves nothing usable.
        """
        given = {k: v for k, v in asdict(self).items() if k not in _SELECTIONS and v is not None}
        record = select(read_record(path, **given), **self.selection)
        return replace(record, label=self.label) if self.label else record


def _parsed(name: str, parse: Callable[[str], Ends], text: str | None) -> Ends | None:
    try:
        return None if text is None else parse(text)
    except RecordError as problem:
        raise RecordError(f"`{name}` {problem}") from None


def _metres(millimetres: float | None) -> float | None:
    return None if millimetres is None else 1e-3 * millimetres
