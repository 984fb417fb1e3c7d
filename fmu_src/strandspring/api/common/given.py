"""Records from what Python users have: arrays, tables, files; and what they show beside a model."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ...core.parameters import SpringParameters
from ...errors import RecordError
from ...findings import Finding, Outcome
from ...ground.files import bundled_file
from ...ground.quoting import printable
from ...identification.refusals import Strokes, backwards, clipped_samples
from ...kernel.arrays import FloatArray
from ...loops.cycles import measured_loops
from ...loops.reading import Reading, entries
from ...model.modelfile import ModelFile
from ...model.stated_cautions import stated_amplitudes, stated_effects
from ...records.channels import Channel, ChannelTable
from ...records.columns import Column, choose_unit
from ...records.formats.named_arrays import seconds
from ...records.reading import record_of_tables
from ...records.record import Record
from ...records.tables import FileTables
from ...records.units import Quantity

if TYPE_CHECKING:
    import pandas as pd

_ARRAYS = "Arrays are given as displacement and force, in this order, and time if there is one."
_BUNDLED = Path("records") / "rubber_stretch.csv"
_MOMENTS = {"m": "timedelta64[ns]", "M": "datetime64[ns]"}  # by the kind of a data type

Source: TypeAlias = "Record | str | os.PathLike[str] | pd.DataFrame"
_SI: Mapping[Quantity, str] = {"displacement": "m", "force": "N", "time": "s"}
_MOST_METRES = 0.5  # of a displacement without a unit; larger ones are mostly in mm
_ROUNDING = 1e-9  # share of the range by which rounding may take a sample beyond it
_ALIKE = 0.15  # logarithm of the ratio of two amplitudes up to which they are alike
_FEW = 0.05  # share of cycles that hardly counts


def given_records(
    data: Any, force: Any = None, time: Any = None, displacement: Any = None, reading: Reading | None = None
) -> list[Record]:
    """Records of what functions are given: arrays, or sources with the columns to read.

    Parameters
    ----------
    data : Source, sequence of Source, or array_like   The displacement if it is an array.
    force, time : array_like or column   As `data` is.
    displacement : array_like or column  Stands for `data` if that is None.
    reading : Reading or None            How the others are read, and what is used of each. Arrays are in its units,
                                         else in those in the names of Series, such as "x [mm]", else in m, N and s.

    Raises
    ------
    RecordError   If one of them is not a record, a unit is unknown, or the indexes of Series differ.
    TypeError     If arrays and columns are mixed, or something is said about arrays that is of files only.
    """
    reading = reading or Reading()
    if data is None:
        data, displacement = displacement, None
    if not _is_array(data):
        columns = {"displacement": displacement, "force": force, "time": time}
        return as_records(data, replace(reading, **{name: at for name, at in columns.items() if at is not None}))
    if displacement is not None or force is None:
        raise TypeError(_ARRAYS)
    if others := reading.reading.keys() - {"reverse", *(f"{name}_unit" for name in _SI)}:
        raise TypeError(f"`{min(others)}` says how a file or a table is read, and arrays are given.")
    series = {name: given for name, given in zip(_SI, (data, force, time), strict=True) if given is not None}
    indexed = [name for name, given in series.items() if hasattr(getattr(given, "index", None), "equals")]
    for first, name in pairwise(indexed):
        # pandas would pair them by their indexes, a record pairs them by their order.
        if not series[first].index.equals(series[name].index):
            raise RecordError(
                f"<arrays>: the Series of {first} and {name} must have the same index; take both from one DataFrame, "
                "or pair them by `.to_numpy()`."
            )
    record, values, findings = Record(data, force, time), dict[str, Any](), []  # which makes arrays of them
    for number, (name, given) in enumerate(series.items(), start=1):
        label = getattr(given, "name", None)
        column = Column.from_header(number, label if isinstance(label, str) else "", None)
        _, factor, origin = choose_unit(column, name, getattr(reading, f"{name}_unit"), record.path, _SI)
        values[name] = (-factor if name == reading.reverse else factor) * getattr(record, name)
        findings.append(origin)
    return [reading.part_of(_within_metres(Record(**values, path=record.path, findings=tuple(findings))))]


def _within_metres(record: Record) -> Record:
    """The record, unless its displacement is too large for the assumed unit."""
    largest = float(np.abs(record.displacement).max())
    assumed = [finding.numbers["quantity"] for finding in record.findings if finding.kind is Outcome.UNIT_ASSUMED]
    if largest > _MOST_METRES and "displacement" in assumed:
        raise RecordError(
            f"{record.path}: a displacement without a unit is in m and must be within +-{_MOST_METRES:g} m, found "
            f'{largest:.6g}; give its unit, such as units={{"displacement": "mm"}}.'
        )
    return record


def records_of(data: Sequence[Any], reading: Reading) -> list[Record]:
    """Records of sources, of one sequence of them, or of arrays."""
    if data and _is_array(data[0]):
        return given_records(*data, reading=reading)  # type: ignore[misc]  # of too many arrays a TypeError
    return as_records(data[0] if len(data) == 1 else list(data), reading)


def as_records(sources: Any, reading: Reading | None = None) -> list[Record]:
    """Records of a path, a table or a record, or of a sequence of these; a path may be that of a description file.

    Raises
    ------
    RecordError   If one of them is not a record.
    TypeError     If one is something else.
    """
    reading, records = reading or Reading(), list[Record]()
    for source in sources if isinstance(sources, Sequence) and not isinstance(sources, str) else [sources]:
        if isinstance(source, str | os.PathLike):
            records += [of_file.read(path) for path, of_file in entries([source], reading)]
        elif hasattr(source, "columns"):
            records.append(reading.part_of(_record_of_frame(source, reading)))
        elif not isinstance(source, Record):
            raise TypeError(
                f"Records must be a path, a Record, a DataFrame or a list of these, got {type(source).__name__}; give "
                "arrays as displacement and force."
            )
        elif given := next(iter(reading.reading), None):
            raise TypeError(f"`{given}` says how a file or a table is read, and {source.path} is a record already.")
        else:
            records.append(reading.part_of(source))
    return records


def _record_of_frame(frame: pd.DataFrame, reading: Reading) -> Record:
    """A record of a table in memory; m, N and s where no unit is given or in a name."""
    channels, others = list[Channel](), list[str]()
    for name, column in frame.items():
        if column.dtype.kind not in "fiumM":
            others.append(f"{str(name)!r} ({column.dtype})")
            continue
        moment = _MOMENTS.get(column.dtype.kind)
        with np.errstate(over="ignore"):  # infinity is refused where it is read
            values = seconds(column.to_numpy(dtype=moment)) if moment else np.asarray(column, dtype=np.float64)
        channels.append(Channel("", str(name), "s" if moment else None, values.size, partial(_untimed, values)))
    if len(channels) < 2 and others:
        raise RecordError(
            f"<DataFrame>: must hold at least two columns of numbers, but {', '.join(others)} hold none; convert them "
            "with `pandas.to_numeric`."
        )
    tables = FileTables("<DataFrame>", [ChannelTable(channels, "<DataFrame>")])
    asked = {name: getattr(reading, name) for name in _SI}
    units = {name: getattr(reading, f"{name}_unit") for name in _SI}
    return _within_metres(record_of_tables(tables, asked, units, reading.adjustments, reading.reverse, _SI))


def _untimed(values: FloatArray) -> tuple[FloatArray, None]:
    return values, None


def _is_array(values: Any) -> bool:
    """Whether values are numbers, rather than a record or several."""
    if isinstance(values, Sequence) and not isinstance(values, str):
        return len(values) > 0 and all(isinstance(value, int | float | np.number) for value in values)
    return hasattr(values, "__array__") and not hasattr(values, "columns")


def bundled_record(models: Path | None = None) -> Path:
    """The measured record that comes with the program: a rubber hinge on a tensile rig, displacement to be reversed.

    Parameters
    ----------
    models : Path or None   A folder that may hold it, besides the package and the source checkout.

    Raises
    ------
    RecordError             If it is missing.
    """
    for path in (*([] if models is None else [models / _BUNDLED]), bundled_file(_BUNDLED)):
        if path.is_file():
            return path
    raise RecordError(f"{_BUNDLED}: the bundled record is missing; install strandspring again.")


def of_records(records: Sequence[Record], source: str = "", model: ModelFile | None = None) -> Iterator[Finding]:
    """Loops that run backwards, clipped forces, and effects of the rig that were removed from a model's records."""
    if records and model is not None and (effects := effects_of(model)):
        yield Finding(Outcome.RIG_REMOVED, {"effects": effects}, source)
    for record in records:
        if (kind := backwards(Strokes(record))) is not None:
            yield Finding(kind, {}, record.path)
        if clipped := int(np.count_nonzero(clipped_samples(record.force))):
            yield Finding(Outcome.CLIPPED_BESIDE, {"count": clipped, "samples": len(record)}, record.path)


