"""Numbers of a large table of nothing but numbers, in parts; where one holds anything else the row reader goes on."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence

import numpy as np

from .dialect import Dialect
from .record import FloatArray

_LEAST, _PART = 1 << 20, 1 << 22  # of a text that is worth it, and of a part [B]


def plain_parts(data: bytes, begin: int, dialect: Dialect, places: Sequence[int]) -> Iterator[tuple[FloatArray, int]]:
    """Numbers of the cells at some places of rows from an offset on, shape (K, places), and the bytes of these rows.

    A part ends the iteration unless each of its rows has as many cells as most rows of the table, of the characters of
    numbers, and those at the places are finite numbers: so a number here is that of the row reader, to the bit.
    """
    if len(data) < _LEAST or dialect.separator is None or dialect.has_quotes:
        return
    characters = b"0123456789+-eE \n" + (dialect.decimal + dialect.separator).encode()
    mark = ord(dialect.separator)
    while end := data.rfind(b"\n", begin, begin + _PART) + 1:
        part = data[begin:end]
        codes = np.frombuffer(part, dtype=np.uint8)
        ends = np.flatnonzero(codes == ord("\n"))
        cells = 1 + np.diff(np.searchsorted(np.flatnonzero(codes == mark), ends), prepend=0)
        if part.translate(None, characters) or np.any(cells != dialect.raw_width):
            return
        try:
            # A decimal comma is not the separator.
            lines = io.BytesIO(part if dialect.decimal == "." else part.replace(b",", b"."))
            values = np.loadtxt(lines, comments=None, delimiter=dialect.separator, usecols=places, ndmin=2)
        except ValueError:
            return
        if len(values) != ends.size or not np.isfinite(values).all():
            return
        yield values, end - begin
        begin = end
