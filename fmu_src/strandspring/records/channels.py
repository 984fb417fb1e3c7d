"""Channels of a binary file as a table: of one length, or brought to one by the times at which they were sampled."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.quoting import quoted
from .bad_rows import MAX_DROPPED_ROWS, incomplete
from .columns import Column, choose_unit, named_columns
from .record import FloatArray
from .source import MAX_ROWS
from .tables import FileTables, Table

_MAX_GROUPS = 1000
# Difference between two time bases that is called none, share of the time step.
_SAME_TIME = 1e-3
# Error of a linear interpolation, by second differences, up to which it is honest, share of the channel's range.
_HONEST = 2e-3


@dataclass(frozen=True, eq=False)
class Channel:
    """One channel of a file, read when it is wanted.

    Attributes
    ----------
    group : str      Name of the group, "" without.
    name : str       Name as the file gives it, "" without.
    unit : str       Unit as the file gives it, None without.
    size : int       Number of values K.
    load : callable  Gives the values, shape (K,), and the times at which they were sampled, shape (K,) [s] or None.
    timed : bool     Whether there are such times.
    """

    group: str
    name: str
    unit: str | None
    size: int
    load: Callable[[], tuple[FloatArray, FloatArray | None]]
    timed: bool = False


def channel_tables(channels: Sequence[Channel], where: str) -> FileTables:
    """The channels of a file by their groups, and all of them as one table if there are several.

    Raises
    ------
    RecordError   If there are too many groups.
    """
    groups: dict[str, list[Channel]] = {}
    for channel in channels:
        groups.setdefault(channel.group, []).append(channel)
    if len(groups) > _MAX_GROUPS:
        raise RecordError(
            f"{where}: must have at most {_MAX_GROUPS} groups of channels, found {len(groups)}; export the record as "
            "CSV."
        )
    tables = [ChannelTable(members, where, name) for name, members in groups.items()]
    if len(tables) == 1:
        return FileTables(where, tables)
    united = ChannelTable([channel for table in tables for channel in table.timed_channels()], where, qualified=True)
    return FileTables(where, tables, united)


class ChannelTable(Table):
    """Channels as a table.

    Parameters
    ----------
    channels : sequence of Channel
    where : str       File, for messages.
    name : str        Of their group.
    qualified : bool  Whether the columns are called "group/channel".
    """

    def __init__(self, channels: Sequence[Channel], where: str, name: str = "", qualified: bool = False) -> None:
        self.channels = channels
        self.where = where
        self.name = name
        self.columns = [_column(k, channel, qualified) for k, channel in enumerate(channels, 1)]
        if any(channel.timed for channel in channels) and not named_columns(self.columns, "time"):
            # The time base of whichever channels are read.
            number = len(channels) + 1
            self.columns.append(Column.from_header(number, "time", "s", content="time base of the channels"))

    def read(
        self, wanted: Collection[Column], optional: Column | None = None
    ) -> tuple[dict[int, FloatArray], list[Finding]]:
        """See `Table.read`."""
        own_columns = [column for column in wanted if column.number <= len(self.channels)]
        values, times = {}, {}
        for column in own_columns:
            values[column.number], times[column.number] = self._load(column)
        findings: list[Finding] = []
        sizes = {column.number: values[column.number].size for column in own_columns}
        if optional is not None and optional.number in sizes:
            others = [size for number, size in sizes.items() if number != optional.number]
            if len({*others}) == 1 and sizes[optional.number] != others[0]:
                counts = {"values": sizes[optional.number], "others": others[0]}
                findings.append(Finding(Outcome.TIME_LEFT_OUT, {"column": str(optional), **counts}))
                own_columns = [column for column in own_columns if column is not optional]
        base, interpolated = self._on_one_base(own_columns, values, times)
        findings += interpolated
        read = {column.number: values[column.number] for column in own_columns}
        clock = self.columns[-1]
        if clock.number > len(self.channels) and clock in wanted:
            if base is not None:
                read[clock.number] = base
            elif clock is optional:
                findings.append(Finding(Outcome.TIME_LEFT_OUT, {"problem": "the channels chosen have none"}))
            else:
                raise RecordError(f"{self.where}, {clock}: the channels chosen have no times; name another column.")
        return self._finite(read, optional, findings)

    def places(self, rows: Collection[int]) -> list[int]:
        """1-based rows."""
        return [row + 1 for row in sorted(rows)]

    def timed_channels(self) -> list[Channel]:
        """The channels, with the times of the one that holds the time of this group, which is then left out."""
        clocks = [column for column in named_columns(self.columns, "time") if column.number <= len(self.channels)]
        if len(clocks) != 1:
            return list(self.channels)
        clock = self.channels[clocks[0].number - 1]
        try:
            _, factor, _ = choose_unit(clocks[0], "time", None, self.where)
        except RecordError:  # it is a channel like the others
            return list(self.channels)

        def with_times(channel: Channel) -> Channel:
            if channel.timed or channel.size != clock.size:
                return channel
            return replace(channel, load=lambda: (channel.load()[0], factor * clock.load()[0]), timed=True)

        return [with_times(channel) for channel in self.channels if channel is not clock]

    def _load(self, column: Column) -> tuple[FloatArray, FloatArray | None]:
        channel = self.channels[column.number - 1]
        if channel.size > MAX_ROWS:
            raise RecordError(
                f"{self.where}, {column}: must have at most {MAX_ROWS} values, found {channel.size}; thin the record "
                "out or split it."
            )
        return channel.load()

    def _on_one_base(
        self, columns: Sequence[Column], values: dict[int, FloatArray], times: dict[int, FloatArray | None]
    ) -> tuple[FloatArray | None, list[Finding]]:
        """The time base of all channels, which are brought to one in place."""
        bases = [base for column in columns if (base := times[column.number]) is not None]
        sizes = {values[column.number].size for column in columns}
        if len(sizes) == 1 and all(_is_same_time(bases[0], base) for base in bases):
            return (bases[0] if bases else None), []
        listed = ", ".join(f"{column} ({values[column.number].size} values)" for column in columns)
        apart = f"{self.where}: the channels are not sampled at the same moments: {listed}"
        if len(bases) < len(columns) or any(base.size < 3 or not (np.diff(base) > 0.0).all() for base in bases):
            raise RecordError(f"{apart}, and not all have rising times; export them at one sampling rate.")
        begin, end = max(base[0] for base in bases), min(base[-1] for base in bases)
        finest = min(bases, key=lambda base: float(np.median(np.diff(base))))
        finest = finest[(finest >= begin) & (finest <= end)]
        if finest.size < 2:
            raise RecordError(f"{apart}, and never at the same time; name channels of one measurement.")
        findings = []
        for column, base in zip(columns, bases, strict=True):
            series = values[column.number]
            if base.size >= finest.size and np.isin(finest, base).all():
                values[column.number] = series[np.isin(base, finest)]
                continue
            error = float(np.max(np.abs(np.diff(series, 2)), initial=0.0)) / 8.0
            span = float(np.ptp(series))
            if not error <= _HONEST * span:
                raise RecordError(
                    f"{apart}, and {column} is too coarse to be interpolated (by up to "
                    f"{100.0 * error / max(span, 1e-300):.2g} % of its range); export them at one sampling rate."
                )
            values[column.number] = np.interp(finest, base, series)
            numbers = {"column": str(column), "times": ((float(begin), float(end)),)}
            findings.append(Finding(Outcome.INTERPOLATED, numbers))
        return finest, findings

    def _finite(
        self, read: dict[int, FloatArray], optional: Column | None, findings: list[Finding]
    ) -> tuple[dict[int, FloatArray], list[Finding]]:
        """Rows of finite numbers: empty rows at the end are cut off, and as many incomplete ones as of a text."""
        needed = [number for number in read if optional is None or number != optional.number]
        size = read[needed[0]].size
        empty = np.logical_and.reduce([np.isnan(read[number]) for number in needed])
        size = int(np.flatnonzero(~empty)[-1]) + 1 if not empty.all() else 0
        if size < empty.size:
            findings.append(Finding(Outcome.EMPTY_ROWS, {"count": empty.size - size}))
        read = {number: series[:size] for number, series in read.items()}
        if optional is not None and optional.number in read and not np.isfinite(read[optional.number]).all():
            bad = int(np.argmin(np.isfinite(read[optional.number])))
            numbers = {"column": str(optional), "problem": f"row {bad + 1}, must hold a finite number"}
            findings.append(Finding(Outcome.TIME_LEFT_OUT, numbers))
            del read[optional.number]
        partial = np.logical_or.reduce([np.isnan(read[number]) for number in needed])
        first = int(np.argmax(partial)) if partial.any() else size
        if 0 < size - first <= MAX_DROPPED_ROWS and partial[first:].all():
            findings.append(incomplete(size - first, "row", first + 1))
            read = {number: series[:first] for number, series in read.items()}
        for number in needed:
            series = read[number]
            if not (finite := np.isfinite(series)).all():
                row = int(np.argmin(finite))
                raise RecordError(
                    f"{self.where}, row {row + 1}, {self.columns[number - 1]}: must hold a finite number, found "
                    f"{quoted(str(series[row]))}; correct or delete the row."
                )
        return read, findings


def _column(number: int, channel: Channel, qualified: bool) -> Column:
    column = Column.from_header(number, channel.name, channel.unit, content=f"{channel.size} values")
    if not (qualified and channel.group):
        return column
    return replace(column, name=f"{channel.group}/{channel.name or number}")


def _is_same_time(first: FloatArray, other: FloatArray) -> bool:
    if first is other:
        return True
    if first.size != other.size:
        return False
    step = float(np.median(np.abs(np.diff(first)))) if first.size > 1 else 0.0
    return bool(np.max(np.abs(first - other), initial=0.0) <= _SAME_TIME * step)
