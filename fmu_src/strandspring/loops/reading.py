"""Which records to read, how, and what to use of each.

Options say so for all records of a command, a description file (TOML) for the records of a campaign: it has the fields
of `Reading` for all of them, and a table [[record]] for each with its file or a pattern, where they take precedence.
Files are found from its folder; "..", "~" and absolute paths lead out of it and are allowed for single files only.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import InitVar, dataclass, fields, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeAlias, get_args, get_type_hints

from ..errors import OptionError, RecordError
from ..ground.arguments import is_finite_number
from ..ground.files import read_text, readable
from ..ground.options import check, described, option, options_of, takes
from ..ground.strict_toml import parse_toml
from ..records.units import Quantity, unit_factor
from .windows import Bounds, is_window, window

if TYPE_CHECKING:
    from ..records.record import Record

Reversed: TypeAlias = Literal["displacement", "force"]

_MAX_BYTES = 1_000_000  # of a description file
_MAX_FILES = 10_000  # that it names
_KINDS = {str: "text", int: "a whole number", float: "a finite number", bool: "true or false"}
_QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)


@described
@dataclass(frozen=True)
class Reading:
    """How records are read, and what of them is used; what is None is found in the file, or nothing is done.

    `units` is a mapping with the units of several of "displacement", "force" and "time", in place of the fields of one.

    Raises
    ------
    RecordError   If cycles, window or range are not of their form, or a unit or the column to negate is none.
    """

    group: ClassVar[str] = "Reading"

    displacement: int | str | None = option(
        None, "text", "Displacement column: name, or number from 1; of several sheets or groups, SHEET/COLUMN",
        metavar="COLUMN",
    )  # fmt: skip
    force: int | str | None = option(None, "text", "Force column, likewise", metavar="COLUMN")
    time: int | str | None = option(
        None, "text", "Time column, if any. The model does not need it; identify finds delays, gaps and forces that "
        "depend on the rate by it", metavar="COLUMN|FROM:TO", repeated=". Numbers as in 2.5:60, 2.5: or :60 are a "
        "window instead, to which the record is cut [s]; give the option twice for both",
    )  # fmt: skip
    units: InitVar[Mapping[str, str] | None] = None
    displacement_unit: str | None = option(
        None, "text", "Unit of the displacement, such as mm, m or in", otherwise="the file's, or mm", metavar="UNIT",
        checks=partial(unit_factor, quantity="displacement"),
    )  # fmt: skip
    force_unit: str | None = option(
        None, "text", "Unit of the force, such as N, kN, lbf or kip", otherwise="the file's, or N", metavar="UNIT",
        checks=partial(unit_factor, quantity="force"),
    )  # fmt: skip
    time_unit: str | None = option(
        None, "text", "Unit of the time, such as s, ms or min", otherwise="the file's, or s", metavar="UNIT",
        checks=partial(unit_factor, quantity="time"),
    )  # fmt: skip
    reverse: Reversed | None = option(None, "choice", "Negate this column", choices=get_args(Reversed), repeated="")
    displacement_offset: float | None = option(
        None, "number", "Subtracted from the column of displacement, in its own units", metavar="VALUE", rare=True
    )
    force_offset: float | None = option(None, "number", "The same for the force", metavar="VALUE", rare=True)
    displacement_scale: float | None = option(
        None,
        "number",
        "Factor of what is left, such as mm per V; the product has the unit",
        metavar="FACTOR",
        rare=True,
    )
    force_scale: float | None = option(None, "number", "The same for the force", metavar="FACTOR", rare=True)
    skip_bad_lines: bool | None = option(
        None, "flag", "Leave out lines of a text that cannot be read, up to a tenth of them, with a caution"
    )
    cycles: str | int | None = option(
        None, "text", "Cut the record to these cycles, counted from 1: 2:5, 2:, :5 or 3", metavar="FIRST:LAST",
        checks=lambda cycles: window(str(cycles), "cycles"),
    )  # fmt: skip
    time_window: str | None = option(
        None, "text", "Cut the record to this window of time, such as 2.5:60, 2.5: or :60 [s]", flag="",
        checks=partial(window, name="time_window"),
    )  # fmt: skip
    displacement_range: str | None = option(
        None, "text", "Compare only samples within these displacements, after offset and sign, as in -5:5, -5: or :5 "
        "[mm]; the others still belong to the path", metavar="LOW:HIGH",
        checks=partial(window, name="displacement_range"),
    )  # fmt: skip
    label: str | None = option(None, "text", "Name of the specimen or test", rare=True)

    def __post_init__(self, units: Mapping[str, str] | None) -> None:
        for quantity, unit in _checked_units(units).items():
            if getattr(self, name := f"{quantity}_unit") is not None:
                raise TypeError(f"`units` and `{name}` exclude each other; give one of them.")
            object.__setattr__(self, name, unit)
        check(self, RecordError)

    def with_options(self, **given: Any) -> Reading:
        """This with options of a command: --time is a column or a window, or both, and two columns cannot be one."""
        times = dict.fromkeys(given.pop("time", ()))
        windows = [text for text in times if is_window(text)]
        columns = [text for text in times if text not in windows]
        named = {"reverse": [*dict.fromkeys(given.pop("reverse", ()))], "time": columns, "time_window": windows}
        for name, values in named.items():
            if len(values) > 1:
                what, sentence = (
                    "window FROM:TO" if values is windows else "column",
                    "must be one {what}, got {values}.",
                )
                raise OptionError(f"{{to[{name}]}} {sentence}", what=what, values=" and ".join(values))
        return replace(self, **given, **{name: values[0] for name, values in named.items() if values})

    @property
    def selection(self) -> dict[str, Bounds | None]:
        """What to use of the record: arguments of `select`, in SI units."""
        cycles, time, span = self.cycles, self.time_window, self.displacement_range
        return {
            "cycles": None if cycles is None else window(str(cycles), "cycles"),
            "time": None if time is None else window(time, "time_window"),
            "displacement": None if span is None else window(span, "displacement_range", 1e-3),
        }

    @property
    def reading(self) -> dict[str, Any]:
        """What is given of how files and tables are read."""
        ours = ("cycles", "time_window", "displacement_range", "label")
        return {name: value for name, value in self.given.items() if name not in ours}

    @property
    def given(self) -> dict[str, Any]:
        """The fields that are not None."""
        return {each.name: value for each in fields(self) if (value := getattr(self, each.name)) is not None}

    @property
    def adjustments(self) -> dict[Quantity, tuple[float, float]]:
        """Offset and factor of displacement and force."""
        given = {name: (getattr(self, f"{name}_offset"), getattr(self, f"{name}_scale")) for name in _QUANTITIES[:2]}
        return {name: (offset or 0.0, 1.0 if scale is None else scale) for name, (offset, scale) in given.items()}

    def over(self, other: Reading) -> Reading:
        """This, with what it leaves open taken from another."""
        return replace(other, **self.given)

    def read(self, path: str | os.PathLike[str]) -> Record:
        """Read a record so; one of which nothing usable is left is a RecordError."""
        from ..records.reading import record_of_file  # slow to import

        columns: Any = {name: getattr(self, name) for name in _QUANTITIES}
        units: Any = {name: getattr(self, f"{name}_unit") for name in _QUANTITIES}
        skips = bool(self.skip_bad_lines)
        return self.part_of(record_of_file(path, columns, units, self.adjustments, self.reverse, skips))

    def part_of(self, record: Record) -> Record:
        """What of a record is used, with the label."""
        from .selection import select

        return select(replace(record, label=self.label) if self.label else record, **self.selection)


def _checked_units(units: Mapping[str, str] | None) -> dict[str, str]:
    """Units by quantity; raises RecordError for one that is not displacement, force or time."""
    if units is not None and not isinstance(units, Mapping):
        raise RecordError(f'`units` must be a mapping such as {{"displacement": "mm"}}, got {units!r}.')
    unknown = [name for name in units or () if name not in _QUANTITIES]
    if unknown:
        raise RecordError(f"`units` must have the keys {', '.join(_QUANTITIES)} only, got {unknown[0]!r}.")
    return {**units} if units else {}


@takes(reading=Reading)
def read_record(path: str | os.PathLike[str], *, reading: Reading) -> Record:
    """Read displacement and force, and time where there is one, from the file of a test rig.

    Files are delimited text, Excel and OpenDocument workbooks, MATLAB (.mat), TDMS, MDF 3 and 4, UFF 58, HDF5, Parquet,
    Feather and NumPy (.npy, .npz) files, any of them also compressed (gzip, bzip2, xz) or in a zip archive; the content
    decides, not the name. Of text and sheets, separator (comma, semicolon, tab, blanks), decimal mark, encoding, lines
    before the table, header and row of units are detected and reported in `Record.notes`; other files give names,
    units and sampling rates themselves. A given unit takes precedence over that of the file, and a row of units over
    the header; without any, mm, N and s are assumed. Of several sheets or groups of channels the one that holds both a
    displacement and a force is read.

    Parameters
    ----------
    path : path-like    The file; "campaign.zip/a13.csv" is a file in an archive.
    reading : Reading   Columns, units, what is done with them, and what is used of the record; or its fields as
                        keywords. Of columns a name (case, unit, blanks and underscores may differ where only one column
                        fits), or a 1-based number; text of digits is a number unless a column is called so. None finds
                        the column by its name or unit, and without a header takes the first of exactly two columns as
                        displacement, the second as force.

    Returns
    -------
    Record              Displacement [m], force [N], time [s].

    Raises
    ------
    RecordError   If the file is not a record, with place, finding and advice in one sentence.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import read_record
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "loop.csv"
    ...     _ = path.write_text("Weg [mm];Kraft [kN]\\n0;0\\n1,5;0,25\\n3;0,5\\n")
    ...     record = read_record(path)
    >>> record.displacement.tolist(), record.force.tolist()
    ([0.0, 0.0015, 0.003], [0.0, 250.0, 500.0])
    """
    return reading.read(path)


def entries(paths: Sequence[str | os.PathLike[str]], given: Reading | None = None) -> list[tuple[str, Reading]]:
    """The files that paths stand for, each a record or a description file (.toml) of several, and how to read them.

    What is given takes precedence over what description files say. A description that is wrong is a RecordError.
    """
    listed = []
    for path in paths:
        is_description = os.fspath(path).lower().endswith(".toml")
        listed += _described(Path(path)) if is_description else [(os.fspath(path), Reading())]
    return [(path, (given or Reading()).over(reading)) for path, reading in listed]


def read_campaign(path: str | os.PathLike[str], given: Reading | None = None) -> list[Record]:
    """Read the records of a description file.

    Parameters
    ----------
    path : path-like          The file; `strandspring docs rig-files` shows an example.
    given : Reading, optional  Takes precedence over what the file says.

    Returns
    -------
    list of Record

    Raises
    ------
    RecordError   If the description or one of the records is wrong; the message names file and field.
    """
    return [(given or Reading()).over(reading).read(file) for file, reading in _described(Path(path))]


def _described(path: Path) -> list[tuple[str, Reading]]:
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
        reading = _checked(record, where).over(for_all)
        listed += [(str(member), reading) for member in _files(path, file, where)]
    if len(listed) > _MAX_FILES:
        raise RecordError(f"{name}: must name at most {_MAX_FILES} files, found {len(listed)}; split it.")
    return listed


def _checked(content: Mapping[str, Any], where: str) -> Reading:
    """The fields of a table, each of the right type and none unknown."""
    hints = {name: get_type_hints(Reading)[name] for name in options_of(Reading)}
    for key, value in content.items():
        if key not in hints:
            raise RecordError(f"{where}: {key[:60]!r} is not a key; the keys are {', '.join(hints)}.")
        kinds = [kind for kind in _KINDS if kind in get_args(hints[key])]
        fits = type(value) in kinds or (float in kinds and type(value) is int)
        if kinds and not (fits and (float not in kinds or is_finite_number(value))):
            words = " or ".join(_KINDS[kind] for kind in kinds)
            raise RecordError(f"{where}, {key}: must be {words}, got {value!r:.60}.")
    try:
        return Reading(**content)
    except (RecordError, TypeError) as problem:
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
