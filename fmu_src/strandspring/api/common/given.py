"""Records from what Python users have: arrays, tables, files, records."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ...errors import RecordError
from ...findings import Outcome
from ...ground.files import bundled_file
from ...loops.reading import Reading, entries
from ...records.channels import Channel, ChannelTable
from ...records.columns import Column, choose_unit
from ...records.formats.named_arrays import seconds
from ...records.reading import record_of_tables
from ...records.record import FloatArray, Record
from ...records.tables import FileTables
from ...records.units import Quantity

if TYPE_CHECKING:
    import pandas as pd

_ARRAYS = "Arrays are given as displacement and force, in this order, and time if there is one."
_BUNDLED = Path("records") / "rubber_stretch.csv"

Source: TypeAlias = "Record | str | os.PathLike[str] | pd.DataFrame"
_QUANTITIES: tuple[Quantity, ...] = ("displacement", "force", "time")
_SI: Mapping[Quantity, str] = {"displacement": "m", "force": "N", "time": "s"}
_MOST_METRES = 0.5  # of a displacement whose unit is assumed: beyond, it is in mm more often than in m


def record_of_arrays(
    displacement: ArrayLike,
    force: ArrayLike,
    time: ArrayLike | None = None,
    reading: Reading | None = None,
) -> Record:
    """A record of arrays in given units.

    Parameters
    ----------
    displacement, force : array_like, shape (K,)
    time : array_like, shape (K,), or None
    reading : Reading or None   Units, if None those in the name of a Series, such as "x [mm]", else m, N and s, for
                                displacements within +-0.5 m; the array to negate; and what is used.

    Raises
    ------
    RecordError                 If the arrays do not make a record, a unit is unknown, the indexes of Series differ, or
                                a displacement without a unit is beyond 0.5 m.

    Examples
    --------
    >>> in_mm = Reading(displacement_unit="mm")
    >>> record_of_arrays([0.0, 5.0, 0.0], [0.0, 1.2, -0.3], reading=in_mm).displacement.tolist()
    [0.0, 0.005, 0.0]
    """
    reading = reading or Reading()
    taken = {"reverse", *(f"{name}_unit" for name in _QUANTITIES)}
    if others := [name for name in reading.reading if name not in taken]:
        raise TypeError(f"`{others[0]}` says how a file or a table is read, and arrays are given.")
    series = {"displacement": displacement, "force": force, "time": time}
    _refuse_other_index(series)
    record = Record(displacement, force, time)  # type: ignore[arg-type]  # which makes arrays of them
    values: dict[str, Any] = {}
    findings = []
    for number, name in enumerate(_QUANTITIES if time is not None else _QUANTITIES[:2], start=1):
        label = getattr(series[name], "name", None)
        column = Column.from_header(number, label if isinstance(label, str) else "", None)
        _, factor, origin = choose_unit(column, name, getattr(reading, f"{name}_unit"), record.path, _SI)
        values[name] = (-factor if name == reading.reverse else factor) * getattr(record, name)
        findings.append(origin)
    return reading.part_of(_within_metres(Record(**values, path=record.path, findings=tuple(findings))))


def _within_metres(record: Record) -> Record:
    """The record, unless its displacement is so large that the assumed unit is hardly right."""
    largest = float(np.abs(record.displacement).max())
    assumed = [finding.numbers["quantity"] for finding in record.findings if finding.kind is Outcome.UNIT_ASSUMED]
    if largest > _MOST_METRES and "displacement" in assumed:
        raise RecordError(
            f"{record.path}: a displacement without a unit is in m and must be within +-{_MOST_METRES:g} m, found "
            f'{largest:.6g}; give its unit, such as units={{"displacement": "mm"}}, or "m" if it is that large.'
        )
    return record


def _refuse_other_index(arrays: Mapping[str, Any]) -> None:
    """Refuse pandas Series with other indexes: pandas would pair them by these, a record pairs them by their order."""
    series = [(name, values) for name, values in arrays.items() if hasattr(getattr(values, "index", None), "equals")]
    for (first, first_series), (name, other) in pairwise(series):
        if not first_series.index.equals(other.index):
            raise RecordError(
                f"<arrays>: the Series of {first} and {name} must have the same index; take them from one DataFrame, "
                "or give `.to_numpy()` of both to pair them by their order."
            )


def given_records(
    data: Any, force: Any = None, time: Any = None, displacement: Any = None, reading: Reading | None = None
) -> list[Record]:
    """Records of what `identify` and others are given: arrays, or sources with the columns to read.

    Parameters
    ----------
    data : Source, sequence of Source, or array_like   The displacement if it is an array.
    force, time : array_like or column                 As `data` is.
    displacement : array_like or column                Stands for `data` if that is None.
    reading : Reading or None                          How the others are read, and what is used of each.

    Raises
    ------
    RecordError   If one of them is not a record.
    TypeError     If arrays and columns are mixed, or something is said about arrays that is of files only.
    """
    reading = reading or Reading()
    if data is None:
        data, displacement = displacement, None
    if is_array(data):
        if displacement is not None or force is None:
            raise TypeError(_ARRAYS)
        return [record_of_arrays(data, force, time, reading)]
    columns = {"displacement": displacement, "force": force, "time": time}
    return as_records(data, replace(reading, **{name: at for name, at in columns.items() if at is not None}))


def records_of(data: Sequence[Any], reading: Reading) -> list[Record]:
    """Records of the arguments of a function that takes any number of sources, or arrays; none of no arguments.

    Parameters
    ----------
    data : sequence     Sources, one sequence of sources, or arrays of displacement, force and perhaps time.
    reading : Reading   As for `given_records`.
    """
    if not data:
        return []
    if is_array(data[0]):
        if len(data) > 3:
            raise TypeError(_ARRAYS)
        moved, forces, times = (*data, None, None)[:3]
        return given_records(moved, forces, times, None, reading)
    return given_records(data[0] if len(data) == 1 else list(data), reading=reading)


def _record_of_frame(frame: pd.DataFrame, reading: Reading) -> Record:
    """A record of a table in memory; m, N and s where no unit is given or in a name."""
    import pandas as pd

    channels: list[Channel] = []
    others: list[str] = []
    for k, (name, dtype) in enumerate(zip(frame.columns, frame.dtypes, strict=True)):
        if dtype.kind in "mM":
            moments = frame.iloc[:, k].to_numpy(dtype=f"{'timedelta' if dtype.kind == 'm' else 'datetime'}64[ns]")
            channels.append(_channel(str(name), seconds(moments), "s"))
        elif pd.api.types.is_numeric_dtype(dtype) and dtype.kind in "fiu":
            with np.errstate(over="ignore"):  # infinity is refused where it is read
                channels.append(_channel(str(name), np.asarray(frame.iloc[:, k], dtype=np.float64), None))
        else:
            others.append(f"{name!r} ({dtype})")
    if len(channels) < 2 and others:
        raise RecordError(
            f"<DataFrame>: must hold at least two columns of numbers, but {', '.join(others)} hold none; convert them "
            "with `pandas.to_numeric`."
        )
    record = record_of_tables(
        FileTables("<DataFrame>", [ChannelTable(channels, "<DataFrame>")]),
        {name: getattr(reading, name) for name in _QUANTITIES},
        {name: getattr(reading, f"{name}_unit") for name in _QUANTITIES},
        reading.adjustments,
        reading.reverse,
        _SI,
    )
    return _within_metres(record)


def _channel(name: str, values: FloatArray, unit: str | None) -> Channel:
    return Channel("", name, unit, values.size, lambda: (values, None))


def as_records(sources: Any, reading: Reading | None = None) -> list[Record]:
    """Records of a path, a table or a record, or of a sequence of these; a path may be that of a description file.

    Raises
    ------
    RecordError   If one of them is not a record.
    TypeError     If one is something else.
    """
    is_one = isinstance(sources, Record | str | os.PathLike) or hasattr(sources, "columns")
    if not (is_one or isinstance(sources, Sequence)):
        raise TypeError(
            f"Records must be a path, a Record, a DataFrame or a list of these, got {type(sources).__name__}; give "
            "arrays as displacement and force."
        )
    return [
        record for source in ([sources] if is_one else sources) for record in _records(source, reading or Reading())
    ]


def _records(source: Any, reading: Reading) -> list[Record]:
    if isinstance(source, Record):
        if given := reading.reading:
            name = next(iter(given))
            raise TypeError(f"`{name}` says how a file or a table is read, and {source.path} is a record already.")
        return [reading.part_of(source)]
    if hasattr(source, "columns"):
        return [reading.part_of(_record_of_frame(source, reading))]
    if isinstance(source, str | os.PathLike):
        return [of_file.read(path) for path, of_file in entries([source], reading)]
    raise TypeError(f"A record must be a path, a Record or a DataFrame, got {type(source).__name__}.")


def is_array(values: Any) -> bool:
    """Whether values are numbers in one array, rather than a record or several."""
    if isinstance(values, np.ndarray):
        return True
    if isinstance(values, Sequence) and not isinstance(values, str):
        return len(values) > 0 and all(isinstance(value, int | float | np.number) for value in values)
    return hasattr(values, "__array__") and not hasattr(values, "columns")


def bundled_record(models: Path | None = None) -> Path:
    """The measured record that comes with the program: a rubber hinge on a tensile rig, displacement to be reversed.

    Parameters
    ----------
    models : Path or None   A folder that may hold it; else it is the installed package's or the source checkout's.

    Raises
    ------
    RecordError             If it is missing.
    """
    for path in (*([] if models is None else [models / _BUNDLED]), bundled_file(_BUNDLED)):
        if path.is_file():
            return path
    raise RecordError(f"{_BUNDLED}: the bundled record is missing; install strandspring again.")
