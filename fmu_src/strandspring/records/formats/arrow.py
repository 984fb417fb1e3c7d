"""Parquet and Feather files, read by pyarrow."""

from __future__ import annotations

from typing import Any

import pyarrow as pa
from pyarrow import feather, parquet

from ..channels import Channel
from ..content import FileContent
from ..record import FloatArray
from .named_arrays import seconds

_UNITS = (b"unit", b"units")


def read_tables(content: FileContent) -> list[Channel]:
    """Channels of the numeric columns, with the units that the metadata of a field gives."""
    source = pa.BufferReader(content.data)
    if content.data.startswith(b"PAR1"):
        file = parquet.ParquetFile(source)
        schema, size = file.schema_arrow, file.metadata.num_rows

        def column(name: str) -> Any:
            return file.read(columns=[name]).column(0)

    else:
        table = feather.read_table(source)
        schema, size = table.schema, table.num_rows
        column = table.column

    def channel(field: pa.Field) -> Channel:
        def load() -> tuple[FloatArray, None]:
            return seconds(column(field.name).to_numpy(zero_copy_only=False)), None

        metadata = field.metadata or {}
        units = [metadata[key].decode("utf-8", "replace") for key in _UNITS if key in metadata]
        is_moment = pa.types.is_temporal(field.type)
        return Channel("", field.name, "s" if is_moment else units[0] if units else None, size, load)

    return [channel(field) for field in schema if _is_numeric(pa.types, field.type)]


def _is_numeric(types: Any, kind: Any) -> bool:
    return any(fits(kind) for fits in (types.is_integer, types.is_floating, types.is_timestamp, types.is_duration))
