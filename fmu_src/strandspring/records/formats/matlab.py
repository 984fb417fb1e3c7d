"""MATLAB files up to v7: vectors, matrices and structs; objects of classes are neither created nor evaluated.

Files of version 5 to 7 are read here and not by scipy, which a few damaged bytes make write outside its memory. Their
format is MathWorks' "MAT-File Format": elements of a type, a size and data, some of them compressed, most of them
matrices, which are elements of elements.
"""

from __future__ import annotations

import io
import math
import zlib
from collections.abc import Iterator, Mapping
from typing import Any, Literal, TypeAlias

import numpy as np

from ...errors import RecordError
from ..channels import Channel
from ..content import MAX_UNPACKED_BYTES, Content, too_large
from .named_arrays import Variable, channels_of

_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
# Types of data, by which arrays of any class may be stored.
_DTYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "latin-1", 2: "utf-8", 4: "utf-16-?", 16: "utf-8", 17: "utf-16-?", 18: "utf-32-?"}
# Classes of arrays.
_STRUCT, _CHAR, _NUMBERS = 2, 4, range(6, 16)
_OBJECTS = (3, 16, 17)
_IS_COMPLEX = 0x0800  # attribute of an array
_DEEPEST = 32

Order: TypeAlias = Literal["little", "big"]


def read_tables(content: Content) -> list[Channel]:
    """Channels of vectors, matrices and structs.

    Raises
    ------
    RecordError   If the file unpacks to too much, or holds objects that only MATLAB can read and nothing else.
    """
    if not content.data.startswith(b"MATLAB"):
        from scipy.io import loadmat

        file: Any = io.BytesIO(content.data)  # which the stubs do not know that scipy reads
        return list(channels_of({name: value for name, value in loadmat(file).items() if _is_numeric(value)}))
    order: Order = "big" if content.data[126:128] == b"MI" else "little"
    variables: dict[str, Variable] = {}
    has_objects = False
    for kind, data in _unpacked_elements(content, order):
        if kind == _MATRIX:
            name, variable = _matrix(data, order)
            has_objects |= variable is None
            variables |= {} if variable is None else {name: variable}
    channels = list(channels_of(variables))
    if has_objects and not channels:
        raise RecordError(
            f"{content.path}: is a MATLAB file with objects (of a class such as timeseries or table) that only MATLAB "
            "can read; save their columns as vectors, as with x = t.x; save('record.mat', 'x', 'F')."
        )
    return channels


def _is_numeric(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiub"


def _unpacked_elements(content: Content, order: Order) -> Iterator[tuple[int, bytes]]:
    """The elements of a file, compressed ones unpacked."""
    left = MAX_UNPACKED_BYTES
    for kind, data in _elements(content.data[_HEADER:], order):
        if kind != _COMPRESSED:
            yield kind, data
            continue
        unpacked = zlib.decompressobj().decompress(data, left + 1)
        left -= len(unpacked)
        if left < 0:
            raise too_large(content.path)
        yield from _elements(unpacked, order)


def _elements(data: bytes, order: Order) -> Iterator[tuple[int, bytes]]:
    """Type and data of successive elements."""
    position = 0
    while position + 8 <= len(data):
        kind = int.from_bytes(data[position : position + 4], order)
        size = int.from_bytes(data[position + 4 : position + 8], order)
        begin = position + 8
        if kind >> 16:  # up to four bytes of data stand in the place of the size
            kind, size, begin = kind & 0xFFFF, kind >> 16, position + 4
        end = begin + size
        if end > len(data) or (begin == position + 4 and size > 4):
            raise ValueError("an element goes beyond its end")
        yield kind, data[begin:end]
        position = end if kind == _COMPRESSED else end + (-end) % 8


def _matrix(data: bytes, order: Order, depth: int = 0) -> tuple[str, Variable | None]:
    """Name and content of an array: numbers, text, struct or structs; "" for cells and the like, None for objects."""
    parts = _elements(data, order)
    flags = next(parts, (0, b""))[1]
    attributes = int.from_bytes(flags[:4], order)
    kind = attributes & 0xFF
    if not flags or depth > _DEEPEST:
        return "", ""
    if kind == _OBJECTS[-1]:
        return "", None
    shape = tuple(_numbers(*next(parts), order).astype(int).tolist())
    name = next(parts)[1].decode("latin-1")
    if kind in _OBJECTS:
        return name, None
    if kind == _STRUCT:
        return name, _struct(parts, math.prod(shape), order, depth)
    if kind == _CHAR:
        stored, text = next(parts, (1, b""))
        return name, text.decode(_TEXTS.get(stored, "latin-1").replace("-?", f"-{order[0]}e"), "replace")
    if kind in _NUMBERS and not attributes & _IS_COMPLEX:
        return name, _numbers(*next(parts), order).reshape(shape, order="F")
    return name, ""


def _struct(parts: Iterator[tuple[int, bytes]], size: int, order: Order, depth: int) -> Variable:
    width = int(_numbers(*next(parts), order)[0])
    names = next(parts)[1]
    fields = [names[k : k + width].split(b"\0")[0].decode("latin-1") for k in range(0, len(names), max(width, 1))]
    elements: list[Mapping[str, Variable]] = []
    for _ in range(size):
        found = {field: _matrix(next(parts)[1], order, depth + 1)[1] for field in fields}
        elements.append({field: variable for field, variable in found.items() if variable is not None})
        if not fields:
            break
    return elements[0] if len(elements) == 1 else elements


def _numbers(kind: int, data: bytes, order: Order) -> np.ndarray[tuple[int, ...], np.dtype[Any]]:
    if kind not in _DTYPES:
        raise ValueError(f"unknown type {kind} of data")
    return np.frombuffer(data, np.dtype(_DTYPES[kind]).newbyteorder("<" if order == "little" else ">"))
