"""Checks of output paths before a command begins its work."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import click

from ..files import refuse_unwritable
from ..plotfile import SUFFIXES


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


def refuse_other_plots(plot: str | None) -> None:
    """Refuse a --plot in a format that is not drawn; raises click.UsageError."""
    if plot is not None and Path(plot).suffix.lower() not in SUFFIXES:
        raise click.UsageError(f"--plot must end in {', '.join(SUFFIXES)}, got {plot!r}.")


def _is_same_file(one: str | Path, other: str | Path) -> bool:
    """Whether two paths lead to the same file, which need not exist."""
    try:
        return Path(one).samefile(other)
    except OSError:
        return os.path.realpath(one) == os.path.realpath(other)
