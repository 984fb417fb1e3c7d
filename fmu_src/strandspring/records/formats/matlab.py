"""MATLAB files up to v7, read by scipy; objects of classes are neither created nor evaluated."""

from __future__ import annotations

import io
import zlib
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from ...errors import RecordError
from ..channels import Channel
from ..content import MAX_UNPACKED_BYTES, Content, too_large
from .named_arrays import Variable, channels_of

_COMPRESSED = 15  # type of an element of a v5 file
_BLOCK = 1024 * 1024


def read_tables(content: Content) -> list[Channel]:
    """Channels of vectors, matrices and structs.

    Raises
    ------
    RecordError   If the file unpacks to too much, or holds objects that only MATLAB can read and nothing else.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    _check_size(content)
    file: Any = io.BytesIO(content.data)  # which the stubs do not know that scipy reads
    raw = loadmat(file)
    variables = {name: value for name, value in raw.items() if not name.startswith("__")}
    objects = [name for name, value in raw.items() if isinstance(value, MatlabFunction | MatlabOpaque)]
    channels = list(channels_of({name: _variable(value) for name, value in variables.items() if name not in objects}))
    if objects and not channels:
        raise RecordError(
            f"{content.path}: is a MATLAB file with objects (of a class such as timeseries or table) that only MATLAB "
            "can read; save their columns as vectors, as with x = t.x; save('record.mat', 'x', 'F')."
        )
    return channels


def _variable(value: Any) -> Variable:
    """Structs as mappings, several of them as lists; cells and objects as nothing."""
    if not isinstance(value, np.ndarray) or value.dtype == object:
        return ""
    if value.dtype.names:
        elements: list[Mapping[str, Variable]] = [
            {field: _variable(element[field]) for field in value.dtype.names} for element in value.reshape(-1)
        ]
        return elements[0] if len(elements) == 1 else elements
    if value.dtype.kind == "U":
        return str(value.reshape(-1)[0]) if value.size else ""
    return value


def _check_size(content: Content) -> None:
    """Refuse a v5 file whose compressed elements unpack to too much."""
    data = content.data
    if not data.startswith(b"MATLAB"):
        return
    order: Literal["big", "little"] = "big" if data[126:128] == b"MI" else "little"
    position, left = 128, MAX_UNPACKED_BYTES
    while position + 8 <= len(data):
        kind, size = (int.from_bytes(data[position + k : position + k + 4], order) for k in (0, 4))
        if kind == _COMPRESSED:
            unpacker, rest = zlib.decompressobj(), data[position + 8 : position + 8 + size]
            while rest and not unpacker.eof and left >= 0:
                left -= len(unpacker.decompress(rest, _BLOCK))
                rest = unpacker.unconsumed_tail
        if left < 0:
            raise too_large(content.path)
        position += 8 + size
