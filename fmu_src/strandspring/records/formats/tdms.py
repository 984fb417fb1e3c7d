"""TDMS files of LabVIEW and its relatives, read by npTDMS."""

from __future__ import annotations

import io

import nptdms
import numpy as np

from ..channels import Channel
from ..content import FileContent
from ..record import FloatArray
from .named_arrays import seconds


def read_tables(content: FileContent) -> list[Channel]:
    """Channels of all groups, with unit and, of waveforms, the times of the samples."""
    file = nptdms.TdmsFile.open(io.BytesIO(content.data))
    return [_channel(channel) for group in file.groups() for channel in group.channels() if _is_numeric(channel)]


def _is_numeric(channel: nptdms.TdmsChannel) -> bool:
    return channel.dtype.kind in "fiuM" and len(channel) > 1


def _channel(channel: nptdms.TdmsChannel) -> Channel:
    properties = channel.properties
    unit = properties.get("unit_string")
    step, begin = properties.get("wf_increment"), properties.get("wf_start_offset", 0.0)
    is_waveform = isinstance(step, float) and isinstance(begin, float) and step > 0.0
    size = len(channel)

    def load() -> tuple[FloatArray, FloatArray | None]:
        time = begin + step * np.arange(size, dtype=np.float64) if is_waveform else None
        return seconds(channel[:]), time

    moments = channel.dtype.kind == "M"
    stated_unit = "s" if moments else unit if isinstance(unit, str) else None
    return Channel(channel.group_name, channel.name, stated_unit, size, load, is_waveform)
