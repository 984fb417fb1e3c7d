"""MATLAB files up to v7, read by scipy: vectors, matrices and structs; objects of classes are not created."""

from __future__ import annotations

import io
import zlib
from typing import Any, Literal

from scipy.io import loadmat, whosmat

from ...errors import RecordError
from ..channels import Channel
from ..content import MAX_UNPACKED_BYTES, FileContent, too_large
from .named_arrays import channels_of

_HEADER = 128
_COMPRESSED = 15
_OBJECTS = ("object", "opaque", "function")  # classes of arrays


def read_tables(content: FileContent) -> list[Channel]:
    """Channels of vectors, matrices and structs.

    Raises
    ------
    RecordError   If the file unpacks to too much, or holds objects that only MATLAB can read and nothing else.
    """
    if content.data.startswith(b"MATLAB"):
        _check_unpacked_size(content)
    file: Any = io.BytesIO(content.data)  # which the stubs do not know that scipy reads
    variables = loadmat(file, simplify_cells=True)
    objects = {name for name, _, kind in whosmat(file) if kind in _OBJECTS}
    kept = {name: value for name, value in variables.items() if name not in objects and not name.startswith("__")}
    channels = list(channels_of(kept))
    if objects and not channels:
        raise RecordError(
            f"{content.path}: is a MATLAB file with objects (of a class such as timeseries or table) that only MATLAB "
            "can read; save their columns as vectors, as with x = t.x; save('record.mat', 'x', 'F')."
        )
    return channels


def _check_unpacked_size(content: FileContent) -> None:
    """Refuse a file whose compressed elements unpack to too much; each is a type, a size and data."""
    order: Literal["little", "big"] = "big" if content.data[126:128] == b"MI" else "little"
    left, position = MAX_UNPACKED_BYTES, _HEADER
    while position + 8 <= len(content.data):
        kind = int.from_bytes(content.data[position : position + 4], order)
        begin = position + 8
        position = begin + int.from_bytes(content.data[position + 4 : begin], order)
        if kind == _COMPRESSED:
            left -= len(zlib.decompressobj().decompress(content.data[begin:position], left + 1))
        if left < 0:
            raise too_large(content.path)
