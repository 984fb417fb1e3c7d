"""Checks that a command does not overwrite its input."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import click


def refuse_overwriting(inputs: Iterable[str | Path], outputs: Mapping[str, str | Path | None]) -> None:
    """Refuse an output that is an input of the same command, or another output of it, by whatever path.

    Parameters
    ----------
    inputs : iterable of paths
    outputs : mapping            Path of each option; None where nothing is written.

    Raises
    ------
    click.UsageError             With the option and the path.
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


def _is_same_file(one: str | Path, other: str | Path) -> bool:
    """Whether two paths lead to the same file, which need not exist."""
    try:
        return Path(one).samefile(other)
    except OSError:
        return os.path.realpath(one) == os.path.realpath(other)
