"""Checks of output paths before a command begins its work."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import click

from ...errors import StrandspringError
from ...ground.files import refuse_unwritable
from ...ground.plotfile import SUFFIXES
from ...report import check_report_path

# Endings that promise a format.
_PROMISES = frozenset(
    (
        ".csv", ".feather", ".fmu", ".gz", ".h5", ".hdf5", ".html", ".json", ".mat", ".mdf", ".mf4", ".mo",
        ".npy", ".npz", ".ods", ".parquet", ".pdf", ".png", ".ssp", ".ssv", ".svg", ".tdms", ".toml", ".uff", ".xls",
        ".xlsx", ".xml", ".zip",
    )
)  # fmt: skip


class OutputFile(click.types.StringParamType):
    """A file to write.

    Parameters
    ----------
    endings : str   With the dot. If there are several, the name must have one of them, which chooses the format; a
                    single one is added to a name without any that is not that of a file that is there, and a name that
                    promises another format is refused.
    """

    def __init__(self, *endings: str) -> None:
        self._endings = endings

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        path, (ending, *others) = Path(value), self._endings
        if others and path.suffix.lower() not in self._endings:
            self.fail(f"must end in {', '.join(self._endings)}, got {str(value)!r}.", param, ctx)
        if not others and path.suffix.lower() in _PROMISES - {ending}:
            self.fail(f"{value} would be written as {ending}; give a name that ends in {ending}.", param, ctx)
        is_bare = path.name and not path.suffix and not os.path.exists(value)  # noqa: PTH110 - of a long name, too
        return f"{value}{ending}" if is_bare else str(value)


class ReportFile(click.types.StringParamType):
    """A report to write."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        try:
            check_report_path(value)
        except StrandspringError as refusal:
            self.fail(str(refusal), param, ctx)
        return str(value)


PLOT_FILE, REPORT_FILE = OutputFile(*SUFFIXES), ReportFile()


def refuse_overwriting(inputs: Iterable[str | Path], outputs: Mapping[str, str | Path | None]) -> None:
    """Refuse an output that cannot be written, or is an input or another output of the same command, by whatever path.

    Parameters
    ----------
    inputs : iterable of paths
    outputs : mapping            Path of each option; None where nothing is written.

    Raises
    ------
    click.UsageError             With the option and the path.
    StrandspringError            If an output cannot be written.
    """
    read = list(inputs)
    written: dict[str, str | Path] = {}
    for option, path in outputs.items():
        if path is None:
            continue
        for source in read:
            if _is_same_file(path, source):
                raise click.UsageError(f"{option} {path} would overwrite the input {source}; write elsewhere.")
        for other, taken in written.items():
            if _is_same_file(path, taken):
                raise click.UsageError(f"{option} must be another file than {other}, got {path} for both.")
        written[option] = path
    for path in written.values():
        refuse_unwritable(Path(path))


def _is_same_file(path: str | Path, other: str | Path) -> bool:
    """Whether two paths lead to the same file, which need not exist."""
    try:
        return Path(path).samefile(other)
    except OSError:
        return os.path.realpath(path) == os.path.realpath(other)
