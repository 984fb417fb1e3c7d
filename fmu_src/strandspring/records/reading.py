"""Reading of measured records from the files that test rigs write."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import Literal

import numpy as np

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.quoting import quoted
from .columns import DEFAULT_UNITS, Asked, Column, choose_unit
from .content import read_content
from .formats.opening import tables_of
from .record import FloatArray, Record, is_finite_number
from .spikes import find_spikes, spikes_of
from .tables import FileTables, Table, choose_table
from .units import Quantity, unit_factor

# Beyond any rig: the unit is wrong.
_MAX_TRAVEL = 10.0  # [m]
_MAX_FORCE = 1e9  # [N]
_SI: Mapping[Quantity, str] = {"displacement": "m", "force": "N"}


def read_record(
    path: str | os.PathLike[str],
    *,
    displacement: int | str | None = None,
    force: int | str | None = None,
    time: int | str | None = None,
    displacement_unit: str | None = None,
    force_unit: str | None = None,
    time_unit: str | None = None,
    reverse: Literal["displacement", "force"] | None = None,
    displacement_offset: float = 0.0,
    force_offset: float = 0.0,
    displacement_scale: float = 1.0,
    force_scale: float = 1.0,
    skip_bad_lines: bool = False,
) -> Record:
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
    path : path-like                               The file; "campaign.zip/a13.csv" is a file in an archive.
    displacement, force, time : int, str or None   Columns: a name (case, unit, blanks and underscores may
        differ where only one column fits), or a 1-based number. Text of digits is a number unless a column
        is called so; of several sheets or groups, "sheet/column" or "group/channel". None finds the column
        by its name or unit, and without a header takes the first of exactly two columns as displacement,
        the second as force. The time column is optional.
    displacement_unit, force_unit, time_unit : str or None   Such as "mm", "inch"; "kN", "lbf"; "ms".
    reverse : "displacement", "force" or None      The column to negate.
    displacement_offset, force_offset : float      Subtracted from the column, in the column's own units.
    displacement_scale, force_scale : float        Factor of what is left, such as kN per V; the product has the unit.
    skip_bad_lines : bool                          Whether lines of a text, or rows of a sheet, that cannot be read are
        left out, up to a tenth of all, which `Record.notes` says; else a file with such lines is refused.

    Returns
    -------
    Record                                         Displacement [m], force [N], time [s].

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
    check_skipping(skip_bad_lines)
    return record_of_tables(
        tables_of(read_content(path), skip_bad_lines),
        {"displacement": displacement, "force": force, "time": time},
        {"displacement": displacement_unit, "force": force_unit, "time": time_unit},
        {"displacement": (displacement_offset, displacement_scale), "force": (force_offset, force_scale)},
        reverse,
    )


def check_reverse(reverse: str | None) -> None:
    """Refuse a column to negate that is neither displacement nor force, with a RecordError."""
    if reverse not in (None, "displacement", "force"):
        raise RecordError(f"`reverse` must be 'displacement' or 'force', got {quoted(str(reverse))}.")


def check_skipping(skip_bad_lines: bool) -> None:
    """Refuse what is not a truth value, with a RecordError."""
    if not isinstance(skip_bad_lines, bool):
        raise RecordError(f"`skip_bad_lines` must be True or False, got {quoted(str(skip_bad_lines))}.")


def record_of_tables(
    file: FileTables,
    asked: Asked,
    units: Mapping[Quantity, str | None],
    adjustments: Mapping[Quantity, tuple[float, float]],
    reverse: Literal["displacement", "force"] | None,
    default_units: Mapping[Quantity, str] = DEFAULT_UNITS,
) -> Record:
    """The record that the tables of a file hold.

    Parameters
    ----------
    file : FileTables
    asked, units : mapping       Column and unit of each quantity; None to detect it.
    adjustments : mapping        Offset and factor of displacement and force.
    reverse : "displacement", "force" or None   The column to negate.
    default_units : mapping      Units where neither file nor caller gives one.

    Raises
    ------
    RecordError                  If the tables hold no record.
    """
    check_reverse(reverse)
    _refuse_useless(adjustments)
    where = file.path
    table, columns, chosen = choose_table(file, asked)
    seeks_time = asked["time"] is None
    arrays, left_out = table.read(columns.values(), optional=columns.get("time") if seeks_time else None)
    findings = [*file.findings, *table.findings, *chosen, *left_out]
    values: dict[Quantity, FloatArray] = {}
    own_units: dict[Quantity, str] = {}
    for quantity, column in columns.items():
        if column.number not in arrays:
            continue
        try:
            unit, factor, origin = choose_unit(column, quantity, units.get(quantity), where, default_units)
        except RecordError as error:
            if quantity == "time" and seeks_time and units.get("time") is None:
                findings.append(Finding(Outcome.TIME_LEFT_OUT, {"problem": str(error)}))
                continue
            raise
        own_units[quantity] = unit
        findings.append(origin)
        series = arrays.pop(column.number)  # of a long record each array counts
        offset, scale = adjustments.get(quantity, (0.0, 1.0))
        if offset != 0.0:
            findings.append(Finding(Outcome.OFFSET, {"quantity": quantity, "offset": offset}))
        if scale != 1.0:
            findings.append(Finding(Outcome.SCALE, {"quantity": quantity, "scale": scale}))
        with np.errstate(over="ignore"):  # what overflows is refused below
            values[quantity] = (series - offset) * scale * factor if (offset, scale) != (0.0, 1.0) else series * factor
        del series
    if seeks_time and "time" in values and not _is_a_clock(values["time"]):
        findings.append(Finding(Outcome.TIME_LEFT_OUT, {"column": str(columns["time"]), "problem": "it does not rise"}))
        del values["time"]
    _refuse_impossible(values, columns, own_units, table, where)
    findings += _outliers(values, table)
    if reverse is not None:
        values[reverse] = -values[reverse]
        findings.append(Finding(Outcome.REVERSED, {"quantity": reverse}))
    return Record(
        values["displacement"],
        values["force"],
        values.get("time"),
        path=where,
        sha256=file.sha256,
        findings=tuple(findings),
    )


def _refuse_useless(adjustments: Mapping[Quantity, tuple[float, float]]) -> None:
    for quantity, (offset, scale) in adjustments.items():
        if not is_finite_number(offset):
            raise RecordError(f"`{quantity}_offset` must be a finite number, got {quoted(str(offset))}.")
        if not (is_finite_number(scale) and scale > 0.0):
            raise RecordError(
                f"`{quantity}_scale` must be a finite number > 0, got {quoted(str(scale))}; negate a column with "
                "`reverse`."
            )


def _is_a_clock(time: FloatArray) -> bool:
    with np.errstate(invalid="ignore"):  # numbers may be infinite
        return time.size > 1 and bool((np.diff(time) >= 0.0).all() and time[-1] > time[0])


def _outliers(values: Mapping[Quantity, FloatArray], table: Table) -> Iterator[Finding]:
    """The isolated outliers of displacement and force, with their rows."""
    for quantity, spikes in zip(_SI, spikes_of(values["displacement"], values["force"]), strict=True):
        if spikes.size:
            places = tuple(f"{table.row} {place}" for place in table.places(spikes.tolist()))
            numbers = {quantity: tuple(values[quantity][spikes].tolist()), f"{quantity}_at": places}
            yield Finding(Outcome.OUTLIERS, numbers)


def _refuse_impossible(
    values: Mapping[Quantity, FloatArray],
    columns: Mapping[Quantity, Column],
    units: Mapping[Quantity, str],
    table: Table,
    where: str,
) -> None:
    """Refuse what no rig measures: a single sample, a constant, a size that only a wrong unit or value explains."""
    for quantity in ("displacement", "force"):
        series, place = values[quantity], f"{where}, {columns[quantity]}"
        if series.size < 2:
            raise RecordError(f"{where}: must have at least 2 rows of numbers, found {series.size}.")
        if series.min() == series.max():
            raise RecordError(
                f"{place}: the {quantity} must change, found {series[0]:.6g} in all {series.size} rows; "
                f"name the column of the {quantity}."
            )
    # The range may overflow.
    with np.errstate(over="ignore"):
        travel = float(np.ptp(values["displacement"]))
    largest = float(np.abs(values["force"]).max())
    sizes: Mapping[Quantity, tuple[float, float, str]] = {
        "displacement": (travel, _MAX_TRAVEL, "range over"),
        "force": (largest, _MAX_FORCE, "be"),
    }
    for quantity, (size, limit, rule) in sizes.items():
        if size > limit:
            series, unit = values[quantity], units[quantity]
            with np.errstate(invalid="ignore"):  # numbers may be infinite
                middle = np.median(series) if quantity == "displacement" else 0.0
                (row,) = table.places([int(np.argmax(np.abs(0.5 * series - 0.5 * middle)))])
            raise RecordError(
                f"{where}, {table.row} {row}, {columns[quantity]}: the {quantity} must {rule} at most "
                f"{limit:g} {_SI[quantity]}, found {size:.6g} {_SI[quantity]} with the unit {unit}; "
                f"{_advice(series, quantity, unit, limit / size, table.row)}"
            )


def _advice(series: FloatArray, quantity: Quantity, unit: str, needed: float, row: str) -> str:
    """Advice for too large numbers: another unit only if that makes all of them possible."""
    if find_spikes(series).size:
        return f"correct or delete the {row}."
    smaller = {"mm": "um", "N": "mN"}.get(unit, "mm" if quantity == "displacement" else "N")
    if unit_factor(smaller, quantity) <= needed * unit_factor(unit, quantity):
        return f"is the unit {smaller}?"
    return "correct the values, or name another column."
