"""Channels of named arrays in nested groups, as MATLAB, HDF5 and NumPy files hold them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from ..channels import Channel
from ..record import FloatArray

# An array (of NumPy or in an HDF5 file), a text, a group, or several groups of one form.
Variable: TypeAlias = "Array | str | Mapping[str, Variable] | Sequence[Mapping[str, Variable]]"
Array: TypeAlias = Any

_MOST_COLUMNS = 256  # of a matrix; more of them are a picture or a table of another kind
_DEEPEST = 32


def channels_of(variables: Mapping[str, Variable], group: str = "", depth: int = 0) -> Iterator[Channel]:
    """Channels of all arrays of numbers.

    A matrix is a group of its own, whose columns have no names; its longer side is that of the samples. A group with
    "time" and "data" (a timeseries of MATLAB as a struct) or "time" and "signals" (of Simulink) is channels with times.

    Parameters
    ----------
    variables : mapping   By name.
    group : str           Name of the group that they are in.
    depth : int           Of that group.
    """
    for name, variable in variables.items():
        inside = f"{group}/{name}" if group else name
        if isinstance(variable, str) or depth > _DEEPEST:
            continue
        if isinstance(variable, Mapping):
            fields = {field.casefold(): value for field, value in variable.items()}
            if _is_vector(fields.get("time")) and {"data", "signals"} & fields.keys():
                yield from _timed(fields, group, name)
            else:
                yield from channels_of(variable, inside, depth + 1)
        elif isinstance(variable, list | tuple):
            for number, element in enumerate(variable, 1):
                if isinstance(element, Mapping):
                    yield from channels_of(element, f"{inside} {number}", depth + 1)
        elif hasattr(variable, "dtype") and not hasattr(variable, "toarray"):  # which sparse ones have
            yield from array_channels(variable, group, name)


def array_channels(
    array: Array, group: str, name: str, unit: str | None = None, time: Array | None = None
) -> Iterator[Channel]:
    """The channels of an array of numbers: itself, or the columns of a matrix or of a structured array."""
    inside = f"{group}/{name}" if group else name
    if array.dtype.names:
        for field in array.dtype.names:
            if array.ndim == 1 and _is_numeric(array.dtype[field]):
                yield _channel(array, inside, field, unit, time, field=field)
        return
    longer = [side for side in array.shape if side > 1]
    if not _is_numeric(array.dtype) or len(longer) not in (1, 2):
        return
    if len(longer) == 1:
        yield _channel(array, group, name, unit, time)
    elif len(array.shape) == 2 and min(longer) <= _MOST_COLUMNS:
        for number in range(min(longer)):
            yield _channel(array, inside, "", unit, time, column=number)


def seconds(array: Any) -> FloatArray:
    """Numbers as float64; moments as seconds from the first one."""
    values = np.asarray(array)
    if values.dtype.kind == "M":
        values = (values - values[:1]) / np.timedelta64(1, "ns") * 1e-9
    elif values.dtype.kind == "m":
        values = values / np.timedelta64(1, "ns") * 1e-9
    return np.ascontiguousarray(values, dtype=np.float64).reshape(-1)


def _timed(fields: Mapping[str, Variable], group: str, name: str) -> Iterator[Channel]:
    time, signals = fields["time"], fields.get("signals")
    if signals is None:
        units = [text for key in ("unit", "units") if isinstance(text := fields.get(key), str)]
        data = fields["data"]
        if hasattr(data, "dtype"):
            yield from array_channels(data, group, name, units[0] if units else None, time)
        return
    for number, signal in enumerate([signals] if isinstance(signals, Mapping) else signals, 1):
        label, values = signal.get("label"), signal.get("values")
        if hasattr(values, "dtype"):
            channel_name = label if isinstance(label, str) and label else f"signal {number}"
            yield from array_channels(values, name, channel_name, None, time)


def _channel(
    array: Array,
    group: str,
    name: str,
    unit: str | None,
    time: Array | None,
    *,
    column: int | None = None,
    field: str | None = None,
) -> Channel:
    size = max(array.shape)
    timed = time is not None and int(np.prod(time.shape)) == size

    def load() -> tuple[FloatArray, FloatArray | None]:
        if field is not None:
            values = array[field]
        elif column is None:
            values = array[...]
        else:
            values = array[:, column] if array.shape[0] >= array.shape[1] else array[column, :]
        return seconds(np.squeeze(values)), seconds(time[...]) if timed and time is not None else None

    dtype = array.dtype if field is None else array.dtype[field]
    return Channel(group, name, "s" if dtype.kind in "mM" else unit, size, load, timed)


def _is_vector(value: Any) -> bool:
    return hasattr(value, "dtype") and _is_numeric(value.dtype) and sum(side > 1 for side in value.shape) == 1


def _is_numeric(dtype: np.dtype[Any]) -> bool:
    return dtype.kind in "fiubmM"
