"""MDF files (versions 3 and 4), read by asammdf."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from asammdf import MDF

from ..channels import Channel
from ..content import FileContent
from ..record import FloatArray

_MASTER_TYPES = {3: (1,), 4: (2, 3)}  # by the first digit of the version; virtual masters too
_TIME = 1  # type of synchronisation in version 4


def read_tables(content: FileContent) -> list[Channel]:
    """Channels of all groups with more than one sample, with their units and times."""
    file: Any = MDF(io.BytesIO(content.data))
    version = int(str(file.version)[0])
    channels: list[Channel] = []
    for number, group in enumerate(file.groups):
        masters = [c for c in group.channels if c.channel_type in _MASTER_TYPES[version]]
        timed = any(version == 3 or c.sync_type == _TIME for c in masters)
        name = _name(group.channel_group, number)
        for index, channel in enumerate(group.channels):
            if not (timed and channel in masters):
                channels.append(_channel(file, number, index, name, timed))
    return [channel for channel in channels if channel.size > 1]


def _name(group: Any, number: int) -> str:
    names = (getattr(group, "acq_name", None), getattr(group, "comment", None))
    short = [name for name in names if isinstance(name, str) and name and len(name) < 60 and not name.startswith("<")]
    return short[0] if short else f"group {number + 1}"


def _channel(file: Any, group: int, index: int, name: str, timed: bool) -> Channel:
    channel = file.groups[group].channels[index]
    size = int(file.groups[group].channel_group.cycles_nr)

    def load() -> tuple[FloatArray, FloatArray | None]:
        signal = file.get(group=group, index=index)
        if signal.samples.dtype.kind not in "fiub" or signal.samples.ndim != 1:
            raise ValueError(f"the channel {channel.name} holds no numbers")
        values = signal.samples.astype(np.float64)
        return values, signal.timestamps.astype(np.float64) if timed else None

    unit = file.get_channel_unit(group=group, index=index)
    return Channel(name, channel.name, unit or None, size, load, timed)
