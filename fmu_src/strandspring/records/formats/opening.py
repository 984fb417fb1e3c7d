"""The tables of a record file, whatever its format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module

from ...errors import RecordError
from ..channels import Channel, ChannelTable, FloatArray
from ..content import FileContent
from ..source import text_source
from ..tables import Sheet, SourceTable, TextTable, sheet_tables
from .guarding import guarded
from .kinds import FormatKind, kind_of
from .reader_process import read_in_process

_MAX_GROUPS = 1000
_IN_PROCESS = (
    "arrow",
    "hdf5",
    "matlab",
    "mdf",
    "tdms",
    "uff",
    "workbook",
)  # which damaged bytes make crash, hang or take all memory


def tables_of(content: FileContent) -> list[SourceTable]:
    """The tables of a file: one of a delimited text, one per sheet of a workbook, one per group of channels.

    Raises
    ------
    RecordError   If the file is of a kind that cannot be read, its library is missing, or it is damaged.
    """
    kind = kind_of(content.data)
    where = content.path
    if kind is None:
        return [TextTable(text_source(content))]
    if not kind.module:
        raise RecordError(f"{where}: is {kind.name}; {kind.advice}.")
    if kind.module in _IN_PROCESS:
        read = read_in_process(kind.module, kind.name, content)
    else:
        with guarded(kind.name, where):
            read = import_module(f".{kind.module}", __package__).read_tables(content)
    if not read:
        raise RecordError(f"{where}: is {kind.name} without columns of numbers; give one with displacement and force.")
    if sheets := [sheet for sheet in read if isinstance(sheet, Sheet)]:
        return sheet_tables(sheets, where)
    return _groups(kind, [channel for channel in read if isinstance(channel, Channel)], where)


def _groups(kind: FormatKind, channels: Sequence[Channel], where: str) -> list[SourceTable]:
    """The channels by their groups, their loading guarded."""
    groups: dict[str, list[Channel]] = {}
    for channel in channels:
        groups.setdefault(channel.group, []).append(_guarded_channel(kind, channel, where))
    if len(groups) > _MAX_GROUPS:
        raise RecordError(
            f"{where}: must have at most {_MAX_GROUPS} groups of channels, found {len(groups)}; export the record as "
            "CSV."
        )
    return [ChannelTable(members, where, name) for name, members in groups.items()]


def _guarded_channel(kind: FormatKind, channel: Channel, where: str) -> Channel:
    def load() -> tuple[FloatArray, FloatArray | None]:
        with guarded(kind.name, where):
            return channel.load()

    return replace(channel, load=load)
