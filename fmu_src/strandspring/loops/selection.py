"""Which records to read, how, and what to use of each: whole cycles, a window of time, a range of displacement.

Options say so for all records of a command, a description file (TOML) for the records of a campaign: it has the fields
of `Wanted` for all of them, and a table [[record]] for each with its file or a pattern, where they take precedence.
Files are found from its folder; "..", "~" and absolute paths lead out of it and are allowed for single files only.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Literal, get_args, get_type_hints

import numpy as np

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.files import read_text, readable
from ..ground.strict_toml import parse_toml
from ..kernel.arrays import BoolArray, FloatArray
from ..records.reading import check_reverse, check_skipping, read_record
from ..records.record import Record, is_finite_number
from ..records.units import Quantity, unit_factor
from .cycles import find_cycles
from .strokes import FEWEST_SAMPLES, LEAST_STROKE

Bounds = tuple[float | None, float | None]

_MAX_BYTES = 1_000_000  # of a description file
_MAX_FILES = 10_000  # that it names
_KINDS = {str: "text", int: "a whole number", float: "a finite number", bool: "true or false"}
_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_WINDOW = re.compile(rf"\s*({_NUMBER})?\s*:\s*({_NUMBER})?\s*")


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
            _check_ends(name, ends, ends)
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


def _check_ends(name: str, ends: Bounds, shown: object) -> None:
    """Refuse what are no two ends, of which either may be None."""
    unit = {"time": " [s]", "displacement": " [m]"}.get(name, "")
    if not (isinstance(ends, tuple | list) and len(ends) == 2):
        raise RecordError(f"`{name}` must be a pair of first and last{unit}, None for an open end, got {shown!s:.60}.")
    given = [value for value in ends if value is not None]
    if not all(map(is_finite_number, given)) or given != sorted(given):
        raise RecordError(
            f"`{name}` must be two finite numbers{unit} of which the first is not above the second, got {shown!s:.60}."
        )
    if name == "cycles" and any(value != int(value) or value < 1 for value in given):
        raise RecordError(f"`cycles` must be whole numbers from 1 on, got {shown!s:.60}.")


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


def is_window(text: str) -> bool:
    """Whether a text is "FROM:TO", with numbers of which one may be left out."""
    match = _WINDOW.fullmatch(text)
    return match is not None and any(match.groups())


def window(text: str, name: str = "window", factor: float = 1.0) -> Bounds:
    """Both ends of "FROM:TO" times a factor, None for one that is left out; other texts are a RecordError."""
    # One cycle is both ends of its range.
    whole = f"{text}:{text}" if name == "cycles" and isinstance(text, str) and ":" not in text else text
    match = _WINDOW.fullmatch(whole) if isinstance(whole, str) and is_window(whole) else None
    if match is None:
        cycles = "a cycle or FIRST:LAST, such as 3, 2:5, 2: or :5"
        form = cycles if name == "cycles" else "FROM:TO, such as 2.5:10, 2.5: or :10"
        raise RecordError(f"`{name}` must be {form}, got {text!r:.60}.")
    low, high = (None if end is None else factor * float(end) for end in match.groups())
    _check_ends(name, (low, high), repr(text))
    return low, high


def cycle_range(text: str) -> Bounds:
    """First and last cycle of "2:5", "2:", ":5" or "3"; other texts are a RecordError."""
    return window(text, "cycles")


@dataclass(frozen=True)
class Wanted:
    """How to read a record and what to use of it; None is what `read_record` does by itself.

    Cycles, window or range that are not of their form, or a wrong unit or column to negate, are a RecordError.
    """

    displacement: int | str | None = None  # columns, see `read_record`
    force: int | str | None = None
    time: int | str | None = None
    displacement_unit: str | None = None
    force_unit: str | None = None
    time_unit: str | None = None
    reverse: Literal["displacement", "force"] | None = None  # the column to negate
    displacement_offset: float | None = None  # subtracted from the column, in the column's own units
    force_offset: float | None = None
    displacement_scale: float | None = None  # of what is left, such as kN per V; the product has the unit
    force_scale: float | None = None
    skip_bad_lines: bool | None = None  # whether lines that cannot be read are left out, up to a tenth
    cycles: str | int | None = None  # "2:5", "2:", ":5" or 3: see `select`
    time_window: str | None = None  # "0.5:10" [s]
    displacement_range: str | None = None  # "-5:5" [mm], of the displacement after offset and sign
    label: str | None = None  # name of the specimen or test

    def __post_init__(self) -> None:
        _ = self.selection
        for quantity in get_args(Quantity):
            if (unit := getattr(self, f"{quantity}_unit")) is not None:
                unit_factor(unit, quantity)
        check_reverse(self.reverse)
        if self.skip_bad_lines is not None:
            check_skipping(self.skip_bad_lines)

    @property
    def selection(self) -> dict[str, Bounds | None]:
        """What to use of the record: arguments of `select`, in SI units."""
        cycles, time, span = self.cycles, self.time_window, self.displacement_range
        return {
            "cycles": None if cycles is None else cycle_range(str(cycles)),
            "time": None if time is None else window(time, "time_window"),
            "displacement": None if span is None else window(span, "displacement_range", 1e-3),
        }

    def over(self, other: Wanted) -> Wanted:
        """This, with what it leaves open taken from another."""
        return replace(other, **{name: value for name, value in asdict(self).items() if value is not None})

    def read(self, path: str | os.PathLike[str]) -> Record:
        """Read a record so; one of which nothing usable is left is a RecordError."""
        ours = ("cycles", "time_window", "displacement_range", "label")
        given = {name: value for name, value in asdict(self).items() if name not in ours and value is not None}
        record = select(read_record(path, **given), **self.selection)
        return replace(record, label=self.label) if self.label else record


def entries(paths: Sequence[str | os.PathLike[str]], given: Wanted | None = None) -> list[tuple[str, Wanted]]:
    """The files that paths stand for, each a record or a description file (.toml) of several, and how to read them.

    What is given takes precedence over what description files say. A description that is wrong is a RecordError.
    """
    listed = []
    for path in paths:
        is_description = os.fspath(path).lower().endswith(".toml")
        listed += _described(Path(path)) if is_description else [(os.fspath(path), Wanted())]
    return [(path, (given or Wanted()).over(wanted)) for path, wanted in listed]


def read_campaign(path: str | os.PathLike[str], given: Wanted | None = None) -> list[Record]:
    """Read the records of a description file.

    Parameters
    ----------
    path : path-like          The file; `strandspring docs rig-files` shows an example.
    given : Wanted, optional  Takes precedence over what the file says.

    Returns
    -------
    list of Record

    Raises
    ------
    RecordError   If the description or one of the records is wrong; the message names file and field.
    """
    return [(given or Wanted()).over(wanted).read(file) for file, wanted in _described(Path(path))]


def _described(path: Path) -> list[tuple[str, Wanted]]:
    name = readable(path)
    text = read_text(path, _MAX_BYTES, "a description file", RecordError)
    try:
        content = parse_toml(text)
    except ValueError as problem:
        raise RecordError(f"{name}: is not valid TOML ({problem}); correct it.") from None
    records = content.pop("record", None)
    if not isinstance(records, list) or not records or not all(isinstance(record, dict) for record in records):
        raise RecordError(f"{name}: must name its records, each as a table [[record]] with the key file.")
    for_all = _checked(content, name)
    listed = []
    for number, record in enumerate(records, 1):
        where = f"{name}, record {number}"
        file = record.pop("file", None)
        if not isinstance(file, str) or not file:
            raise RecordError(f"{where}: must have the key file with a path or pattern, got {file or 'none'!r:.60}.")
        wanted = _checked(record, where).over(for_all)
        listed += [(str(member), wanted) for member in _files(path, file, where)]
    if len(listed) > _MAX_FILES:
        raise RecordError(f"{name}: must name at most {_MAX_FILES} files, found {len(listed)}; split it.")
    return listed


def _checked(content: Mapping[str, Any], where: str) -> Wanted:
    """The fields of a table, each of the right type and none unknown."""
    hints = get_type_hints(Wanted)
    for key, value in content.items():
        if key not in hints:
            raise RecordError(f"{where}: {key[:60]!r} is not a key; the keys are {', '.join(hints)}.")
        kinds = [kind for kind in _KINDS if kind in get_args(hints[key])]
        fits = type(value) in kinds or (float in kinds and type(value) is int)
        if kinds and not (fits and (float not in kinds or is_finite_number(value))):
            words = " or ".join(_KINDS[kind] for kind in kinds)
            raise RecordError(f"{where}, {key}: must be {words}, got {value!r:.60}.")
    try:
        return Wanted(**content)
    except RecordError as problem:
        raise RecordError(f"{where}: {problem}") from None


def _files(description: Path, file: str, where: str) -> list[Path]:
    """The files of one entry, in the order of their names."""
    folder, shown = description.parent, f"{where}, file: {file[:60]!r}"
    try:
        path = Path(file).expanduser()
    except RuntimeError as problem:
        raise RecordError(f"{shown} names no user's folder ({problem}); give its path.") from None
    if not set("*?[") & set(file) or (folder / path).exists():
        return [folder / path]
    if path.is_absolute() or ".." in path.parts:
        raise RecordError(
            f"{shown} is a pattern and must stay in the folder of the description; name the files, or move the "
            "description."
        )
    try:
        fitting = (member for member in folder.glob(file) if member.is_file() and member != description)
        files = sorted(islice(fitting, _MAX_FILES + 1))
    except (ValueError, OSError) as problem:
        raise RecordError(f"{shown} is not a usable pattern ({problem}); correct it.") from None
    if not files:
        raise RecordError(f"{shown} fits no file in the folder {readable(folder.resolve())}; correct the pattern.")
    return files
