"""The tables of a record file, whatever its format."""

from __future__ import annotations

import gc
import logging
import re
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module

from ...errors import RecordError
from ..channels import Channel, ChannelTable, FloatArray
from ..content import Content
from ..source import text_source
from ..tables import Table, TextTable
from ..units import quoted
from .kinds import Kind, kind_of

_MAX_GROUPS = 1000
_OBJECT = re.compile(r"<[\w.]+ object at 0x[0-9a-fA-F]+>")  # the bytes of the file, as libraries name them


def tables_of(content: Content) -> list[Table]:
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
    with _guarded(kind, where):
        read = import_module(f".{kind.module}", __package__).read_tables(content)
    if not read:
        raise RecordError(f"{where}: is {kind.name} without columns of numbers; give one with displacement and force.")
    if isinstance(read[0], Channel):
        return _groups(kind, read, where)
    return list(read)


def _groups(kind: Kind, channels: Sequence[Channel], where: str) -> list[Table]:
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


def _guarded_channel(kind: Kind, channel: Channel, where: str) -> Channel:
    def load() -> tuple[FloatArray, FloatArray | None]:
        with _guarded(kind, where):
            return channel.load()

    return replace(channel, load=load)


@contextmanager
def _guarded(kind: Kind, where: str) -> Iterator[None]:
    """Turn whatever a library reports about a damaged file into one sentence, and let it print nothing."""
    logged, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda _: None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                yield
            except BaseException as problem:
                _close_files(problem)
                raise _refusal(problem, kind, where) from None
    finally:
        logging.disable(logged)
        sys.unraisablehook = hook


def _refusal(problem: BaseException, kind: Kind, where: str) -> BaseException:
    # Libraries report damaged files by exceptions of every kind, those in Rust by a BaseException.
    if isinstance(problem, RecordError) or not (
        isinstance(problem, Exception) or type(problem).__name__ == "PanicException"
    ):
        return problem
    if isinstance(problem, ImportError):
        return RecordError(
            f"{where}: is {kind.name}, which needs {problem.name or 'a library'} to be read; "
            'install it with pip install "strandspring[formats]".'
        )
    if isinstance(problem, MemoryError):
        return RecordError(f"{where}: is {kind.name} that needs too much memory; thin the record out or split it.")
    text = " ".join(_OBJECT.sub("the file", str(problem)).split())
    reason = quoted(text) if text else type(problem).__name__
    return RecordError(
        f"{where}: is {kind.name} that is damaged or cut off, or of a kind that cannot be read ({reason}); export the "
        "record again, or as CSV."
    )


def _close_files(problem: BaseException | None) -> None:
    """Let go of what libraries leave open, which complains when it is collected later."""
    while problem is not None:
        traceback.clear_frames(problem.__traceback__)
        problem = problem.__context__
    gc.collect()