def unrecorded(source: str, model: ModelFile, record: Record) -> Iterator[Finding]:
    """Loops of a record, or all of it, of no amplitude that the model was identified from."""
    known = np.array(sorted(stated_amplitudes(model)))
    loops = [(loop.figures.amplitude, loop.cycles) for loop in measured_loops([record])]
    amplitudes, cycles = np.array(loops or [(0.5 * float(np.ptp(record.displacement)), 1)]).T
    if not known.size or not amplitudes.all():
        return
    alike = np.abs(np.log(amplitudes[:, None] / known)).min(axis=1) <= _ALIKE
    if cycles[~alike].sum() > _FEW * cycles.sum():
        ends = (float(amplitudes[~alike].min()), float(amplitudes[~alike].max()))
        numbers = {"model": source, "known": tuple(known.tolist()), "recorded": (ends,)}
        yield Finding(Outcome.OTHER_AMPLITUDES, numbers, record.path)


def outside(source: str, displacement: FloatArray, p: SpringParameters) -> Iterator[Finding]:
    """Displacements [m] outside the identified range."""
    slack = _ROUNDING * (p.displacement_max - p.displacement_min)
    share = np.mean((displacement < p.displacement_min - slack) | (displacement > p.displacement_max + slack))
    if share > 0.0:
        numbers = {"share": float(share), "range": ((p.displacement_min, p.displacement_max),)}
        yield Finding(Outcome.OUTSIDE_RANGE, numbers, source)


def effects_of(model: ModelFile) -> str:
    """The effects of the rig that were removed from a model's records, in words; empty if none was."""
    return printable(", ".join(stated_effects(model)).replace("_", " "))
